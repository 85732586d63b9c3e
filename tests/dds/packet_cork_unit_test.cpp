// Packets on their way out: each one once, and together where a cork holds them back. Sent through the transports of a
// participant, as Fast DDS does, to a socket of the test.
#include "idl/transport/rtps_guard/packet_cork.h"

#include <arpa/inet.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <unistd.h>

#include <memory>
#include <string>

#include "idl/transport/fastdds/host_local_udp.h"
#include "idl/transport/rtps_guard/guard_transport.h"
#include "idl/transport/rtps_guard/rtps_submessage.h"
#include "tests/support/rtps_packets.h"

namespace takt {
namespace {

using Bytes = std::vector<std::uint8_t>;
using testing::ElementsAre;
using testing::IsEmpty;

Bytes sample(std::uint8_t content) {
  return test::Packet().data(test::kReader, test::kWriter, 4, {0, 1, 0, 0, 1, 2, 3, content}).wire.bytes;
}
/// Submessages behind the header of the first.
Bytes joined(const std::vector<Bytes>& packets) {
  Bytes all = packets.front();
  for (std::size_t i = 1; i < packets.size(); ++i)
    all.insert(all.end(), packets[i].begin() + kRtpsHeaderBytes, packets[i].end());
  return all;
}

/// Receives datagrams on a port of its own.
class Address {
 public:
  Address() : socket_(socket(AF_INET, SOCK_DGRAM, 0)) {
    place_.sin_family = AF_INET;
    place_.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof(place_);
    EXPECT_EQ(bind(socket_, reinterpret_cast<const sockaddr*>(&place_), size), 0);
    EXPECT_EQ(getsockname(socket_, reinterpret_cast<sockaddr*>(&place_), &size), 0);
    locator_ = rtps::Locator_t(LOCATOR_KIND_UDPv4, ntohs(place_.sin_port));
    rtps::IPLocator::setIPv4(locator_, 127, 0, 0, 1);
  }
  ~Address() { close(socket_); }
  Address(const Address&) = delete;
  Address& operator=(const Address&) = delete;
  const rtps::Locator_t& locator() const { return locator_; }
  /// What was sent until now, up to a mark: under load the kernel delivers later than the call that sends.
  std::vector<Bytes> received() const {
    std::vector<Bytes> all;
    const char mark = 0;
    EXPECT_EQ(
        sendto(socket_, &mark, sizeof(mark), 0, reinterpret_cast<const sockaddr*>(&place_), sizeof(place_)),
        1);
    for (;;) {
      Bytes packet(1U << 16U);
      const ssize_t size = recv(socket_, packet.data(), packet.size(), 0);
      if (size <= 1) return all;
      packet.resize(static_cast<std::size_t>(size));
      all.push_back(packet);
    }
  }

 private:
  int socket_;
  sockaddr_in place_{};
  rtps::Locator_t locator_;
};

class PacketsSent : public testing::Test {
 protected:
  void open(bool encrypted = false) {
    dds::DomainParticipantQos qos;
    qos.transport().use_builtin_transports = false;
    auto udp = std::make_shared<ThisMachineUdp>();
    udp->sendBufferSize = udp->receiveBufferSize = 1U << 20U;
    qos.transport().user_transports = {udp};
    guard_ = guard_transports(qos, 0, encrypted);
    transport_.reset(qos.transport().user_transports.back()->create_transport());
    ASSERT_TRUE(transport_->init());
    for (const Address* address : {&one_, &other_})
      ASSERT_TRUE(transport_->OpenOutputChannel(senders_, address->locator()));
    ASSERT_FALSE(senders_.empty());
  }
  /// Through every sender, as a participant does.
  void send(const Bytes& packet, const Address& to) {
    for (auto& sender : senders_) (void)send_packet(*sender, packet, to.locator());
  }

  Address one_, other_;
  std::shared_ptr<PacketGuard> guard_;
  std::unique_ptr<transports::TransportInterface> transport_;
  transports::SendResourceList senders_;
};

TEST_F(PacketsSent, EachArrivesOnceHoweverManyInterfacesThereAre) {
  open();
  send(sample(1), one_);
  send(sample(2), one_);
  EXPECT_THAT(one_.received(), ElementsAre(sample(1), sample(2)));
}

TEST_F(PacketsSent, UnderACorkThoseToOneAddressLeaveTogether) {
  open();
  {
    const PacketCork cork;
    send(sample(1), one_);
    send(sample(2), other_);
    {
      const PacketCork within;
      send(sample(3), one_);
    }
    EXPECT_THAT(one_.received(), IsEmpty());
  }
  EXPECT_THAT(one_.received(), ElementsAre(joined({sample(1), sample(3)})));
  EXPECT_THAT(other_.received(), ElementsAre(sample(2)));
  send(sample(4), one_);
  EXPECT_THAT(one_.received(), ElementsAre(sample(4)));
}

TEST_F(PacketsSent, WhatCannotBeJoinedLeavesInOrder) {
  open();
  const Bytes large = test::Packet().data(test::kReader, test::kWriter, 4, Bytes(59'940, 7)).wire.bytes;
  auto list = test::participant(false);
  const Bytes discovery = test::Packet().data(0, test::kSpdpWriter, 4, list.u16(1).u16(0).bytes).wire.bytes;
  {
    const PacketCork cork;
    send(sample(1), one_);
    send(discovery, one_);
    EXPECT_THAT(one_.received(), ElementsAre(sample(1), discovery));
    send(sample(2), one_);
    send(large, one_);
  }
  EXPECT_THAT(one_.received(), ElementsAre(sample(2), large));
}

TEST_F(PacketsSent, OfASecuredParticipantAreNotJoined) {
  open(true);
  const PacketCork cork;
  send(sample(1), one_);
  EXPECT_THAT(one_.received(), ElementsAre(sample(1)));
}

TEST(JoinablePart, EndsAheadOfStatisticsAndIsEmptyForWhatNeedsTheEndOfThePacket) {
  const auto part = [](const Bytes& packet) {
    const auto bytes = joinable_part(packet);
    return Bytes(bytes.begin(), bytes.end());
  };
  EXPECT_EQ(part(sample(1)), sample(1));
  Bytes with_statistics = sample(1);
  Bytes statistics{kFastDdsStatistics, 1, 56, 0};
  statistics.resize(60);
  with_statistics.insert(with_statistics.end(), statistics.begin(), statistics.end());
  EXPECT_EQ(part(with_statistics), sample(1));
  Bytes in_the_middle = with_statistics;
  const Bytes more = sample(2);
  in_the_middle.insert(in_the_middle.end(), more.begin() + kRtpsHeaderBytes, more.end());
  EXPECT_THAT(part(in_the_middle), IsEmpty());
  Bytes open_end = sample(1);
  open_end[kRtpsHeaderBytes + 2] = open_end[kRtpsHeaderBytes + 3] = 0;
  EXPECT_THAT(part(open_end), IsEmpty());
  Bytes encrypted = sample(1);
  encrypted[kRtpsHeaderBytes] = kSecurePrefix;
  EXPECT_THAT(part(encrypted), IsEmpty());
  Bytes cut = sample(1);
  cut.pop_back();
  EXPECT_THAT(part(cut), IsEmpty());
  Bytes header = sample(1);
  header.resize(kRtpsHeaderBytes);
  EXPECT_THAT(part(header), IsEmpty());
}

}  // namespace
}  // namespace takt

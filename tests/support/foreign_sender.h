#pragma once
// A stranger on loopback that sends RTPS packets in the name of others, from a socket of its own. Uses no DDS.
#include <arpa/inet.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "tests/support/rtps_packets.h"

namespace takt::test {

using GuidPrefixBytes = std::array<std::uint8_t, 12>;
using PacketBytes = std::vector<std::uint8_t>;

/// Sends each packet to every port of a domain that a participant of this machine may have.
class ForeignSender {
 public:
  explicit ForeignSender(std::uint32_t domain)
      : socket_(socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0)), first_port_(7400 + 250 * domain + 10) {
    if (socket_ < 0) throw std::runtime_error("no socket");
  }
  ~ForeignSender() { close(socket_); }
  ForeignSender(const ForeignSender&) = delete;
  ForeignSender& operator=(const ForeignSender&) = delete;

  void send(const PacketBytes& packet) const {
    constexpr std::uint32_t participants = 70;  // takt's clients have the numbers 10 to 59
    for (std::uint32_t i = 0; i < 2 * participants; ++i) send_to(packet, first_port_ + i);
  }
  /// To the port of discovery of each participant.
  void announce(const PacketBytes& packet) const {
    constexpr std::uint32_t participants = 70;
    for (std::uint32_t i = 0; i < participants; ++i) send_to(packet, first_port_ + 2 * i);
  }
  void send_to(const PacketBytes& packet, std::uint32_t port) const {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    address.sin_port = htons(static_cast<std::uint16_t>(port));
    // Ports without a listener are reported as errors of later packets.
    for (int attempt = 0; attempt < 3; ++attempt)
      if (sendto(socket_, packet.data(), packet.size(), 0, reinterpret_cast<const sockaddr*>(&address),
                 sizeof(address)) >= 0)
        return;
  }

 private:
  int socket_;
  std::uint32_t first_port_;
};

/// Packets in the name of one participant.
class Forgery {
 public:
  explicit Forgery(const GuidPrefixBytes& prefix) : prefix_(prefix) {}

  PacketBytes participant_ends(std::int64_t number = 1000) const {
    return finished(Packet().data(0x000100c7, kSpdpWriter, 2, end_of(0x000001c1), number));
  }
  PacketBytes writer_ends(std::uint32_t writer, std::int64_t number = 1000) const {
    return finished(Packet().data(0x000003c7, kSedpWriter, 2, end_of(writer), number));
  }
  PacketBytes reader_ends(std::uint32_t reader, std::int64_t number = 1000) const {
    return finished(Packet().data(0x000004c7, 0x000004c2, 2, end_of(reader), number));
  }
  /// `cdr`: with its head of four bytes.
  PacketBytes sample(std::uint32_t writer, std::int64_t number, std::string_view cdr) const {
    return finished(Packet().data(0, writer, 4, {cdr.begin(), cdr.end()}, number));
  }
  PacketBytes heartbeat(std::uint32_t writer, std::int64_t first, std::int64_t last,
                        std::uint32_t count = 1'000'000) const {
    return finished(
        Packet().submessage(0x07, 0, Wire().id(0).id(writer).sequence(first).sequence(last).u32(count)));
  }
  PacketBytes gap(std::uint32_t writer, std::int64_t first, std::int64_t next) const {
    return finished(
        Packet().submessage(0x08, 0, Wire().id(0).id(writer).sequence(first).sequence(next).u32(0)));
  }
  PacketBytes acknowledgement(std::uint32_t reader, std::uint32_t writer, std::int64_t next,
                              std::uint32_t count = 1'000'000) const {
    return finished(
        Packet().submessage(0x06, 2, Wire().id(reader).id(writer).sequence(next).u32(0).u32(count)));
  }
  /// A reader lacks these samples, at most 256.
  PacketBytes request(std::uint32_t reader, std::uint32_t writer, std::int64_t first, std::uint32_t samples,
                      std::uint32_t count = 1) const {
    Wire body;
    body.id(reader).id(writer).sequence(first).u32(samples);
    for (std::uint32_t at = 0; at < samples; at += 32)
      body.u32(samples - at >= 32 ? 0xffffffffU : ~(0xffffffffU >> (samples - at)));
    return finished(Packet().submessage(0x06, 2, body.u32(count)));
  }
  /// An announcement with an address without a listener.
  PacketBytes announcement(std::uint32_t lease_s, std::int64_t number = 1) const {
    Wire list;
    list.u8(0).u8(3).fill(2);
    list.parameter(0x0015, {2, 2, 0, 0}).parameter(0x0016, {1, 15, 0, 0});
    list.parameter(0x0050, own_guid(0x000001c1));
    list.parameter(0x0002, Wire().u32(lease_s).u32(0).bytes);
    list.parameter(0x0058, Wire().u32(0x00000c3f).bytes);
    const auto nowhere = Wire().u32(1).u32(9).fill(12).add({127, 0, 0, 1}).bytes;
    list.parameter(0x0032, nowhere).parameter(0x0031, nowhere);
    list.u16(1).u16(0);
    return finished(Packet().data(0x000100c7, kSpdpWriter, 4, list.bytes, number));
  }

 private:
  std::vector<std::uint8_t> own_guid(std::uint32_t entity) const {
    return Wire().add({prefix_.begin(), prefix_.end()}).id(entity).bytes;
  }
  /// Key and status ahead of data that are not there: disposed and unregistered.
  std::vector<std::uint8_t> end_of(std::uint32_t entity) const {
    return Wire().parameter(0x70, own_guid(entity)).parameter(0x71, {0, 0, 0, 3}).u16(1).u16(0).bytes;
  }
  PacketBytes finished(const Packet& packet) const {
    constexpr std::size_t sender_at = 8;
    PacketBytes bytes = packet.wire.bytes;
    std::copy(prefix_.begin(), prefix_.end(), bytes.begin() + sender_at);
    return bytes;
  }
  GuidPrefixBytes prefix_;
};

/// Of a participant that does not exist.
inline GuidPrefixBytes invented_prefix(std::uint32_t number) {
  GuidPrefixBytes prefix{1, 15, 0xde, 0xad};
  for (std::size_t i = 0; i < 4; ++i) prefix[8 + i] = static_cast<std::uint8_t>(number >> (8 * i));
  return prefix;
}

}  // namespace takt::test

// Packets that name another sender, and announcements without an answer.
#include <gtest/gtest.h>

#include <algorithm>
#include <memory>

#include "idl/transport/rtps_guard/rtps_guard.h"
#include "idl/transport/rtps_guard/rtps_packet_memory.h"
#include "tests/support/rtps_packets.h"

namespace takt {
namespace {

using test::guid;
using test::kReader;
using test::kSpdpWriter;
using test::kWriter;
using test::Packet;
using test::Wire;
using Bytes = std::vector<std::uint8_t>;

const Bytes kSample{0, 1, 0, 0, 1, 2, 3, 4};

/// A session whose time the test sets.
class RtpsGuardSources : public testing::Test {
 protected:
  std::string flaw(const Packet& packet, std::uint64_t source) {
    PacketOrigin origin;
    origin.source = source;
    origin.address = 5;
    return std::string(to_string(inspect_packet(packet.wire.bytes, {}, memory_.get(), origin).flaw));
  }
  void prove(std::uint64_t source) {
    for (now_s = 100; now_s < 110; ++now_s) EXPECT_EQ(flaw(sample(), source), "none");
  }
  static Packet sample(std::int64_t number = 1) {
    return Packet().data(kReader, kWriter, 4, kSample, number);
  }

  static constexpr std::uint64_t kOwn = 11, kForeign = 12;
  static inline std::uint32_t now_s = 0;
  const std::unique_ptr<RtpsSessionState> memory_ = std::make_unique<RtpsSessionState>([] { return now_s; });
};

TEST_F(RtpsGuardSources, WhatIsSentInTheNameOfAnotherIsDropped) {
  prove(kOwn);
  EXPECT_EQ(flaw(sample(), kForeign), "source");
  Wire disposal;
  disposal.parameter(0x70, guid(7, 0x000001c1)).parameter(0x71, {0, 0, 0, 3}).u16(1).u16(0);
  const auto farewell = Packet().data(0, kSpdpWriter, 2, disposal.bytes);
  EXPECT_EQ(flaw(farewell, kForeign), "source");
  EXPECT_EQ(flaw(farewell, kOwn), "none");
  // A leap of the numbers that is dropped does not count as the confirmation of another one.
  const std::int64_t far = 1 << 20;
  for (int i = 0; i < 5; ++i) EXPECT_EQ(flaw(sample(far + i), kForeign), "source");
  EXPECT_EQ(flaw(sample(2), kOwn), "none");
}

TEST_F(RtpsGuardSources, ReadersOfCycloneThatAnswerAHeartbeatAreKnown) {
  constexpr std::uint8_t of_cyclone = 0x10;
  constexpr unsigned final = 2;
  ParticipantPlaces::Prefix foreign{}, own{};
  foreign.fill(7);
  own.fill(7);
  own[0] = 0x01;  // a GUID begins with the vendor
  own[1] = of_cyclone;
  const auto acknowledge = [&](const ParticipantPlaces::Prefix& sender, unsigned flags) {
    Packet sent = Packet().submessage(0x06, flags, Wire().id(kReader).id(kWriter).sequence(3).u32(0).u32(1));
    std::copy(sender.begin(), sender.end(), sent.wire.bytes.begin() + 8);
    EXPECT_EQ(flaw(sent, kOwn), "none");
  };
  acknowledge(own, 0);  // ahead of any heartbeat
  EXPECT_FALSE(memory_->is_synchronised(own, kWriter));
  acknowledge(own, final);
  EXPECT_TRUE(memory_->is_synchronised(own, kWriter));
  EXPECT_FALSE(memory_->is_synchronised(own, kWriter + 0x100));
  acknowledge(foreign, final);
  EXPECT_FALSE(memory_->is_synchronised(foreign, kWriter));
}

TEST_F(RtpsGuardSources, ThePartOfAPacketThatNamesAnotherSenderIsChecked) {
  prove(kOwn);
  Packet relayed;
  std::fill_n(relayed.wire.bytes.begin() + 8, 12, std::uint8_t{9});
  relayed.submessage(0x0c, 0, Wire().u32(0).u8(2).u8(2).u16(0).fill(12, 7))
      .data(kReader, kWriter, 4, kSample);
  EXPECT_EQ(flaw(relayed, kForeign), "source");
}

TEST_F(RtpsGuardSources, AnnouncementsWithoutAnAnswerDoNotTakeAllPlaces) {
  now_s = 100;
  unsigned refused = 0;
  for (unsigned i = 0; i < 300; ++i) {
    Packet packet;
    packet.wire.bytes[8] = static_cast<std::uint8_t>(i);
    packet.wire.bytes[9] = static_cast<std::uint8_t>(i >> 8U);
    Bytes identity(packet.wire.bytes.begin() + 8, packet.wire.bytes.begin() + 20);
    identity.insert(identity.end(), {0, 0, 1, 0xc1});
    Wire list;
    list.u8(0).u8(3).fill(2).parameter(0x0050, identity).parameter(0x0002, Wire().u32(3600).u32(0).bytes);
    const std::string found = flaw(packet.data(0, kSpdpWriter, 4, list.u16(1).u16(0).bytes), kForeign + i);
    refused += found == "crowded" ? 1U : 0U;
    if (found == "none") memory_->know(identity);
  }
  EXPECT_GE(refused, 300 - ParticipantPlaces::kOfOneAddress);
  now_s += ParticipantPlaces::kHurry_s;
  std::size_t dismissed = 0;
  while (const auto one = memory_->overdue_participant()) {
    Bytes identity(one->participant.begin(), one->participant.end());
    identity.insert(identity.end(), {0, 0, 1, 0xc1});
    memory_->forget(identity);
    ++dismissed;
  }
  EXPECT_EQ(dismissed, ParticipantPlaces::kOfOneAddress - ParticipantPlaces::kSilent);
}

}  // namespace
}  // namespace takt

#include "idl/transport/rtps_guard/rtps_guard.h"

#include <gtest/gtest.h>

#include <functional>
#include <memory>
#include <random>

#include "idl/transport/rtps_guard/rtps_packet_memory.h"
#include "idl/transport/rtps_guard/rtps_submessage.h"
#include "tests/support/effort.h"
#include "tests/support/rtps_packets.h"

namespace takt {
namespace {

using test::endpoint;
using test::guid;
using test::kReader;
using test::kSedpWriter;
using test::kSpdpWriter;
using test::kWriter;
using test::Packet;
using test::participant;
using test::Wire;
using Bytes = std::vector<std::uint8_t>;

constexpr std::uint32_t kNow_s = 0x60000000;

std::string flaw_of(const Bytes& packet, const GuardLimits& limits = {}, RtpsSessionState* sent = nullptr) {
  return std::string(to_string(inspect_packet(packet, limits, sent).flaw));
}
std::string flaw_of(const Packet& packet, const GuardLimits& limits = {}) {
  return flaw_of(packet.wire.bytes, limits);
}

Bytes ended(Wire list) {
  return list.u16(1).u16(0).bytes;
}
std::string participant_flaw(unsigned id, const Bytes& value, bool big = false) {
  return flaw_of(Packet(big).data(0, kSpdpWriter, 4, ended(participant(big).parameter(id, value))));
}
std::string endpoint_flaw(unsigned id, const Bytes& value, bool big = false) {
  return flaw_of(Packet(big).data(0, kSedpWriter, 4, ended(endpoint(big).parameter(id, value))));
}
Bytes small_sample() {
  return {0, 1, 0, 0, 1, 2, 3, 4};
}

/// The same checks in both byte orders.
class RtpsGuard : public testing::TestWithParam<bool> {
 protected:
  Packet packet() const { return Packet(GetParam()); }
  Wire wire() const { return Wire(GetParam()); }
};
INSTANTIATE_TEST_SUITE_P(ByteOrders, RtpsGuard, testing::Bool());

TEST_P(RtpsGuard, ValidPacketsPass) {
  EXPECT_EQ(flaw_of(packet()), "none");
  EXPECT_EQ(
      flaw_of(packet().submessage(0x09, 0, wire().u32(1).u32(2)).data(kReader, kWriter, 4, small_sample())),
      "none");
  EXPECT_EQ(flaw_of(packet().data(0, kSpdpWriter, 4, ended(participant(GetParam())))), "none");
  EXPECT_EQ(flaw_of(packet().data(0, kSedpWriter, 4, ended(endpoint(GetParam())))), "none");
  EXPECT_EQ(
      flaw_of(packet().submessage(0x07, 2, wire().id(kReader).id(kWriter).sequence(1).sequence(0).u32(1))),
      "none");
  EXPECT_EQ(flaw_of(packet().submessage(
                0x06, 2, wire().id(kReader).id(kWriter).sequence(3).u32(33).u32(1).u32(1).u32(1))),
            "none");
  EXPECT_EQ(
      flaw_of(packet().submessage(0x08, 0, wire().id(kReader).id(kWriter).sequence(3).sequence(9).u32(0))),
      "none");
  EXPECT_EQ(flaw_of(packet().submessage(0x83, 0, wire().fill(8))), "none") << "of another vendor";
  // Taken back by the key, with the status in front.
  Wire disposal = wire();
  disposal.parameter(0x70, guid(7, 0x000001c1)).parameter(0x71, {0, 0, 0, 3}).u16(1).u16(0);
  EXPECT_EQ(flaw_of(packet().data(0, kSpdpWriter, 2, disposal.bytes)), "none");
}

TEST_P(RtpsGuard, PropertiesOfCycloneDdsPass) {
  const bool big = GetParam();
  EXPECT_EQ(participant_flaw(0x59, wire().u32(0).bytes, big), "none");
  EXPECT_EQ(participant_flaw(0x59, wire().u32(0).u32(0).bytes, big), "none") << "and no binary ones";
  EXPECT_EQ(participant_flaw(0x59, wire().u32(0).u32(1).bytes, big), "text");
  EXPECT_EQ(participant_flaw(0x59, wire().u32(0).u32(0).u32(0).bytes, big), "text");
}

TEST_P(RtpsGuard, FramingIsChecked) {
  Bytes good = packet().data(kReader, kWriter, 4, small_sample()).wire.bytes;
  EXPECT_EQ(flaw_of(Bytes(good.begin(), good.begin() + 19)), "too_short");
  const auto with = [&](std::size_t at, std::uint8_t value) {
    Bytes changed = good;
    changed[at] = value;
    return flaw_of(changed);
  };
  EXPECT_EQ(with(3, 'X'), "not_rtps");
  EXPECT_EQ(with(4, 1), "version");
  EXPECT_EQ(with(GetParam() ? 23 : 22, 255), "submessage");
  for (std::size_t size = 21; size < good.size() - 4; ++size) {
    EXPECT_NE(flaw_of(Bytes(good.begin(), good.begin() + static_cast<std::ptrdiff_t>(size))), "none") << size;
  }
  EXPECT_EQ(flaw_of(packet().submessage(0x83, 0, wire().fill(6)).submessage(0x83, 0, wire().fill(4))),
            "alignment");
  EXPECT_EQ(flaw_of(packet().submessage(0x0e, 0, wire().fill(8))), "submessage");
  EXPECT_EQ(flaw_of(packet().submessage(0x0c, 0, wire().fill(16))), "submessage");
  EXPECT_EQ(flaw_of(packet().submessage(0x09, 0, wire().fill(4))), "submessage");
  EXPECT_EQ(flaw_of(packet().submessage(
                0x15, 4, wire().u16(0).u16(0xfff0).id(kReader).id(kWriter).sequence(1).add(small_sample()))),
            "submessage")
      << "a negative jump to the data";
}

TEST_P(RtpsGuard, SequenceNumbersAndSetsAreChecked) {
  for (const std::int64_t number : {std::int64_t{0}, std::int64_t{-1}, std::int64_t{1} << 62U})
    EXPECT_EQ(flaw_of(packet().data(kReader, kWriter, 4, small_sample(), number)), "sequence_number");
  const auto heartbeat = [&](std::int64_t first, std::int64_t last) {
    return flaw_of(
        packet().submessage(0x07, 0, wire().id(kReader).id(kWriter).sequence(first).sequence(last).u32(1)));
  };
  EXPECT_EQ(heartbeat(5, 4), "none");
  EXPECT_EQ(heartbeat(5, 3), "sequence_number");
  EXPECT_EQ(heartbeat(0, 3), "sequence_number");
  const auto gap = [&](std::int64_t start, std::int64_t base, unsigned bits) {
    return flaw_of(packet().submessage(
        0x08, 0, wire().id(kReader).id(kWriter).sequence(start).sequence(base).u32(bits).fill(32)));
  };
  EXPECT_EQ(gap(1, 1000, 256), "none");
  EXPECT_EQ(gap(1, 1000, 257), "number_set");
  EXPECT_EQ(gap(5, 4, 0), "sequence_number");
  EXPECT_EQ(gap(1, std::int64_t{1} << 40U, 0), "sequence_number") << "Fast DDS would walk over all of them";
  EXPECT_EQ(
      flaw_of(packet().submessage(0x06, 0, wire().id(kReader).id(kWriter).sequence(3).u32(64).u32(1).u32(1))),
      "submessage")
      << "the count is missing";
}

TEST_P(RtpsGuard, FragmentsAreChecked) {
  const auto fragment = [&](std::uint32_t first, unsigned count, unsigned size, std::uint32_t sample_bytes,
                            std::size_t payload, std::uint32_t writer = kWriter) {
    return flaw_of(packet().submessage(0x16, 0,
                                       wire()
                                           .u16(0)
                                           .u16(28)
                                           .id(0)
                                           .id(writer)
                                           .sequence(1)
                                           .u32(first)
                                           .u16(count)
                                           .u16(size)
                                           .u32(sample_bytes)
                                           .fill(payload)));
  };
  EXPECT_EQ(fragment(1, 1, 1000, 2500, 1000), "none");
  EXPECT_EQ(fragment(3, 1, 1000, 2500, 500), "none");
  EXPECT_EQ(fragment(4, 1, 1000, 2500, 500), "fragment");
  EXPECT_EQ(fragment(3, 1, 1000, 2500, 400), "fragment") << "less than announced";
  EXPECT_EQ(fragment(1, 1, 0, 2500, 1000), "fragment");
  EXPECT_EQ(fragment(0, 1, 1000, 2500, 1000), "fragment");
  EXPECT_EQ(fragment(1, 0, 1000, 2500, 1000), "fragment");
  EXPECT_EQ(fragment(1, 1, 2, 4, 4), "fragment") << "no room for the list of those that are missing";
  EXPECT_EQ(fragment(1, 1, 1001, 1002, 1001), "fragment") << "nor in the last one";
  EXPECT_EQ(fragment(1, 3, 1000, 2500, 2500), "fragment") << "all of it";
  EXPECT_EQ(fragment(1, 2, 1000, 2500, 2000), "none");
  EXPECT_EQ(fragment(1, 1, 1000, 0xffffffff, 1000), "fragment") << "4 GB";
  EXPECT_EQ(fragment(1, 1, 1000, 2500, 1000, kSedpWriter), "fragmented_discovery");
}

TEST(RtpsGuardRequests, RequestsForSentFragmentsPass) {
  const auto request = [](std::int64_t number, std::uint32_t base, unsigned bits, std::uint64_t word) {
    return Packet()
        .submessage(0x12, 0,
                    Wire().id(kReader).id(kWriter).sequence(number).u32(base).u32(bits).u32(word).u32(1))
        .wire.bytes;
  };
  RtpsSessionState sent;
  EXPECT_EQ(flaw_of(request(5, 1, 1, 0x80000000), {}, &sent), "fragment_request");
  sent.note(
      Packet()
          .submessage(
              0x16, 0,
              Wire().u16(0).u16(28).id(0).id(kWriter).sequence(5).u32(1).u16(1).u16(1000).u32(2500).fill(
                  1000))
          .wire.bytes);
  EXPECT_EQ(sent.count(kWriter, 5), 3U);
  EXPECT_EQ(flaw_of(request(5, 1, 3, 0xe0000000), {}, &sent), "none");
  EXPECT_EQ(flaw_of(request(5, 1, 4, 0xf0000000), {}, &sent), "fragment_request") << "there is no fourth";
  EXPECT_EQ(flaw_of(request(5, 1, 4, 0xe0000000), {}, &sent), "none") << "and it is not asked for";
  EXPECT_EQ(flaw_of(request(6, 1, 1, 0x80000000), {}, &sent), "fragment_request");
  EXPECT_EQ(flaw_of(request(5, 0, 1, 0x80000000), {}, &sent), "number_set") << "they count from 1";
}

TEST(RtpsGuardSamples, WritersInUseAreNotForgotten) {
  struct Entry {
    std::uint64_t key = 0, value = 0;
  };
  LruTable<Entry, 1> entries;
  entries.insert(1).value = 10;
  for (std::uint64_t key = 2; key < 100; ++key) {
    entries.insert(key).value = key;
    ASSERT_NE(entries.find(1), nullptr) << key;
  }
  EXPECT_EQ(entries.find(1)->value, 10U);
  EXPECT_EQ(entries.find(2), nullptr);
  for (std::uint64_t key = 200; key < 204; ++key) entries.insert(key);
  EXPECT_EQ(entries.find(1), nullptr) << "four others in between";
}

TEST(RtpsGuardSamples, ASampleOfATopicWithoutKeysHasNoKey) {
  Wire with_key;
  with_key.parameter(0x70, Bytes(16, 9)).u16(1).u16(0).add(small_sample());
  Bytes cleaned = Packet().data(kReader, kWriter, 6, with_key.bytes).wire.bytes;
  EXPECT_EQ(to_string(clean_packet(cleaned, {}, nullptr, kNow_s).flaw), "none");
  Wire without;
  without.parameter(0, Bytes(16, 9)).u16(1).u16(0).add(small_sample());
  EXPECT_EQ(cleaned, Packet().data(kReader, kWriter, 6, without.bytes).wire.bytes);
  EXPECT_EQ(flaw_of(Packet().data(kReader, kWriter, 8, Bytes(16, 9))), "payload") << "a key alone";
  EXPECT_EQ(flaw_of(Packet().data(kReader, kWriter, 0, {})), "payload") << "nothing at all";
  EXPECT_EQ(flaw_of(Packet().data(kReader, 0x00000102, 8, Bytes(16, 9))), "none") << "of a topic with keys";
}

TEST(RtpsGuardSamples, SequenceNumbersOfAWriterDoNotLeap) {
  RtpsSessionState memory;
  const auto data = [&](std::int64_t number, std::uint32_t writer = kWriter) {
    return flaw_of(Packet().data(kReader, writer, 4, small_sample(), number).wire.bytes, {}, &memory);
  };
  const auto confirmed = [&](std::int64_t number, std::uint32_t writer) {
    EXPECT_EQ(data(number, writer), "sequence_number");
    EXPECT_EQ(data(number + 1, writer), "sequence_number");
    return data(number + 2, writer);
  };
  constexpr std::int64_t step = RtpsSessionState::kStep, first = RtpsSessionState::kLargestFirst;
  EXPECT_EQ(data(step), "none");
  EXPECT_EQ(data(2 * step), "none");
  EXPECT_EQ(data(3 * step + 1), "sequence_number");
  EXPECT_EQ(data(2 * step), "none") << "an old one again, which does not confirm the leap";
  EXPECT_EQ(confirmed(3 * step + 1, kWriter), "none") << "it wrote while its samples were not heard";
  EXPECT_EQ(data(3 * step + 4), "none");
  EXPECT_EQ(confirmed(4 * step + RtpsSessionState::kLongestLeap, kWriter), "sequence_number");
  EXPECT_EQ(confirmed(first - 10, kWriter + 0x100), "none") << "it has been writing for days";
  EXPECT_EQ(confirmed(first + 10, kWriter + 0x200), "sequence_number");
  const Wire leap = Wire().id(kReader).id(kWriter + 0x100).sequence(1LL << 40U).sequence(1LL << 40U).u32(1);
  EXPECT_EQ(flaw_of(Packet().submessage(0x07, 0, leap).wire.bytes, {}, &memory), "sequence_number");
}

/// Announcements of readers by participant `n`, inspected one after the other.
class RtpsGuardEndpoints : public testing::Test {
 protected:
  std::string announced(const std::string& topic, unsigned reliability, unsigned deadline_s,
                        std::uint32_t reader = kReader, std::uint8_t n = 7) {
    Wire list;
    list.u8(0).u8(3).fill(2).parameter(0x5a, guid(n, reader)).parameter(0x05, Wire().text(topic).bytes);
    list.parameter(0x1a, Wire().u8(reliability).fill(3).u32(0).u32(0).bytes);
    list.parameter(0x23, Wire().u32(deadline_s).u32(0).bytes);
    Bytes packet = Packet().data(0, 0x000004c2, 4, ended(list)).wire.bytes;
    const Bytes own = guid(n, reader);
    std::copy_n(own.begin(), 12, packet.begin() + 8);
    return flaw_of(packet, {}, &memory);
  }
  /// Readers 0 to `count` of a participant: how many are let through.
  std::uint32_t let_through(std::uint32_t count, std::uint8_t n) {
    std::uint32_t passed = 0;
    for (std::uint32_t i = 0; i < count; ++i)
      passed += announced("a", 1, 1, i << 8U | 4U, n) == "none" ? 1U : 0U;
    return passed;
  }
  static Bytes participant_of(std::uint8_t n) { return guid(n, 0x000001c1); }
  static inline std::uint32_t now_s = 0;
  RtpsSessionState memory{[] { return now_s; }};
};

TEST_F(RtpsGuardEndpoints, EndpointsKeepTheirType) {
  EXPECT_EQ(announced("a", 1, 1), "none");
  EXPECT_EQ(announced("a", 1, 2), "none") << "a deadline may change";
  EXPECT_EQ(announced("a", 2, 1), "changed");
  EXPECT_EQ(announced("b", 1, 1), "changed");

  EXPECT_EQ(announced("a", 1, 1, kReader + 0x100), "none");
  memory.forget(participant_of(8));
  EXPECT_EQ(announced("b", 1, 1), "changed") << "another participant has gone";
  memory.forget(guid(7, kReader));
  EXPECT_EQ(announced("b", 1, 1), "changed") << "it alone has gone, and may come again as it was";
  EXPECT_EQ(announced("a", 1, 1), "none");
  memory.forget(participant_of(7));
  EXPECT_EQ(announced("b", 1, 1), "none") << "its participant has gone, and its GUID came again";
  EXPECT_EQ(announced("a", 1, 1), "changed");
  EXPECT_EQ(announced("b", 1, 1, kReader + 0x100), "none");
}

TEST_F(RtpsGuardEndpoints, EndpointsAnnouncedDuringASilenceKeepTheirType) {
  now_s = 1;
  EXPECT_EQ(announced("a", 1, 1), "none");
  EXPECT_EQ(announced("a", 1, 1, kReader + 0x100), "none");
  now_s = 100;
  EXPECT_EQ(announced("a", 1, 1), "none");
  EXPECT_EQ(announced("b", 1, 1, kReader + 0x100), "changed") << "which is no announcement";
  memory.forget_silent(participant_of(7));
  EXPECT_EQ(announced("b", 1, 1), "changed");
  EXPECT_EQ(announced("b", 1, 1, kReader + 0x100), "none");
  now_s = 103;
  memory.forget_silent(participant_of(7));
  EXPECT_EQ(announced("b", 1, 1), "none");
}

TEST_F(RtpsGuardEndpoints, EndpointsAreKnownByTheirLastAnnouncement) {
  const auto twice = [&](unsigned first, unsigned second) {
    Wire list;
    list.u8(0).u8(3).fill(2).parameter(0x5a, guid(7, kReader)).parameter(0x05, Wire().text("a").bytes);
    for (const unsigned reliability : {first, second})
      list.parameter(0x1a, Wire().u8(reliability).fill(3).u32(0).u32(0).bytes);
    return flaw_of(Packet().data(0, 0x000004c2, 4, ended(list)).wire.bytes, {}, &memory);
  };
  EXPECT_EQ(twice(1, 2), "none");
  EXPECT_EQ(twice(2, 2), "none");
  EXPECT_EQ(twice(2, 1), "changed");
}

TEST_F(RtpsGuardEndpoints, EndpointsOfKnownParticipantsAreKept) {
  constexpr std::uint32_t many = 100'000;
  memory.know(participant_of(7));
  EXPECT_EQ(announced("a", 1, 1), "none");
  EXPECT_EQ(let_through(many, 8), many) << "DDS does not know them, nor listen to them";
  EXPECT_EQ(announced("b", 1, 1), "changed");

  memory.know(participant_of(9));
  const std::uint32_t room = let_through(many, 9);
  EXPECT_GT(room, 10'000U);
  EXPECT_LT(room, many);
  EXPECT_EQ(announced("b", 1, 1), "changed");
  memory.forget(participant_of(9));
  EXPECT_GT(let_through(many, 10), room);
  EXPECT_EQ(announced("b", 1, 1), "changed");
}

TEST_F(RtpsGuardEndpoints, EndpointsThatLeaveMakeRoomForOthers) {
  memory.know(participant_of(7));
  for (std::uint32_t i = 0; i < 100'000; ++i) {
    ASSERT_EQ(announced("a", 1, 1, i << 8U | 4U), "none") << i;
    memory.forget(guid(7, i << 8U | 4U));
  }
}

TEST(RtpsSubmessages, SubmessagesOfDiscoveryAreRecognised) {
  for (const bool big : {false, true}) {
    const auto speaks = [](const Packet& packet) { return speaks_of_discovery(packet.wire.bytes); };
    const auto data = [&](std::uint32_t reader, std::uint32_t writer) {
      return Packet(big).data(reader, writer, 4, small_sample());
    };
    EXPECT_FALSE(speaks(Packet(big)));
    EXPECT_FALSE(speaks(data(kReader, kWriter)));
    EXPECT_TRUE(speaks(data(0, kSpdpWriter)));
    EXPECT_TRUE(speaks(data(0, kSedpWriter)));
    EXPECT_TRUE(speaks(data(kReader, kWriter).data(0, kSedpWriter, 4, small_sample()))) << "the second one";
    for (const unsigned id : {0x07U, 0x08U}) {
      const auto about = [&](std::uint32_t writer) {
        return Packet(big).submessage(id, 0, Wire(big).id(0).id(writer).sequence(1).sequence(1).u32(1));
      };
      EXPECT_TRUE(speaks(about(kSedpWriter)));
      EXPECT_FALSE(speaks(about(kWriter)));
    }
    Bytes cut = data(0, kSedpWriter).wire.bytes;
    cut.resize(kRtpsHeaderBytes + kSubmessageHeadBytes + 8);
    EXPECT_FALSE(speaks_of_discovery(cut));
  }
}

TEST_P(RtpsGuard, DiscoveryParametersAreChecked) {
  const bool big = GetParam();
  EXPECT_EQ(participant_flaw(0x62, wire().text("x").bytes, big), "none");
  EXPECT_EQ(participant_flaw(0x62, wire().u32(4).fill(4, 'a').bytes, big), "text") << "not terminated";
  EXPECT_EQ(participant_flaw(0x62, wire().u32(400).fill(4).bytes, big), "text");
  EXPECT_EQ(participant_flaw(0x50, guid(8, 0x000001c1), big), "identity") << "of another participant";
  EXPECT_EQ(participant_flaw(0x50, guid(7, 0x00000102), big), "identity") << "not a participant";
  for (const unsigned id : {0x50U, 0x70U}) {
    EXPECT_EQ(participant_flaw(id, guid(7, 0x000001c1), big), "none");
    EXPECT_EQ(participant_flaw(id, guid(7, 0x010001c1), big), "identity") << "a second one of the prefix";
  }
  EXPECT_EQ(participant_flaw(0x02, wire().u32(0x7fffffff).u32(0xffffffff).bytes, big), "lease");
  EXPECT_EQ(participant_flaw(0x02, wire().u32(0).u32(0).bytes, big), "lease");
  EXPECT_EQ(participant_flaw(0x32, wire().u32(1).u32(70000).fill(16).bytes, big), "locator");
  for (const unsigned shared_memory : {16U, 19U}) {  // of Fast DDS 2, of 3
    EXPECT_EQ(participant_flaw(0x32, wire().u32(shared_memory).u32(7410).fill(16).bytes, big), "none");
    EXPECT_EQ(participant_flaw(0x32, wire().u32(shared_memory).u32(1).fill(16).bytes, big), "locator")
        << "would make a file";
  }
  EXPECT_EQ(participant_flaw(0x32, wire().u32(17).u32(7410).fill(16).bytes, big), "locator") << "nobody's";
  EXPECT_EQ(participant_flaw(0x59, wire().u32(1).text("name").text("value").bytes, big), "none");
  EXPECT_EQ(participant_flaw(0x59, wire().u32(2).text("name").text("value").bytes, big), "text");
  EXPECT_EQ(participant_flaw(0x1001, wire().text("DDS:Auth").u32(0).u32(0).bytes, big), "none");
  EXPECT_EQ(participant_flaw(0x1001, wire().text("DDS:Auth").u32(0x10000000).u32(0).bytes, big), "parameter");
  EXPECT_EQ(endpoint_flaw(0x1d, wire().u8(9).fill(3).bytes, big), "parameter");
  EXPECT_EQ(endpoint_flaw(0x23, wire().u32(0xffffffff).u32(0).bytes, big), "parameter") << "negative";
  EXPECT_EQ(endpoint_flaw(0x29, wire().u32(1).text("a").bytes, big), "none");
  EXPECT_EQ(endpoint_flaw(0x29, wire().u32(3).text("a").bytes, big), "text");
  EXPECT_EQ(endpoint_flaw(0x2c, wire().u32(4).fill(4).bytes, big), "none");
  EXPECT_EQ(endpoint_flaw(0x2c, wire().u32(5).fill(4).bytes, big), "parameter");
  EXPECT_EQ(endpoint_flaw(0x5a, guid(8, kWriter), big), "identity");
  EXPECT_EQ(flaw_of(packet().data(0, kSedpWriter, 4, endpoint(big).bytes)), "parameter_list") << "no end";
  Wire long_one = endpoint(big);
  long_one.u16(0x8123).u16(200).fill(8);
  EXPECT_EQ(flaw_of(packet().data(0, kSedpWriter, 4, long_one.bytes)), "parameter_list");
  EXPECT_EQ(flaw_of(packet().data(0, kSedpWriter, 4, {0, 1, 0, 0, 1, 0, 0, 0})), "payload")
      << "not a parameter list";
  EXPECT_EQ(flaw_of(packet().data(0, kSedpWriter, 4, {0, 3})), "payload");
  EXPECT_EQ(flaw_of(packet().data(0, 0x000200c2, 4,
                                  wire().u8(0).u8(big ? 0 : 1).fill(2).fill(16).u32(99).fill(4).bytes)),
            "payload");
  EXPECT_EQ(flaw_of(packet().data(0x000100c7, kWriter, 4, small_sample())), "identity")
      << "a user's writer to discovery";
  EXPECT_EQ(flaw_of(packet().data(kReader, kWriter, 4, {0, 99, 0, 0, 1, 2, 3, 4})), "payload")
      << "no such encoding";
  Wire bad_inline = wire();
  bad_inline.parameter(0x70, Bytes(8, 7)).u16(1).u16(0).add(small_sample());
  EXPECT_EQ(flaw_of(packet().data(kReader, kWriter, 6, bad_inline.bytes)), "inline_qos");
}

TEST_P(RtpsGuard, TypeObjectsBecomePadding) {
  const bool big = GetParam();
  for (const unsigned id : {0x35U, 0x69U, 0x72U, 0x75U, 0x8006U}) {
    const Packet with = packet().data(0, kSedpWriter, 4, ended(endpoint(big).parameter(id, Bytes(12, 0xee))));
    ASSERT_EQ(flaw_of(with), "none");
    EXPECT_TRUE(inspect_packet(with.wire.bytes, {}, nullptr).needs_cleaning);
    Bytes hidden = with.wire.bytes;
    clean_packet(hidden, {}, nullptr, kNow_s);
    EXPECT_EQ(
        hidden,
        packet().data(0, kSedpWriter, 4, ended(endpoint(big).parameter(0, Bytes(12, 0xee)))).wire.bytes);
    EXPECT_FALSE(inspect_packet(hidden, {}, nullptr).needs_cleaning);
  }
  EXPECT_FALSE(inspect_packet(packet().data(0, kSedpWriter, 4, ended(endpoint(big))).wire.bytes, {}, nullptr)
                   .needs_cleaning);
}

TEST_P(RtpsGuard, TimestampsFromTheFutureBecomeThePresent) {
  const auto with_time = [&](std::uint32_t seconds, std::uint32_t fraction) {
    return packet()
        .submessage(0x09, 0, wire().u32(seconds).u32(fraction))
        .data(kReader, kWriter, 4, small_sample())
        .wire.bytes;
  };
  const auto cleaned = [&](std::uint32_t seconds, std::uint32_t fraction) {
    Bytes bytes = with_time(seconds, fraction);
    EXPECT_EQ(to_string(clean_packet(bytes, {}, nullptr, kNow_s).flaw), "none");
    return bytes;
  };
  EXPECT_EQ(cleaned(0x7fffffff, 5), with_time(kNow_s, 0));
  EXPECT_EQ(cleaned(0xffffffff, 0xffffffff), with_time(kNow_s, 0));
  EXPECT_EQ(cleaned(kNow_s + 1, 0), with_time(kNow_s, 0));
  EXPECT_EQ(cleaned(kNow_s, 0x80000000), with_time(kNow_s, 0x80000000));
  EXPECT_EQ(cleaned(0, 7), with_time(0, 7));
}

TEST_P(RtpsGuard, EncryptedPacketsPassOnlyWithSecurity) {
  GuardLimits secured;
  secured.encrypted = true;
  const Wire body = Wire(true).u32(8).fill(8), tag = Wire(true).fill(16).u32(1).fill(20);
  const Packet good =
      packet().submessage(0x31, 0, wire().fill(20)).submessage(0x30, 0, body).submessage(0x32, 0, tag);
  EXPECT_EQ(flaw_of(good), "encrypted");
  EXPECT_EQ(flaw_of(good, secured), "none");
  EXPECT_EQ(flaw_of(packet().submessage(0x31, 0, wire().fill(20)).submessage(0x30, 0, body), secured),
            "submessage")
      << "begun and not ended";
  EXPECT_EQ(flaw_of(packet().submessage(0x32, 0, tag), secured), "submessage");
  EXPECT_EQ(flaw_of(packet()
                        .submessage(0x31, 0, wire().fill(20))
                        .submessage(0x30, 0, Wire(true).u32(9).fill(8))
                        .submessage(0x32, 0, tag),
                    secured),
            "submessage");
  EXPECT_EQ(
      flaw_of(
          packet().submessage(0x33, 0, wire().fill(20)).submessage(0x30, 0, body).submessage(0x34, 0, tag),
          secured),
      "none");
  EXPECT_EQ(flaw_of(packet().submessage(0x34, 0, Wire(true).fill(16).u32(0xffffffff)), secured),
            "submessage");
}

TEST_P(RtpsGuard, StatisticsOfFastDdsAreCutOff) {
  const Packet plain = packet().data(kReader, kWriter, 4, small_sample());
  Packet with = plain;
  with.submessage(0x80, 0, wire().fill(56));
  EXPECT_EQ(flaw_of(with), "none");
  EXPECT_EQ(inspect_packet(with.wire.bytes, {}, nullptr).size, plain.wire.bytes.size());
  EXPECT_EQ(inspect_packet(plain.wire.bytes, {}, nullptr).size, plain.wire.bytes.size());
  EXPECT_EQ(flaw_of(with.data(kReader, kWriter, 4, small_sample())), "submessage") << "not at the end";
}

TEST_P(RtpsGuard, BytesInPlaceOfStatisticsAreCutOffInSharedMemory) {
  const Packet plain = packet().data(kReader, kWriter, 4, small_sample());
  const std::size_t size = plain.wire.bytes.size();
  const Wire acknowledgement = wire().id(kReader).id(kWriter).sequence(3).u32(256).fill(32).u32(1);
  const auto with = [&](const Bytes& tail) {
    Bytes bytes = plain.wire.bytes;
    bytes.insert(bytes.end(), tail.begin(), tail.end());
    return bytes;
  };
  const Bytes genuine = Packet(plain).submessage(0x06, 2, acknowledgement).wire.bytes;
  const auto asked = [](const Bytes& bytes, RtpsSessionState* memory = nullptr,
                        TransportKind way = TransportKind::shared_memory) {
    const PacketReport report = inspect_packet(bytes, {}, memory, way);
    return report.flaw == RtpsError::none ? std::to_string(report.size) : std::string(to_string(report.flaw));
  };
  const std::string whole = std::to_string(size), longer = std::to_string(size + 60);
  const Bytes framing = wire().u8(0x55).u8(0).u16(0x7777).fill(56, 9).bytes;
  const Bytes content = wire().u8(0x07).u8(GetParam() ? 0 : 1).u16(56).fill(56, 0xee).bytes;
  const Bytes nothing = Wire().fill(60).bytes;
  for (const Bytes& stale : {framing, content, nothing}) EXPECT_EQ(asked(with(stale)), whole);
  EXPECT_EQ(asked(plain.wire.bytes), whole);
  EXPECT_EQ(asked(with(framing), nullptr, TransportKind::network), "submessage");
  EXPECT_EQ(asked(with(Bytes(framing.begin(), framing.end() - 4))), "submessage") << "of another length";
  Bytes of_others = with(framing);
  of_others[7] = 16;
  EXPECT_EQ(asked(of_others), "submessage") << "of another vendor";
  Bytes bad = with(framing);
  bad[size - 8] = 0xff;
  EXPECT_EQ(asked(bad), "payload") << "what stands before is looked at";
  // Old bytes may look like a submessage. They are cut off for a sender that has sent old bytes earlier.
  for (const Bytes& stale : {framing, nothing}) {
    RtpsSessionState memory;
    EXPECT_EQ(asked(genuine, &memory), longer);
    EXPECT_EQ(asked(with(stale), &memory), whole);
    EXPECT_EQ(asked(genuine, &memory), whole);
    EXPECT_EQ(asked(genuine, &memory, TransportKind::network), longer);
    Bytes another = genuine;
    another[8] = 99;
    EXPECT_EQ(asked(another, &memory), longer);
  }
}

TEST_P(RtpsGuard, SecuredSubmessagesAreNotCut) {
  GuardLimits secured;
  secured.encrypted = true;
  const Packet begun = packet().submessage(0x31, 0, wire().fill(20));
  Bytes bytes = Packet(begun).submessage(0x55, 0, wire().fill(56)).wire.bytes;
  EXPECT_EQ(to_string(inspect_packet(bytes, secured, nullptr, TransportKind::shared_memory).flaw),
            "submessage");
}

TEST(RtpsGuardRelays, ADiscoveryServerMayAnnounceOthers) {
  GuardLimits relayed;
  relayed.relayed_discovery = true;
  const Packet packet =
      Packet().data(0, kSpdpWriter, 4, ended(participant().parameter(0x50, guid(8, 0x000001c1))));
  EXPECT_EQ(flaw_of(packet), "identity");
  EXPECT_EQ(flaw_of(packet, relayed), "none");
}

TEST(RtpsGuardRandom, EveryRandomPacketHasAVerdict) {
  std::mt19937 random(20261121);
  const Bytes good = Packet()
                         .submessage(0x09, 0, Wire().u32(1).u32(2))
                         .data(0, kSpdpWriter, 4,
                               ended(participant().parameter(0x59, Wire().u32(1).text("n").text("v").bytes)))
                         .data(0, kSedpWriter, 4, ended(endpoint().parameter(0x72, Bytes(12, 1))))
                         .wire.bytes;
  std::array<std::size_t, kRtpsErrorCount> seen{};
  RtpsSessionState sent;
  const std::size_t effort = test::effort();
  for (std::size_t i = 0; i < 20'000 * effort; ++i) {
    Bytes packet = good;
    for (unsigned n = 1 + random() % 4; n > 0; --n)
      packet[random() % packet.size()] = static_cast<std::uint8_t>(random());
    if (random() % 4 == 0) packet.resize(random() % packet.size());
    packet.shrink_to_fit();  // so that a sanitizer sees the first byte beyond
    ++seen[static_cast<std::size_t>(inspect_packet(packet, {}, &sent).flaw)];
    sent.note(packet.size() < 20 ? std::span<const std::uint8_t>{} : packet);
    clean_packet(packet, {}, nullptr, kNow_s);
  }
  EXPECT_GT(seen[0], 100 * effort);
  EXPECT_GT(seen[static_cast<std::size_t>(RtpsError::parameter_list)], 100 * effort);
  EXPECT_GT(seen[static_cast<std::size_t>(RtpsError::identity)], 100 * effort);
}

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
    return Packet().data(kReader, kWriter, 4, small_sample(), number);
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

TEST_F(RtpsGuardSources, ThePartOfAPacketThatNamesAnotherSenderIsChecked) {
  prove(kOwn);
  Packet relayed;
  std::fill_n(relayed.wire.bytes.begin() + 8, 12, std::uint8_t{9});
  relayed.submessage(0x0c, 0, Wire().u32(0).u8(2).u8(2).u16(0).fill(12, 7))
      .data(kReader, kWriter, 4, small_sample());
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
    const std::string found = flaw(packet.data(0, kSpdpWriter, 4, ended(list)), kForeign + i);
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

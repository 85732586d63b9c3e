#include "idl/transport/rtps_guard/rtps_fragments.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>

#include "idl/transport/rtps_guard/rtps_guard.h"
#include "tests/support/rtps_packets.h"

namespace takt {
namespace {

using test::kReader;
using test::kWriter;
using test::Packet;
using test::Wire;
using Bytes = std::vector<std::uint8_t>;

constexpr std::uint16_t kFragment = 1000;

Bytes sample(std::size_t size, std::uint8_t first) {
  Bytes bytes(size);
  std::iota(bytes.begin(), bytes.end(), first);
  bytes[0] = bytes[2] = bytes[3] = 0;
  bytes[1] = 1;  // CDR, little endian
  return bytes;
}

struct Fragments {
  bool big = false;
  Bytes qos;  ///< with its end

  void add(Packet& packet, const Bytes& whole, std::int64_t number, std::uint32_t first,
           unsigned count = 1) const {
    const std::size_t begin = std::size_t{first - 1} * kFragment;
    const std::size_t end = std::min(whole.size(), begin + std::size_t{count} * kFragment);
    Wire body(big);
    body.u16(0).u16(28).id(kReader).id(kWriter).sequence(number).u32(first).u16(count).u16(kFragment);
    body.u32(static_cast<std::uint32_t>(whole.size())).add(qos);
    body.add(Bytes(whole.begin() + static_cast<std::ptrdiff_t>(begin),
                   whole.begin() + static_cast<std::ptrdiff_t>(end)));
    packet.submessage(0x16, qos.empty() ? 0 : 2, body);
  }
};

/// The packets that Fast DDS gets for a packet.
std::vector<Bytes> passed(FragmentAssembly& assembly, Bytes packet) {
  EXPECT_EQ(to_string(inspect_packet(packet, {}, nullptr).flaw), "none");
  std::vector<Bytes> seen;
  const std::size_t left = assembly.take(
      packet, [&](std::span<std::uint8_t> whole) { seen.emplace_back(whole.begin(), whole.end()); });
  seen.emplace_back(packet.begin(), packet.begin() + static_cast<std::ptrdiff_t>(left));
  return seen;
}
std::vector<Bytes> one(FragmentAssembly& assembly, const Fragments& fragments, const Bytes& whole,
                       std::int64_t number, std::uint32_t first, unsigned count = 1) {
  Packet packet(fragments.big);
  fragments.add(packet, whole, number, first, count);
  return passed(assembly, packet.wire.bytes);
}
/// The same sample in one piece, its length left open.
Bytes in_one_piece(const Fragments& fragments, const Bytes& whole, std::int64_t number) {
  Bytes content = fragments.qos;
  content.insert(content.end(), whole.begin(), whole.end());
  Bytes bytes =
      Packet(fragments.big).data(kReader, kWriter, fragments.qos.empty() ? 4 : 6, content, number).wire.bytes;
  bytes[22] = bytes[23] = 0;
  return bytes;
}
bool has_fragment(const Bytes& packet) {
  for (std::size_t at = 20; at + 4 <= packet.size();) {
    if (packet[at] == 0x16) return true;
    const std::size_t length = (packet[at + 1] & 1U) != 0 ? packet[at + 2] + 256U * packet[at + 3]
                                                          : 256U * packet[at + 2] + packet[at + 3];
    if (length == 0) break;
    at += 4 + length;
  }
  return false;
}

class RtpsFragments : public testing::TestWithParam<bool> {};
INSTANTIATE_TEST_SUITE_P(ByteOrders, RtpsFragments, testing::Bool());

TEST_P(RtpsFragments, FragmentsInAnyOrderMakeTheSample) {
  Wire qos(GetParam());
  qos.parameter(0x8000, Bytes(4, 7)).u16(1).u16(0);
  for (const Bytes& list : {Bytes{}, qos.bytes}) {
    FragmentAssembly assembly(1U << 20U);
    const Fragments fragments{GetParam(), list};
    const Bytes whole = sample(3500, 3);
    for (const std::uint32_t first : {4U, 1U, 4U}) {
      const auto seen = one(assembly, fragments, whole, 9, first);
      ASSERT_EQ(seen.size(), 1U);
      EXPECT_FALSE(has_fragment(seen[0])) << "Fast DDS sees no half sample";
    }
    EXPECT_EQ(assembly.samples(), 1U);
    const auto seen = one(assembly, fragments, whole, 9, 2, 2);
    ASSERT_EQ(seen.size(), 2U);
    EXPECT_EQ(seen[0], in_one_piece(fragments, whole, 9));
    EXPECT_EQ(to_string(inspect_packet(seen[0], {}, nullptr).flaw), "none");
    EXPECT_EQ(assembly.samples(), 0U);
    EXPECT_EQ(assembly.held_bytes(), 0U);
  }
}

TEST(RtpsFragmentsOfSome, SubmessagesBesideFragmentsAreKept) {
  FragmentAssembly assembly(1U << 20U);
  const Bytes whole = sample(1500, 1);
  const Fragments fragments;
  Packet packet;
  packet.submessage(0x09, 0, Wire().u32(11).u32(12));
  fragments.add(packet, whole, 5, 1);
  packet.submessage(0x07, 2, Wire().id(kReader).id(kWriter).sequence(1).sequence(5).u32(1));
  const Bytes before = packet.wire.bytes;
  auto seen = passed(assembly, before);
  ASSERT_EQ(seen.size(), 1U);
  EXPECT_EQ(seen[0].size(), before.size());
  EXPECT_TRUE(std::equal(seen[0].end() - 32, seen[0].end(), before.end() - 32)) << "the heartbeat";
  Packet second;
  second.submessage(0x09, 0, Wire().u32(21).u32(22));
  fragments.add(second, whole, 5, 2);
  seen = passed(assembly, second.wire.bytes);
  ASSERT_EQ(seen.size(), 2U);
  EXPECT_TRUE(std::equal(seen[0].begin() + 20, seen[0].begin() + 32, second.wire.bytes.begin() + 20))
      << "the time of its packet";
}

TEST(RtpsFragmentsOfSome, AForgedFragmentDoesNotSpoilTheOthers) {
  FragmentAssembly assembly(1U << 20U);
  const Fragments fragments;
  const Bytes whole = sample(2500, 1), other = sample(4500, 9);
  one(assembly, fragments, whole, 5, 1);
  one(assembly, fragments, other, 5, 2);  // another size: starts again
  one(assembly, fragments, whole, 5, 2);
  one(assembly, fragments, whole, 5, 3);
  const auto seen = one(assembly, fragments, whole, 5, 1);
  ASSERT_EQ(seen.size(), 2U);
  EXPECT_EQ(seen[0], in_one_piece(fragments, whole, 5));
}

TEST(RtpsFragmentsOfSome, SamplesOfVeryManyFragmentsAreLeftToTheReader) {
  constexpr std::uint32_t most = 4;
  FragmentAssembly assembly(1U << 20U, most);
  const Fragments fragments;
  const Bytes few = sample(most * kFragment, 1), many = sample(most * kFragment + 1, 1);
  EXPECT_FALSE(has_fragment(one(assembly, fragments, few, 1, 1).back()));
  EXPECT_TRUE(has_fragment(one(assembly, fragments, many, 2, 1).back()));
  EXPECT_EQ(assembly.samples(), 1U);
}

TEST(RtpsFragmentsOfSome, MemoryOfFragmentsIsBounded) {
  FragmentAssembly assembly(1U << 20U);
  const Fragments fragments;
  const Bytes whole = sample(1U << 20U, 1);
  for (std::int64_t number = 1; number < 200; ++number) {
    one(assembly, fragments, whole, number, 1);
    ASSERT_LE(assembly.samples(), FragmentAssembly::kMaxOfOneSender);
  }
  Packet others;
  fragments.add(others, whole, 1, 1);
  for (std::uint8_t sender = 1; sender < 200; ++sender) {
    others.wire.bytes[8] = sender;
    passed(assembly, others.wire.bytes);
    ASSERT_LE(assembly.samples(), FragmentAssembly::kMaxSamples);
    ASSERT_LE(assembly.held_bytes(), std::size_t{64} << 20U);
  }
}

TEST(RtpsFragmentsOfSome, FragmentsForOthersAreNotKept) {
  FragmentAssembly assembly(1U << 20U);
  const Bytes whole = sample(2500, 1);
  const auto to = [&](std::uint8_t last) {
    Packet packet;
    Bytes destination(12, 9);
    destination.back() = last;
    Fragments().add(packet.submessage(0x0e, 0, Wire().add(destination)), whole, 5, 1);
    passed(assembly, packet.wire.bytes);
    return assembly.samples();
  };
  Packet own;
  std::fill(own.wire.bytes.begin() + 8, own.wire.bytes.begin() + 20, std::uint8_t{9});
  assembly.sending(own.wire.bytes);
  EXPECT_EQ(to(8), 0U);
  EXPECT_EQ(to(9), 1U);
}

}  // namespace
}  // namespace takt

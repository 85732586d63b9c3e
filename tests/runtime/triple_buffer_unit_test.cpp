#include "idl/common/triple_buffer.h"

#include <gtest/gtest.h>

#include <array>
#include <atomic>
#include <thread>

#include "idl/common/spsc_ring.h"

namespace takt {
namespace {

TEST(TripleBuffer, EachValueIsReadOnceAndOnlyTheNewest) {
  TripleBuffer<int> slot;
  EXPECT_EQ(slot.take(), nullptr);
  for (const int value : {1, 2, 3}) {
    slot.write_buffer() = value;
    slot.publish();
  }
  const int* taken = slot.take();
  ASSERT_NE(taken, nullptr);
  EXPECT_EQ(*taken, 3);
  EXPECT_EQ(slot.take(), nullptr);
}

TEST(TripleBuffer, ATakenValueIsNotTouchedByTheWriter) {
  TripleBuffer<int> slot;
  slot.write_buffer() = 1;
  slot.publish();
  const int* taken = slot.take();
  for (int value = 2; value < 10; ++value) {
    slot.write_buffer() = value;
    slot.publish();
    EXPECT_EQ(*taken, 1);
  }
}

TEST(TripleBuffer, TheReaderGetsWholeValuesInOrderAndTheLastOne) {
  using Block = std::array<std::uint64_t, 64>;
  TripleBuffer<Block> slot;
  constexpr std::uint64_t kLast = 200'000;
  std::thread writer([&] {
    for (std::uint64_t value = 1; value <= kLast; ++value) {
      slot.write_buffer().fill(value);
      slot.publish();
    }
  });
  std::uint64_t newest = 0;
  while (newest < kLast) {
    const Block* block = slot.take();
    if (block == nullptr) {
      std::this_thread::yield();
      continue;
    }
    ASSERT_GT(block->front(), newest);
    for (const std::uint64_t word : *block) ASSERT_EQ(word, block->front());
    newest = block->front();
  }
  writer.join();
}

TEST(SpscRing, TheOrderIsKeptAndRejectedEntriesAreCounted) {
  SpscRing<int> ring(3);
  for (int i = 0; i < 5; ++i) EXPECT_EQ(ring.push(i), i < 3);
  EXPECT_EQ(ring.lost(), 2U);
  int value = -1;
  for (int i = 0; i < 3; ++i) {
    ASSERT_TRUE(ring.pop(value));
    EXPECT_EQ(value, i);
  }
  EXPECT_FALSE(ring.pop(value));
}

TEST(SpscRing, NoEntryIsLostBetweenThreads) {
  SpscRing<int> ring(16);
  constexpr int kCount = 100'000;
  std::thread writer([&] {
    for (int i = 0; i < kCount;) {
      if (ring.push(i)) {
        ++i;
      } else {
        std::this_thread::yield();
      }
    }
  });
  for (int expected = 0; expected < kCount;) {
    int value = -1;
    if (!ring.pop(value)) {
      std::this_thread::yield();
      continue;
    }
    ASSERT_EQ(value, expected);
    ++expected;
  }
  writer.join();
}

}  // namespace
}  // namespace takt

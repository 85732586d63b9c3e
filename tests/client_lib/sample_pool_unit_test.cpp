// Samples whose memory is used again.
#include "client_lib/sample_pool.h"

#include <gtest/gtest.h>

#include "ros2_msgs.h"
#include "takt_msgs.h"
#include "tests/support/random_message.h"

namespace takt::client {
namespace {

using takt_msgs::msg::CellState;
struct Noted : CellState {
  int note = 0;
};
using Pool = SamplePool<CellState, Noted>;

std::string state_of_bytes(std::size_t components) {
  CellState state;
  state.components.resize(components);
  std::string bytes;
  EXPECT_TRUE(cdr::write(state, bytes));
  return bytes;
}
void read_into(const std::string& bytes, CellState& state) {
  ASSERT_TRUE(cdr::read(std::span(reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()), state));
}

TEST(SamplePool, GivesTheMemoryOfASampleThatIsNotInUse) {
  Pool pool(2);
  auto first = pool.take();
  read_into(state_of_bytes(100), *first);
  const void* const memory = first->components.data();
  first = nullptr;
  const auto again = pool.take();
  read_into(state_of_bytes(90), *again);
  EXPECT_EQ(again->components.size(), 90U);
  EXPECT_EQ(again->components.data(), memory);
}

TEST(SamplePool, ASampleInUseIsNotGivenAgain) {
  Pool pool(2);
  for (int i = 0; i < 3; ++i) pool.take()->note = i;
  const auto one = pool.take(), other = pool.take();
  EXPECT_NE(one, other);
  const std::shared_ptr<const void> held = one;  // as a client hands it out
  EXPECT_NE(pool.take().get(), held.get());
}

TEST(SamplePool, ASampleComesBackClean) {
  Pool pool(1, [](Noted& sample) { sample.note = 0; });
  auto sample = pool.take();
  Noted* const memory = sample.get();
  sample->note = 7;
  sample = nullptr;
  sample = pool.take();
  EXPECT_EQ(sample.get(), memory);
  EXPECT_EQ(sample->note, 0);
}

TEST(SamplePool, ALargeSampleIsNotKept) {
  SamplePool<std_msgs::msg::String> pool(1);
  for (const std::size_t bytes : {std::size_t{1000}, pool.kLargest_bytes}) {
    auto sample = pool.take();
    sample->data.assign(bytes, 'a');
    sample = nullptr;
    EXPECT_EQ(pool.take()->data.capacity() >= 1000, bytes == 1000);
  }
}

TEST(SamplePool, KeepsNoMoreThanItsNumber) {
  Pool pool(1, [](Noted& sample) { sample.note = -1; });
  auto one = pool.take(), other = pool.take();
  one = nullptr;
  other = nullptr;  // no place
  one = pool.take();
  other = pool.take();
  EXPECT_EQ(one->note, -1);
  EXPECT_EQ(other->note, 0);
}

TEST(SamplePool, ASampleMayOutliveIt) {
  std::shared_ptr<Noted> sample;
  {
    Pool pool(1);
    sample = pool.take();
  }
  sample->components.resize(10);
  sample = nullptr;  // the sanitizers see what is left
}

TEST(SamplePool, AReadSampleEqualsAFreshOne) {
  Pool pool(1);
  for (unsigned seed = 0; seed < 200; ++seed) {
    const auto sent = test::RandomMessage(seed).make<CellState>();
    std::string bytes;
    ASSERT_TRUE(cdr::write(sent, bytes));
    const auto sample = pool.take();
    read_into(bytes, *sample);
    EXPECT_TRUE(static_cast<const CellState&>(*sample) == sent) << seed;
  }
}

}  // namespace
}  // namespace takt::client

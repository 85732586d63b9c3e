// When samples in the past show that the newest one was forged.
#include "client_lib/outvoting.h"

#include <gtest/gtest.h>

#include <limits>

namespace takt::client {
namespace {

using std::chrono::milliseconds;
const Outvoting::Clock::time_point kBegin{std::chrono::hours{1}};

TEST(Outvoting, SamplesUnderWayDoNotOutvote) {
  Outvoting votes;
  for (std::uint64_t step = 0; step < 400; ++step)
    EXPECT_FALSE(votes.older({0, step}, kBegin + milliseconds{step}));
}

TEST(Outvoting, ASenderThatGoesOnInThePastDoes) {
  Outvoting votes;
  EXPECT_FALSE(votes.older({0, 10}, kBegin));
  EXPECT_FALSE(votes.older({0, 11}, kBegin + milliseconds{600})) << "two may be late";
  EXPECT_TRUE(votes.older({0, 11}, kBegin + milliseconds{700})) << "repeated, as of a paused simulation";
}

TEST(Outvoting, ASampleInOrderClearsTheVotes) {
  Outvoting votes;
  for (int i = 0; i < 20; ++i) {
    EXPECT_FALSE(votes.older({0, 10}, kBegin + milliseconds{1000 * i}));
    EXPECT_FALSE(votes.older({0, 10}, kBegin + milliseconds{1000 * i + 600}));
    votes.in_order();
  }
}

TEST(Outvoting, SamplesOutOfOrderDoNotOutvote) {
  Outvoting votes;
  for (std::uint64_t i = 0; i < 20; ++i)
    EXPECT_FALSE(votes.older({0, 100 - i}, kBegin + milliseconds{1000 * i}));
}

struct Sample {
  std::uint32_t epoch;
  double time;
};

TEST(Outvoting, NoSimulationLeapsFarAhead) {
  using Wall = std::chrono::duration<double>;
  EXPECT_FALSE(leaps(Sample{1, 5.0}, Sample{1, 5.008}, Wall{0.001}));
  EXPECT_FALSE(leaps(Sample{1, 5.0}, Sample{1, 900.0}, Wall{1.0})) << "a free run";
  EXPECT_FALSE(leaps(Sample{1, 5.0}, Sample{2, 0.0}, Wall{0.001})) << "a reset";
  EXPECT_FALSE(leaps(Sample{1, 5.0}, Sample{2, 1000.0}, Wall{0.001})) << "a snapshot";
  EXPECT_TRUE(leaps(Sample{1, 5.0}, Sample{1, 1e9}, Wall{0.1}));
  EXPECT_TRUE(leaps(Sample{1, 5.0}, Sample{1, std::numeric_limits<double>::quiet_NaN()}, Wall{0.1}));
  EXPECT_TRUE(leaps(Sample{1, 5.0}, Sample{4'000'000'000, 5.0}, Wall{0.1}));
}

}  // namespace
}  // namespace takt::client

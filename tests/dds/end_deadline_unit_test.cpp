// A process that does not end by itself.
#include "server/dds/end_deadline.h"

#include <gtest/gtest.h>

#include <future>

namespace takt {
namespace {

TEST(EndDeadlineDeathTest, AProcessThatWaitsForEverEndsWithTheSentence) {
  testing::FLAGS_gtest_death_test_style = "threadsafe";
  EXPECT_EXIT(
      {
        const EndDeadline deadline(std::chrono::milliseconds(20), "the library does not end", 3);
        std::promise<void> never;
        never.get_future().wait();
      },
      testing::ExitedWithCode(3), "the library does not end");
}

TEST(EndDeadline, OneThatEndsInTimeGoesOn) {
  { const EndDeadline deadline(std::chrono::hours(1), "never", 3); }
  SUCCEED();
}

}  // namespace
}  // namespace takt

// The progress line of a run.
#include <gtest/gtest.h>

#include "server/headless/progress.h"

namespace {

using takt::progress_line;

TEST(ProgressLine, TheLineHasProgressAndRemainingTime) {
  EXPECT_EQ(progress_line(10.5, 42.0, 3.0),
            "[=======>                      ]  25 %  10.5 of 42.0 s, 9 s left");
  EXPECT_EQ(progress_line(21.0, 42.0, 600.0),
            "[===============>              ]  50 %  21.0 of 42.0 s, 10 min left");
}

TEST(ProgressLine, TheLineIsEmptyAtTheStartAndFullAtTheEnd) {
  EXPECT_EQ(progress_line(0.0, 42.0, 1.0), "[>                             ]   0 %  0.0 of 42.0 s");
  EXPECT_EQ(progress_line(42.0, 42.0, 1.0),
            "[==============================] 100 %  42.0 of 42.0 s, 0 s left");
}

TEST(ProgressLine, TheLineOfAStudyCountsTheTimeOfItsOwnRuns) {
  EXPECT_EQ(progress_line(12, 42, 2, "runs", 30.0),
            "[========>                     ]  28 %  12 of 42 runs, 90 s left");
  EXPECT_EQ(progress_line(2, 42, 2, "runs", 0.0), "[=>                            ]   4 %  2 of 42 runs");
  EXPECT_EQ(progress_line(42, 42, 42, "runs", 1.0),
            "[==============================] 100 %  42 of 42 runs, 0 s left");
}

TEST(ImportLine, TheLineHasTheMeshAndItsProgress) {
  EXPECT_EQ(takt::import_line("Housing", 0.25, 4.0),
            "Convex parts of Housing [=======>                      ]  25 %, 12 s left");
  EXPECT_EQ(takt::import_line("Box", 1.0, 3.0),
            "Convex parts of Box [==============================] 100 %, 0 s left");
}

}  // namespace

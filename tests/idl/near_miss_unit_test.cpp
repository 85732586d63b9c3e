// Suggestions for mistyped names.
#include "idl/common/near_miss.h"

#include <gtest/gtest.h>

#include <array>

namespace takt {
namespace {

TEST(NearMiss, CountsEditsAndSwapsOfNeighbours) {
  EXPECT_EQ(edit_distance("", "abc"), 3U);
  EXPECT_EQ(edit_distance("kitten", "sitting"), 3U);  // Levenshtein's example
  EXPECT_EQ(edit_distance("Tabel", "Table"), 1U);
  EXPECT_EQ(edit_distance("ca", "abc"), 3U);  // no letter is edited twice: 2 without that restriction
  EXPECT_EQ(edit_distance("abc", "abc"), 0U);
}

TEST(NearMiss, SuggestsTheNearestName) {
  const std::array<std::string_view, 3> names{"pace", "factor", "face"};
  EXPECT_EQ(did_you_mean("faktor", names), " Did you mean 'factor'?");
  EXPECT_EQ(did_you_mean("pcae", names), " Did you mean 'pace'?");
  EXPECT_EQ(did_you_mean("speed", names), "");
  EXPECT_EQ(did_you_mean("pace", names), " Did you mean 'face'?") << "the name itself is not a suggestion";
}

}  // namespace
}  // namespace takt

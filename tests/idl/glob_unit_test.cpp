// Matching of names with patterns: only * is special.
#include "idl/common/glob.h"

#include <gtest/gtest.h>

#include <functional>
#include <string_view>

namespace takt {
namespace {

TEST(Glob, StarStandsForAnyCharacters) {
  EXPECT_TRUE(glob_match("Robot1/forearm_link", "Robot1/forearm_link"));
  EXPECT_FALSE(glob_match("Robot1/forearm", "Robot1/forearm_link"));
  EXPECT_FALSE(glob_match("Robot1/forearm_link", "Robot1"));
  EXPECT_TRUE(glob_match("*", "Robot1/forearm_link"));
  EXPECT_TRUE(glob_match("Robot*/*_link", "Robot1/forearm_link"));
  EXPECT_TRUE(glob_match("*arm*", "Robot1/forearm_link"));
  EXPECT_TRUE(glob_match("*ab", "aab"));
  EXPECT_FALSE(glob_match("*ba", "aab"));
  EXPECT_TRUE(glob_match("Table1*", "Table1"));
  EXPECT_FALSE(glob_match("", "Table1"));
  EXPECT_TRUE(glob_match("state.*.x", "state.components.P.x"));
  EXPECT_TRUE(glob_match("*", "state.x"));
  EXPECT_TRUE(glob_match("state.x", "state.x"));
  EXPECT_FALSE(glob_match("state.*.x", "state.x"));
  EXPECT_FALSE(glob_match("state.x", "state.xy"));
  EXPECT_TRUE(glob_match("state.x**", "state.x"));
  EXPECT_FALSE(glob_match("state.x*y", "state.x"));
  EXPECT_TRUE(glob_match("*", "."));
  EXPECT_TRUE(glob_match("*", ""));
}

TEST(Glob, OtherCharactersStandForThemselves) {
  for (const char* text : {"a?", "[a]", "a[", "a]b", "\\*", "\\", "[!a]?", "a-z", "{a,b}", "~"}) {
    EXPECT_TRUE(glob_match(text, text)) << text;
    EXPECT_FALSE(glob_match(text, "a")) << text;
    EXPECT_FALSE(glob_match(text, "ab")) << text;
  }
  EXPECT_TRUE(glob_match("*[1]", "axis[1]"));
  EXPECT_TRUE(glob_match("\\*", "\\a"));
  EXPECT_FALSE(glob_match("\\*", "*"));
}

TEST(Glob, PairsFitInEitherOrder) {
  const std::array<std::string, 2> pair{"Part*", "Table"};
  EXPECT_TRUE(glob_match(pair, "Part1", "Table"));
  EXPECT_TRUE(glob_match(pair, "Table", "Part1"));
  EXPECT_FALSE(glob_match(pair, "Table", "Table"));
  EXPECT_FALSE(glob_match(pair, "Part1", "Part2"));
}

TEST(Glob, IsAsItIsDefined) {
  // The definition, by trying every split.
  const std::function<bool(std::string_view, std::string_view)> defined = [&](std::string_view pattern,
                                                                              std::string_view name) {
    if (pattern.empty()) return name.empty();
    if (pattern.front() == '*') {
      for (std::size_t taken = 0; taken <= name.size(); ++taken)
        if (defined(pattern.substr(1), name.substr(taken))) return true;
      return false;
    }
    return !name.empty() && name.front() == pattern.front() && defined(pattern.substr(1), name.substr(1));
  };
  const auto word = [](std::size_t number, std::string_view letters, std::size_t length) {
    std::string text;
    for (std::size_t i = 0; i < length; ++i, number /= letters.size())
      text += letters[number % letters.size()];
    return text;
  };
  int matched = 0;
  for (std::size_t length = 0, patterns = 1; length <= 4; ++length, patterns *= 3) {
    for (std::size_t p = 0; p < patterns; ++p) {
      const std::string pattern = word(p, "ab*", length);
      for (std::size_t name_length = 0; name_length <= 5; ++name_length) {
        for (std::size_t n = 0; n < (1U << name_length); ++n) {
          const std::string name = word(n, "ab", name_length);
          EXPECT_EQ(glob_match(pattern, name), defined(pattern, name)) << pattern << " on " << name;
          matched += glob_match(pattern, name) ? 1 : 0;
        }
      }
    }
  }
  EXPECT_GT(matched, 100);
  // Many stars cost no more than their product with the name.
  EXPECT_FALSE(glob_match("*a*a*a*a*a*a*a*a*a*a*a*a*a*a*b", std::string(10000, 'a')));
}

}  // namespace
}  // namespace takt

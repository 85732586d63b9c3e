// Numbers accepted on the command lines of all programs, and the errors for others.
#include <gtest/gtest.h>

#include "idl/command_line/numbers.h"

namespace takt {
namespace {

void expect_number_check(const command_line::NumberCheck& check, const std::vector<std::string>& good,
                         const std::vector<std::string>& bad, const std::string& allowed) {
  for (const std::string& text : good) EXPECT_EQ(check(text), "") << text;
  for (const std::string& text : bad) EXPECT_EQ(check(text), "found '" + text + "'; allowed: " + allowed);
}

TEST(CommandLineNumbers, NumbersAreFiniteAndInTheirRange) {
  const std::vector<std::string> no_numbers{"", " ", "x", "1x", "1,5", "nan", "-nan", "inf", "-inf", "1e999"};
  const auto with = [&](std::vector<std::string> more) {
    more.insert(more.end(), no_numbers.begin(), no_numbers.end());
    return more;
  };
  expect_number_check(command_line::finite(), {"0", "-1.5", "1e-3", "+2"}, no_numbers, "a finite number");
  expect_number_check(command_line::positive(), {"1", "1e-300", "1e300"}, with({"0", "-0", "-1", "1e-999"}),
                      "a finite number > 0");
  expect_number_check(command_line::not_negative(), {"0", "-0", "1e-3"}, with({"-1", "-1e-300"}),
                      "a finite number >= 0");
  expect_number_check(command_line::number_from(0.05, 86400.0), {"0.05", "1", "86400"},
                      with({"0.049", "86400.1", "-1"}), "a number from 0.05 to 86400");
}

TEST(CommandLineNumbers, CountsAreWholeNumbers) {
  const std::vector<std::string> no_whole{"", " ", "x", "1x", "1.5", "1e3", "nan", "99999999999999999999"};
  const auto with = [&](std::vector<std::string> more) {
    more.insert(more.end(), no_whole.begin(), no_whole.end());
    return more;
  };
  expect_number_check(command_line::whole_number_from(1), {"1", "9223372036854775807"}, with({"0", "-1"}),
                      "a whole number >= 1");
  expect_number_check(command_line::whole_number_from(0, 232), {"0", "7", "232"}, with({"-1", "233"}),
                      "a whole number from 0 to 232");
}

}  // namespace
}  // namespace takt

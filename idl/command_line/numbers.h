#pragma once
// Numbers on the command lines of all programs: checks for CLI::Option::check(). Each takes the given text
// and returns an error with the value found and the values allowed; empty for a valid number.
#include <cstdint>
#include <functional>
#include <limits>
#include <string>

namespace takt::command_line {

using NumberCheck = std::function<std::string(const std::string& text)>;

/// Any number but inf and nan.
NumberCheck finite();
/// A finite number > 0.
NumberCheck positive();
/// A finite number >= 0.
NumberCheck not_negative();
/// A number from `least` to `most`.
NumberCheck number_from(double least, double most);
/// A whole number from `least` to `most`.
NumberCheck whole_number_from(std::int64_t least,
                              std::int64_t most = std::numeric_limits<std::int64_t>::max());

}  // namespace takt::command_line

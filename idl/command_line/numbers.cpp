#include "idl/command_line/numbers.h"

#include <charconv>
#include <optional>

#include "idl/common/parse.h"
#include "idl/common/text.h"

namespace takt::command_line {
namespace {

std::optional<std::int64_t> whole_number(const std::string& text) {
  std::int64_t value = 0;
  const char* const end = text.c_str() + text.size();
  const auto [rest, error] = std::from_chars(text.c_str(), end, value);
  if (error != std::errc() || rest != end) return std::nullopt;
  return value;
}

std::string complaint(const std::string& text, const std::string& allowed) {
  return "found '" + text + "'; allowed: " + allowed;
}

/// `accepts`: of a finite number.
template <typename Accepts>
NumberCheck number_that(Accepts accepts, const std::string& allowed) {
  return [accepts, allowed](const std::string& text) {
    const auto value = finite_number(text);
    return value && accepts(*value) ? std::string() : complaint(text, allowed);
  };
}

}  // namespace

NumberCheck finite() {
  return number_that([](double) { return true; }, "a finite number");
}

NumberCheck positive() {
  return number_that([](double value) { return value > 0.0; }, "a finite number > 0");
}

NumberCheck not_negative() {
  return number_that([](double value) { return value >= 0.0; }, "a finite number >= 0");
}

NumberCheck number_from(double least, double most) {
  return number_that([least, most](double value) { return value >= least && value <= most; },
                     "a number from " + number_text(least, 6) + " to " + number_text(most, 6));
}

NumberCheck whole_number_from(std::int64_t least, std::int64_t most) {
  const std::string allowed =
      most == std::numeric_limits<std::int64_t>::max()
          ? "a whole number >= " + std::to_string(least)
          : "a whole number from " + std::to_string(least) + " to " + std::to_string(most);
  return [least, most, allowed](const std::string& text) {
    const auto value = whole_number(text);
    return value && *value >= least && *value <= most ? std::string() : complaint(text, allowed);
  };
}

}  // namespace takt::command_line

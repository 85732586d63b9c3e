#include "idl/common/parse.h"

#include <algorithm>
#include <charconv>
#include <cmath>

namespace takt {

std::optional<double> finite_number(std::string_view text) {
  if (text.starts_with('+') && !text.starts_with("+-")) text.remove_prefix(1);
  double value = 0.0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || !std::isfinite(value)) return std::nullopt;
  return value;
}

std::optional<std::vector<double>> separated_numbers(std::string_view text, std::string_view separators) {
  std::vector<double> numbers;
  for (std::size_t i = 0; i <= separators.size(); ++i) {
    const std::size_t end = i < separators.size() ? text.find(separators[i]) : text.size();
    const auto number = end == std::string_view::npos ? std::nullopt : finite_number(text.substr(0, end));
    if (!number) return std::nullopt;
    numbers.push_back(*number);
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  return numbers;
}

std::optional<std::pair<std::string, double>> named_number(std::string_view text) {
  const std::size_t equals = text.find('=');
  const auto number =
      equals == std::string_view::npos ? std::nullopt : finite_number(text.substr(equals + 1));
  if (!number || equals == 0) return std::nullopt;
  return std::pair{std::string(text.substr(0, equals)), *number};
}

}  // namespace takt

#include "server/runtime/requests/request_arguments.h"

#include <algorithm>
#include <charconv>
#include <cmath>

#include "idl/common/text.h"

namespace takt {
namespace {

template <typename Number>
bool read(std::string_view text, Number& number) {
  const char* end = text.data() + text.size();
  const auto [last, error] = std::from_chars(text.data(), end, number);
  return error == std::errc() && last == end;
}

}  // namespace

RequestArguments::RequestArguments(const ControlRequest& request,
                                   std::initializer_list<std::string_view> allowed)
    : request_(request) {
  for (std::size_t i = 0; i < request.arguments.size(); ++i) {
    const std::string& name = request.arguments[i].first;
    if (std::find(allowed.begin(), allowed.end(), name) == allowed.end()) {
      fail("has no argument '" + name + "'; it takes " + list_names(allowed) + ".");
    }
    for (std::size_t j = 0; j < i; ++j) {
      if (request.arguments[j].first == name) fail("has the argument '" + name + "' twice.");
    }
  }
}

const std::string* RequestArguments::find(std::string_view name) const {
  for (const auto& [key, value] : request_.arguments) {
    if (key == name) return &value;
  }
  return nullptr;
}

std::string RequestArguments::text(std::string_view name, std::string_view what) {
  const std::string* value = find(name);
  if (value == nullptr || value->empty())
    fail("needs the argument '" + std::string(name) + "': " + std::string(what));
  return value == nullptr ? std::string() : *value;
}

double RequestArguments::real(std::string_view name, std::optional<double> fallback, double low,
                              double high) {
  const std::string* value = find(name);
  if (value == nullptr && fallback) return *fallback;
  double number = 0.0;
  if (value != nullptr && read(*value, number) && number >= low && number <= high) return number;
  fail_value(name, value, "a number from " + exact_text(low) + " to " + exact_text(high));
  return low;
}

std::uint64_t RequestArguments::natural(std::string_view name, std::optional<std::uint64_t> fallback,
                                        std::uint64_t low, std::uint64_t high) {
  const std::string* value = find(name);
  if (value == nullptr && fallback) return *fallback;
  std::uint64_t number = 0;
  if (value != nullptr && read(*value, number) && number >= low && number <= high) return number;
  fail_value(name, value, "a whole number from " + std::to_string(low) + " to " + std::to_string(high));
  return low;
}

bool RequestArguments::reals(std::string_view name, std::initializer_list<double*> values) {
  const std::string* value = find(name);
  if (value == nullptr) return false;
  std::string_view rest = *value;
  std::size_t count = 0;
  bool numbers = true;
  while (numbers) {
    const std::size_t begin = rest.find_first_not_of(" ,");
    if (begin == std::string_view::npos) break;
    rest.remove_prefix(begin);
    const std::string_view word = rest.substr(0, rest.find_first_of(" ,"));
    rest.remove_prefix(word.size());
    double number = 0.0;
    numbers = read(word, number) && std::isfinite(number) && count < values.size();
    if (numbers) **(values.begin() + count++) = number;
  }
  if (!numbers || count != values.size()) {
    fail_value(name, value, std::to_string(values.size()) + " finite numbers, separated by spaces");
  }
  return true;
}

void RequestArguments::fail_value(std::string_view name, const std::string* value,
                                  const std::string& allowed) {
  const std::string found = value == nullptr ? "missing" : "'" + value->substr(0, 100) + "'";
  fail("argument '" + std::string(name) + "' is " + found + "; allowed is " + allowed + ".");
}

void RequestArguments::fail(const std::string& what) {
  if (!error_) error_ = "Request '" + request_.request + "' " + what;
}

}  // namespace takt

#pragma once
// Numbers and lists as text, the same in every locale.
#include <cstdint>
#include <functional>
#include <string>
#include <string_view>

namespace takt {

/// The shortest decimal text that reads back as the same number: "0.1", "1e-09", "inf", "nan".
std::string exact_text(double value);
/// With this number of significant digits, as printf("%.*g").
std::string number_text(double value, int digits = 9);
/// With this number of digits after the point, as printf("%.*f").
std::string fixed_text(double value, int decimals);
/// "0x" and 16 digits: hashes, as in all reports.
std::string hexadecimal_text(std::uint64_t number);

/// "1 face is" or "3 faces are".
std::string counted(std::size_t count, const char* one, const char* many);

/// A to Z as a to z; other bytes as they are.
std::string lower_text(std::string_view text);

/// `text(item)` of each item, with the separator between them.
template <class Items, class Text = std::identity>
std::string join(const Items& items, std::string_view separator, Text text = {}) {
  std::string result;
  bool first = true;
  for (const auto& item : items) {
    if (!first) result += separator;
    first = false;
    result += std::invoke(text, item);
  }
  return result;
}

/// Names, or the names of items, for the choices in an error: "a, b", "none".
template <class Items>
std::string list_names(const Items& items) {
  const auto name = [](const auto& item) {
    if constexpr (requires { item.name; })
      return std::string_view(item.name);
    else
      return std::string_view(item);
  };
  const std::string list = join(items, ", ", name);
  return list.empty() ? "none" : list;
}

}  // namespace takt

#pragma once
// Numbers and lists as text, the same in every locale.
#include <functional>
#include <string>
#include <string_view>

namespace takt {

/// The shortest decimal text that reads back as the same number: "0.1", "1e-09", "inf", "nan".
std::string exact_text(double value);

/// `text(item)` of each item of a range, with the separator between them; an empty range gives an empty text.
template <class Range, class Text = std::identity>
std::string join(const Range& items, std::string_view separator, Text text = {}) {
  std::string result;
  bool first = true;
  for (const auto& item : items) {
    if (!first) result += separator;
    first = false;
    result += std::invoke(text, item);
  }
  return result;
}

}  // namespace takt

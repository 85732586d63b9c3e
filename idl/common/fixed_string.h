#pragma once
// A short text of fixed capacity, copied between threads without allocation.
#include <algorithm>
#include <array>
#include <cstddef>
#include <string>
#include <string_view>

#include "idl/common/utf8.h"

namespace takt {

template <std::size_t Capacity>
class FixedString {
 public:
  FixedString() = default;
  explicit FixedString(std::string_view text) { assign(text); }

  /// Longer texts are cut off, between characters of UTF-8.
  void assign(std::string_view text) {
    size_ = utf8_prefix_size(text, Capacity);
    std::copy_n(text.begin(), size_, characters_.begin());
  }
  void clear() { size_ = 0; }
  bool empty() const { return size_ == 0; }
  std::string_view view() const { return {characters_.data(), size_}; }
  std::string str() const { return std::string(view()); }
  friend bool operator==(const FixedString& a, const FixedString& b) { return a.view() == b.view(); }

 private:
  std::array<char, Capacity> characters_{};
  std::size_t size_ = 0;
};

}  // namespace takt

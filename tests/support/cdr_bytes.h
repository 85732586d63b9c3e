#pragma once
// Samples in the plain CDR of DDS (XCDR1, little endian), put together value by value: four bytes that name the encoding,
// then the values in order, each number aligned to its size. Shares nothing with the codec of idl/common/cdr.h.
#include <bit>
#include <cstdint>
#include <cstring>
#include <string>
#include <string_view>
#include <type_traits>

namespace takt::test {

static_assert(std::endian::native == std::endian::little, "samples are written as memory has them");

inline constexpr std::size_t kEncapsulation_bytes = 4;

class CdrWriter {
 public:
  CdrWriter() { clear(); }
  void clear() { bytes_.assign({'\0', '\1', '\0', '\0'}); }

  template <typename Number>
  requires std::is_arithmetic_v<Number>
  void put(Number value) {
    const std::size_t used = (bytes_.size() - kEncapsulation_bytes) % sizeof(Number);
    if (used != 0) bytes_.append(sizeof(Number) - used, '\0');
    bytes_.append(reinterpret_cast<const char*>(&value), sizeof(Number));
  }
  void put(std::string_view text) {
    put(static_cast<std::uint32_t>(text.size() + 1));
    bytes_.append(text);
    bytes_.push_back('\0');
  }
  void put(const std::string& text) { put(std::string_view(text)); }
  void put(const char* text) { put(std::string_view(text)); }
  /// Number of elements of a sequence; they follow one by one.
  void count(std::size_t elements) { put(static_cast<std::uint32_t>(elements)); }
  template <typename Numbers>
  void sequence(const Numbers& numbers) {
    count(std::size(numbers));
    for (const auto& value : numbers) put(value);
  }

  const std::string& bytes() const { return bytes_; }

 private:
  std::string bytes_;
};

}  // namespace takt::test

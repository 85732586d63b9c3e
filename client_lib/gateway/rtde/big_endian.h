#pragma once
// Numbers as bytes, most significant first, as the protocols of Universal Robots write them.
#include <bit>
#include <concepts>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace takt::rtde {

template <std::unsigned_integral Unsigned>
void append_unsigned(std::string& bytes, Unsigned value) {
  for (int shift = 8 * static_cast<int>(sizeof value) - 8; shift >= 0; shift -= 8)
    bytes.push_back(
        static_cast<char>(static_cast<unsigned char>(static_cast<std::uint64_t>(value) >> shift)));
}
inline void append(std::string& bytes, std::uint8_t value) {
  append_unsigned(bytes, value);
}
inline void append(std::string& bytes, std::uint16_t value) {
  append_unsigned(bytes, value);
}
inline void append(std::string& bytes, std::uint32_t value) {
  append_unsigned(bytes, value);
}
inline void append(std::string& bytes, std::uint64_t value) {
  append_unsigned(bytes, value);
}
inline void append(std::string& bytes, std::int32_t value) {
  append(bytes, static_cast<std::uint32_t>(value));
}
inline void append(std::string& bytes, float value) {
  append(bytes, std::bit_cast<std::uint32_t>(value));
}
inline void append(std::string& bytes, double value) {
  append(bytes, std::bit_cast<std::uint64_t>(value));
}

/// Reads from the front. After the first read beyond the end all reads give 0, and failed() is true.
class Reader {
 public:
  explicit Reader(std::string_view bytes) : bytes_(bytes) {}
  std::uint8_t u8() { return static_cast<std::uint8_t>(number(1)); }
  std::uint16_t u16() { return static_cast<std::uint16_t>(number(2)); }
  std::uint32_t u32() { return static_cast<std::uint32_t>(number(4)); }
  std::uint64_t u64() { return number(8); }
  std::int32_t i32() { return static_cast<std::int32_t>(u32()); }
  double f64() { return std::bit_cast<double>(u64()); }
  std::string_view text(std::size_t size) {
    if (size > bytes_.size()) {
      failed_ = true;
      bytes_ = {};
      return {};
    }
    const std::string_view taken = bytes_.substr(0, size);
    bytes_.remove_prefix(size);
    return taken;
  }
  std::string_view rest() const { return bytes_; }
  bool failed() const { return failed_; }

 private:
  std::uint64_t number(std::size_t size) {
    std::uint64_t value = 0;
    for (const char byte : text(size)) value = value << 8U | static_cast<unsigned char>(byte);
    return value;
  }
  std::string_view bytes_;
  bool failed_ = false;
};

}  // namespace takt::rtde

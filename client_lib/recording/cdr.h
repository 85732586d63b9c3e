#pragma once
// Samples in the plain CDR of DDS (XCDR1, little endian), as DDS writers send them and recordings hold them:
// four bytes that name the encoding, then the members in order, each number aligned to its size.
#include <bit>
#include <cstdint>
#include <cstring>
#include <string>
#include <string_view>
#include <type_traits>

#include "client_lib/recording/message_types.h"

namespace takt::recording {

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

/// Throws RecordingError at a sample that ends too early.
class CdrReader {
 public:
  explicit CdrReader(std::string_view sample) : bytes_(sample) {
    if (sample.size() < kEncapsulation_bytes) too_short();
    if (sample[0] != '\0' || (sample[1] != '\1' && sample[1] != '\0'))
      throw RecordingError("A sample has an encoding other than plain CDR.");
    swapped_ = sample[1] == '\0';
    bytes_.remove_prefix(kEncapsulation_bytes);
  }

  template <typename Number>
  Number take() {
    place_ = (place_ + sizeof(Number) - 1) / sizeof(Number) * sizeof(Number);
    if (place_ > bytes_.size() || bytes_.size() - place_ < sizeof(Number)) too_short();
    char memory[sizeof(Number)];
    for (std::size_t i = 0; i < sizeof(Number); ++i)
      memory[i] = bytes_[place_ + (swapped_ ? sizeof(Number) - 1 - i : i)];
    place_ += sizeof(Number);
    Number value{};
    std::memcpy(&value, memory, sizeof(Number));
    return value;
  }
  std::string_view take_string() {
    const auto length = take<std::uint32_t>();
    if (bytes_.size() - place_ < length) too_short();
    std::string_view text = bytes_.substr(place_, length);
    place_ += length;
    if (text.ends_with('\0')) text.remove_suffix(1);
    return text;
  }
  std::size_t left() const { return bytes_.size() - place_; }

 private:
  [[noreturn]] static void too_short() { throw RecordingError("A sample ends before its last member."); }
  std::string_view bytes_;
  std::size_t place_ = 0;
  bool swapped_ = false;
};

}  // namespace takt::recording

#pragma once
// Bounds-checked reading of a packet: a cursor over bytes in either byte order. A read beyond the end gives
// zero and marks the cursor as bad; the caller tests it once at the end.
#include <cstddef>
#include <cstdint>
#include <span>

namespace takt {

class WireCursor {
 public:
  WireCursor(std::span<const std::uint8_t> bytes, bool big_endian) : bytes_(bytes), big_(big_endian) {}

  bool ok() const { return ok_; }
  std::size_t position() const { return position_; }
  std::size_t left() const { return bytes_.size() - position_; }
  bool big_endian() const { return big_; }

  std::uint8_t u8() {
    const auto at = take(1);
    return ok_ ? bytes_[at] : std::uint8_t{0};
  }
  std::uint16_t u16() {
    const auto at = take(2);
    if (!ok_) return 0;
    const auto first = bytes_[at], second = bytes_[at + 1];
    return static_cast<std::uint16_t>(big_ ? first << 8U | second : second << 8U | first);
  }
  std::uint32_t u32() {
    const auto at = take(4);
    if (!ok_) return 0;
    std::uint32_t value = 0;
    for (std::size_t i = 0; i < 4; ++i) value = value << 8U | bytes_[at + (big_ ? i : 3 - i)];
    return value;
  }
  /// High word, low word: the sequence numbers of RTPS.
  std::int64_t sequence_number() {
    const std::uint64_t high = u32();
    return static_cast<std::int64_t>(high << 32U | u32());
  }
  /// Bytes, the same in both byte orders.
  std::uint32_t entity_id() {
    std::uint32_t id = 0;
    for (int i = 0; i < 4; ++i) id = id << 8U | u8();
    return ok_ ? id : 0;
  }
  /// The next bytes; empty beyond the end.
  std::span<const std::uint8_t> bytes(std::size_t count) {
    const auto at = take(count);
    return ok_ ? bytes_.subspan(at, count) : std::span<const std::uint8_t>{};
  }
  void skip(std::size_t count) { take(count); }
  /// To the next multiple of 4, counted from the first byte. The padding may be missing at the very end.
  void align() {
    const std::size_t target = (position_ + 3U) & ~std::size_t{3};
    position_ = target < bytes_.size() ? target : bytes_.size();
  }

  /// To the next multiple of `size` (a power of two), counted from the first byte.
  void align_to(std::size_t size) { skip((size - position_ % size) % size); }
  /// Marks the cursor as bad.
  void fail() { ok_ = false; }

 private:
  std::size_t take(std::size_t count) {
    if (!ok_ || count > left()) {
      ok_ = false;
      return 0;
    }
    const std::size_t at = position_;
    position_ += count;
    return at;
  }

  std::span<const std::uint8_t> bytes_;
  std::size_t position_ = 0;
  bool big_;
  bool ok_ = true;
};

}  // namespace takt

#pragma once
// Records of bytes from one writing thread to one reading thread; neither waits, without allocation after
// construction. A record is written piece by piece and becomes visible to the reader when it is complete.
#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <type_traits>
#include <vector>

namespace takt {

class ByteRing {
 public:
  explicit ByteRing(std::size_t capacity) : bytes_(capacity) {}

  /// Writer.
  void begin() {
    end_ = head_.load(std::memory_order_relaxed) + sizeof(Size);
    fits_ = end_ - tail_.load(std::memory_order_acquire) <= bytes_.size();
  }
  template <typename T>
  requires std::is_arithmetic_v<T> || std::is_enum_v<T>
  void put(T value) { append(&value, sizeof(value)); }
  void append(const void* from, std::size_t size) {
    if (fits_ && end_ + size - tail_.load(std::memory_order_acquire) > bytes_.size()) fits_ = false;
    if (!fits_) return;
    copy_in(end_, from, size);
    end_ += size;
  }
  /// False if the record did not fit: it is discarded.
  bool commit() {
    if (!fits_) return false;
    const std::uint64_t begin = head_.load(std::memory_order_relaxed);
    const auto size = static_cast<Size>(end_ - begin - sizeof(Size));
    copy_in(begin, &size, sizeof(size));
    head_.store(end_, std::memory_order_release);
    return true;
  }
  /// Either.
  std::size_t filled() const {
    return static_cast<std::size_t>(head_.load(std::memory_order_acquire) -
                                    tail_.load(std::memory_order_acquire));
  }
  std::size_t capacity() const { return bytes_.size(); }

  /// Reader: the end of the complete records.
  std::uint64_t complete_to() const { return head_.load(std::memory_order_acquire); }
  /// Reader: the next record ahead of `to`; false if there is none.
  bool take(std::vector<std::byte>& record, std::uint64_t to) {
    const std::uint64_t tail = tail_.load(std::memory_order_relaxed);
    if (tail == to) return false;
    Size size = 0;
    copy_out(tail, &size, sizeof(size));
    record.resize(size);
    copy_out(tail + sizeof(size), record.data(), size);
    tail_.store(tail + sizeof(size) + size, std::memory_order_release);
    return true;
  }

 private:
  using Size = std::uint32_t;
  void copy_in(std::uint64_t at, const void* from, std::size_t size) {
    const auto begin = static_cast<std::size_t>(at % bytes_.size());
    const std::size_t first = std::min(size, bytes_.size() - begin);
    std::memcpy(bytes_.data() + begin, from, first);
    std::memcpy(bytes_.data(), static_cast<const std::byte*>(from) + first, size - first);
  }
  void copy_out(std::uint64_t at, void* to, std::size_t size) const {
    const auto begin = static_cast<std::size_t>(at % bytes_.size());
    const std::size_t first = std::min(size, bytes_.size() - begin);
    std::memcpy(to, bytes_.data() + begin, first);
    std::memcpy(static_cast<std::byte*>(to) + first, bytes_.data(), size - first);
  }

  std::vector<std::byte> bytes_;
  std::atomic<std::uint64_t> head_{0}, tail_{0};
  // Writer only.
  std::uint64_t end_ = 0;
  bool fits_ = false;
};

}  // namespace takt

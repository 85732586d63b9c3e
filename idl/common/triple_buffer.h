#pragma once
// Passes the latest value from one writing thread to one reading thread. Wait-free: neither side waits for
// the other, and the buffer copies no values. The reader gets the newest complete value; older ones are
// skipped.
//
// Of the three buffers one belongs to the writer, one to the reader, and the third lies between them.
// publish() and take() exchange the caller's buffer with the one in between.
// take() exchange one's own buffer with the one in between.
#include <array>
#include <atomic>
#include <cstdint>
#include <utility>

namespace takt {

template <typename T>
class TripleBuffer {
 public:
  TripleBuffer() = default;
  /// All three buffers start as copies of `initial`, so that values with inner storage are sized once.
  explicit TripleBuffer(const T& initial) : buffers_{initial, initial, initial} {}
  TripleBuffer(const TripleBuffer&) = delete;
  TripleBuffer& operator=(const TripleBuffer&) = delete;

  /// Writer: the buffer to fill. Holds an older value. Valid until publish().
  T& write_buffer() { return buffers_[writer_]; }
  /// Writer: makes the filled buffer the latest value.
  void publish() { writer_ = middle_.exchange(writer_ | kFresh, std::memory_order_acq_rel) & kIndex; }

  /// Reader: the latest value, or nullptr without a value newer than the last one taken. Valid until the next
  /// take().
  const T* take() {
    if ((middle_.load(std::memory_order_relaxed) & kFresh) == 0) return nullptr;
    reader_ = middle_.exchange(reader_, std::memory_order_acq_rel) & kIndex;
    return &buffers_[reader_];
  }

 private:
  static constexpr std::uint32_t kIndex = 3;
  static constexpr std::uint32_t kFresh = 4;

  std::array<T, 3> buffers_{};
  std::uint32_t writer_ = 0;
  std::atomic<std::uint32_t> middle_{1};
  std::uint32_t reader_ = 2;
};

}  // namespace takt

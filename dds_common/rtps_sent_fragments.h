#pragma once
// What the guard knows of own samples that were sent in pieces.
#include <array>
#include <cstddef>
#include <cstdint>
#include <mutex>
#include <span>

namespace takt {

/// Remembers into how many fragments own samples were cut, so that a request for the hundredth of three
/// fragments is told from a good one. Of a fixed size: forgets the oldest in the same slot, whose requests
/// are then refused.
class SentFragments {
 public:
  /// `packet` is about to be sent.
  void note(std::span<const std::uint8_t> packet);
  /// Number of fragments of that sample of that writer; 0: not known.
  std::uint32_t count(std::uint32_t writer, std::int64_t sequence_number) const;

 private:
  struct Entry {
    std::uint32_t writer = 0, fragments = 0;
    std::int64_t sequence_number = 0;
  };
  static constexpr std::size_t kEntries = 1024;
  static std::size_t slot(std::uint32_t writer, std::int64_t sequence_number);
  mutable std::mutex mutex_;
  std::array<Entry, kEntries> entries_{};  // guarded by mutex_
};

}  // namespace takt

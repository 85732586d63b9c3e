#pragma once
// Assembles fragmented samples, so that Fast DDS gets each as one piece of data. With an incomplete sample in
// its history 2.9.1 uses changes that it has released: after a gap over such a sample, the same number in one
// piece, or contradicting fragments (StatefulReader.cpp: processGapMsg removes past the instance's list,
// change_received releases its content). Complete samples avoid all of this. A reader that lacks one fragment
// requests the sample and gets all fragments again; those already present count. But 2.9.1 sends only the
// first 256 fragments of a sample again (ChangeForReader.h), so a sample with more is left to its reader,
// which requests single fragments.
#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <span>
#include <vector>

namespace takt {

/// Of one participant. Any thread. Bounded: the newest samples are kept, and a sender first evicts its own.
class FragmentAssembly {
 public:
  using Deliver = std::function<void(std::span<std::uint8_t> packet)>;
  static constexpr std::size_t kMaxSamples = 64, kMaxOfOneSender = 16;

  static constexpr std::uint32_t kMaxSentAgain = 256;  ///< fragments

  /// `most_fragments`: samples of more are not taken.
  explicit FragmentAssembly(std::uint32_t largest_sample_bytes, std::uint32_t most_fragments = 0xFFFFFFFF);

  /// A packet sent by this participant: identifies the participant.
  void sending(std::span<const std::uint8_t> packet);
  /// `packet` has no flaw (rtps_guard.h). Moves its fragments out and delivers completed samples as packets
  /// of their own. Returns the number of bytes of `packet` left for Fast DDS. Fragments between a prefix and
  /// a postfix of security stay, because their sender is authenticated.
  std::size_t take(std::span<std::uint8_t> packet, const Deliver& deliver);

  /// Half-assembled samples, and bytes that they take.
  std::size_t samples() const;
  std::size_t held_bytes() const;

 private:
  using Prefix = std::array<std::uint8_t, 12>;
  struct Piece;
  struct Sample {
    Prefix sender{};
    std::uint32_t writer = 0;
    std::int64_t number = 0;
    std::uint32_t bytes = 0;
    std::uint16_t fragment_bytes = 0;
    std::uint32_t missing = 0;  ///< fragments
    std::uint64_t used = 0;     ///< when, counted in fragments
    std::unique_ptr<std::uint8_t[]> packet;
    std::vector<bool> has;
  };
  /// The packet, when its sample is complete.
  std::unique_ptr<std::uint8_t[]> add(const Piece& piece);
  Sample& sample_of(const Piece& piece);
  void make_room(const Prefix& sender, std::size_t bytes);
  bool is_own(std::span<const std::uint8_t> destination) const;

  const std::size_t most_bytes_;
  const std::uint32_t most_fragments_;
  mutable std::mutex mutex_;  // guards all below but knows_itself_
  std::vector<Sample> samples_;
  std::size_t held_bytes_ = 0;
  std::uint64_t count_ = 0;
  Prefix self_{};
  std::atomic<bool> knows_itself_{false};
};

}  // namespace takt

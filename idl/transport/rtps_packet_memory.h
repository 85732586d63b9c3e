#pragma once
// What the guard remembers from packet to packet, of fixed size: the newest of each kind. Any thread.
#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <mutex>
#include <span>

#include "idl/transport/newest_entries.h"

namespace takt {

/// Bytes mixed up to a number, only to tell them apart.
std::uint64_t mixed(std::span<const std::uint8_t> bytes, std::uint64_t seed);

class PacketMemory {
 public:
  // --- own samples: a request for the hundredth of three fragments is told from a good one.
  /// `packet` is about to be sent.
  void note(std::span<const std::uint8_t> packet);
  /// Number of fragments of that sample of that writer; 0: not known.
  std::uint32_t count(std::uint32_t writer, std::int64_t sequence_number) const;

  // --- samples of others: Fast DDS trusts each fragment to fit the first, and mixes up a sample that comes
  // in one piece with a half-assembled one of the same number.
  struct Sample {
    std::span<const std::uint8_t> sender;  ///< GUID prefix
    std::uint32_t writer;
    std::int64_t sequence_number;
  };
  /// So many numbers back what came in fragments is known for sure; older ones are not taken any more.
  static constexpr std::int64_t kFragmentsBack = 1000;
  /// A fragment of that sample; false if it contradicts an earlier one.
  bool admit(const Sample& sample, std::uint16_t fragment_bytes, std::uint32_t sample_bytes);
  /// Has come in fragments, or may have.
  bool fragmented(const Sample& sample);

  /// A sample of this writer in fragments lies within sample.sequence_number .. last, as far as remembered.
  bool fragments_within(const Sample& sample, std::int64_t last);
  /// The writer no longer has anything before this number, and so there is nothing half assembled either.
  void left_behind(const Sample& sample);

  /// A writer's numbers do not leap: Fast DDS walks over each number that was left out, at half a microsecond
  /// and more. A leap that the writer's next packets confirm is one (it wrote while nobody heard it), but for
  /// absurd ones.
  static constexpr std::int64_t kStep = 1 << 12, kLongestLeap = 1 << 24, kLargestFirst = 1 << 27;
  static constexpr int kConfirmations = 2;
  bool follows(const Sample& sample);

  /// An endpoint does not change what never changes: Fast DDS believes it, and ends on an assertion later.
  /// `endpoint` and `unchanging` as in ListReport.
  bool same_as_before(std::uint64_t endpoint, std::uint64_t unchanging);

 private:
  struct Sent {
    std::uint32_t writer = 0, fragments = 0;
    std::int64_t sequence_number = 0;
  };
  struct Received {
    std::uint64_t key = 0;
    std::uint32_t sample_bytes = 0;
    std::uint16_t fragment_bytes = 0;
  };
  struct Writer {
    std::uint64_t key = 0;
    std::int64_t highest = 0;    ///< 0: not heard of yet
    std::int64_t candidate = 0;  ///< of a leap that is not confirmed yet
    int confirmed = 0;
    std::int64_t fragments_from = 0, fragments_to = -1;  ///< numbers of samples that came in fragments
  };
  struct Endpoint {
    std::uint64_t key = 0, unchanging = 0;
  };
  static constexpr std::size_t kSent = 1024;
  static std::size_t slot(std::uint32_t writer, std::int64_t sequence_number);
  static std::uint64_t key_of(const Sample& sample);
  static std::uint64_t writer_key_of(const Sample& sample) {
    return key_of({sample.sender, sample.writer, 0});
  }
  static bool too_old(const Writer& writer, std::int64_t number) {
    return number >= writer.fragments_from && number < writer.fragments_to - kFragmentsBack;
  }

  mutable std::mutex mutex_;  // guards all below but any_received_
  std::array<Sent, kSent> sent_{};
  NewestEntries<Received, 4096> received_;
  NewestEntries<Writer, 1024> writers_;
  NewestEntries<Endpoint, 4096> endpoints_;
  std::atomic<bool> any_received_{false};
};

}  // namespace takt

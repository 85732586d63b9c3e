#pragma once
// What the guard remembers from packet to packet, of fixed size: the newest of each kind. Any thread.
#include <array>
#include <cstddef>
#include <cstdint>
#include <mutex>
#include <span>

#include "idl/transport/newest_entries.h"

namespace takt {

/// Bytes mixed up to a number, only to tell them apart.
std::uint64_t mixed(std::span<const std::uint8_t> bytes, std::uint64_t seed);

/// What an announcement says of an endpoint, mixed up: its GUID, the GUID prefix, and what never changes
/// about it (names, reliability, durability, ownership). All 0: it is no announcement of one.
struct EndpointTraits {
  std::uint64_t guid = 0, participant = 0, unchanging = 0;
};

class PacketMemory {
 public:
  // --- own samples: a request for the hundredth of three fragments is told from a good one.
  /// `packet` is about to be sent.
  void note(std::span<const std::uint8_t> packet);
  /// Number of fragments of that sample of that writer; 0: not known.
  std::uint32_t count(std::uint32_t writer, std::int64_t sequence_number) const;

  struct Sample {
    std::span<const std::uint8_t> sender;  ///< GUID prefix
    std::uint32_t writer;
    std::int64_t sequence_number;
  };
  /// A writer's numbers do not leap: Fast DDS walks over each number that was left out, at half a microsecond
  /// and more. A leap that the writer's next packets confirm is one (it wrote while nobody heard it), but for
  /// absurd ones.
  static constexpr std::int64_t kStep = 1 << 12, kLongestLeap = 1 << 24, kLargestFirst = 1 << 27;
  static constexpr int kConfirmations = 2;
  bool follows(const Sample& sample);

  /// An endpoint does not change what never changes: Fast DDS believes it, and ends on an assertion later.
  bool same_as_before(const EndpointTraits& endpoint);
  /// DDS has forgotten this endpoint, or this participant and with it its endpoints: under the same GUID
  /// something else may come. `guid`: 16 bytes.
  void forget(std::span<const std::uint8_t> guid);

  /// Senders (GUID prefix) whose packets in shared memory end with what are no submessages (PacketWay).
  void note_tail(std::span<const std::uint8_t> sender);
  bool leaves_tails(std::span<const std::uint8_t> sender);

 private:
  struct Sent {
    std::uint32_t writer = 0, fragments = 0;
    std::int64_t sequence_number = 0;
  };
  struct Writer {
    std::uint64_t key = 0;
    std::int64_t highest = 0;    ///< 0: not heard of yet
    std::int64_t candidate = 0;  ///< of a leap that is not confirmed yet
    int confirmed = 0;
  };
  struct Endpoint {
    std::uint64_t key = 0, participant = 0, unchanging = 0;
  };
  struct Sender {
    std::uint64_t key = 0;
  };
  static constexpr std::size_t kSent = 1024;
  static std::size_t slot(std::uint32_t writer, std::int64_t sequence_number);
  mutable std::mutex mutex_;  // guards all below
  std::array<Sent, kSent> sent_{};
  NewestEntries<Writer, 1024> writers_;
  NewestEntries<Endpoint, 4096> endpoints_;
  NewestEntries<Sender, 128> leaving_tails_;
};

}  // namespace takt

#pragma once
// What the guard remembers from packet to packet, of fixed size: the newest of each kind. Any thread.
#include <array>
#include <cstddef>
#include <cstdint>
#include <mutex>
#include <span>

#include "idl/transport/rtps_guard/lru_table.h"

namespace takt {

/// Bytes mixed up to a number, only to tell them apart.
std::uint64_t mixed(std::span<const std::uint8_t> bytes, std::uint64_t seed);

/// Of the participant that a GUID of 16 bytes, or its prefix, belongs to.
std::uint64_t participant_key(std::span<const std::uint8_t> guid);

/// What an announcement says of an endpoint, mixed up: its GUID, the GUID prefix, and what never changes
/// about it (names, reliability, durability, ownership). All 0: it is no announcement of one.
struct EndpointTraits {
  std::uint64_t guid = 0, participant = 0, unchanging = 0;
};

/// Seconds of a clock that is never set, coarse.
std::uint32_t uptime_s();

class RtpsSessionState {
 public:
  using Clock_s = std::uint32_t (*)();
  explicit RtpsSessionState(Clock_s now_s = &uptime_s) : now_s_(now_s) {}

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
  /// Nor is there one more of a participant that DDS knows than this has room for: else the endpoints of
  /// such participants would be forgotten, and could change, while DDS still has them.
  bool same_as_before(const EndpointTraits& endpoint);
  /// DDS knows this participant. `guid`: 16 bytes, as below.
  void know(std::span<const std::uint8_t> guid);
  /// DDS has forgotten this participant, and with it its endpoints: under the same GUIDs others may come. Or
  /// it has forgotten this endpoint alone: its place may be taken, but for it nothing changes, since Fast DDS
  /// may have an announcement of it that waits for an earlier one, and believes it then.
  void forget(std::span<const std::uint8_t> guid);
  /// DDS has forgotten this participant because it was silent. Endpoints that it has announced in the last
  /// two seconds stay what they are: Fast DDS finds such silence in a thread of its own, and keeps for ever
  /// what another thread was making of an announcement at that moment.
  void forget_silent(std::span<const std::uint8_t> guid);

  /// SenderRegistry (GUID prefix) whose packets in shared memory end with what are no submessages (TransportKind).
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
    std::uint32_t announced_s = 0;
    bool gone = false;
  };
  struct Sender {
    std::uint64_t key = 0;
  };
  static constexpr std::size_t kSent = 1024;
  static std::size_t slot(std::uint32_t writer, std::int64_t sequence_number);
  void forget(std::uint64_t participant, std::uint32_t announced_until_s);
  const Clock_s now_s_;
  mutable std::mutex mutex_;  // guards all below
  std::array<Sent, kSent> sent_{};
  LruTable<Writer, 1024> writers_;
  LruTable<Endpoint, 1024, 16> endpoints_;
  LruTable<Sender, 64, 16> participants_;  ///< that DDS knows, which are 256 at most
  LruTable<Sender, 128> leaving_tails_;
};

}  // namespace takt

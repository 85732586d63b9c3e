#pragma once
// State of the guard between packets, of fixed size: the newest entries of each kind. Any thread.
#include <array>
#include <cstddef>
#include <cstdint>
#include <mutex>
#include <span>

#include "idl/transport/rtps_guard/lru_table.h"
#include "idl/transport/rtps_guard/participant_places.h"
#include "idl/transport/rtps_guard/rtps_guard.h"
#include "idl/transport/rtps_guard/rtps_submessage.h"
#include "idl/transport/rtps_guard/source_table.h"

namespace takt {

/// A hash of bytes, for comparison only.
std::uint64_t mixed(std::span<const std::uint8_t> bytes, std::uint64_t seed);

/// Of the participant that a GUID of 16 bytes, or its prefix, belongs to.
std::uint64_t participant_key(std::span<const std::uint8_t> guid);

/// Hashes of an endpoint's announcement: its GUID, the GUID prefix, and its immutable properties (names,
/// reliability, durability, ownership). All 0: not an announcement of an endpoint.
struct EndpointTraits {
  std::uint64_t guid = 0, participant = 0, unchanging = 0;
};

/// What a builtin writer announces.
enum class AnnouncedEndpoints : std::uint8_t { writers, readers };

/// Seconds of a clock that is never set, coarse.
std::uint32_t uptime_s();

class RtpsSessionState {
 public:
  using Clock_s = std::uint32_t (*)();
  explicit RtpsSessionState(Clock_s now_s = &uptime_s) : now_s_(now_s) {}

  // --- Own samples: distinguishes a request for the hundredth of three fragments from a valid one.
  /// Call it ahead of sending `packet`.
  void note(std::span<const std::uint8_t> packet);
  /// The largest sequence number that this participant has sent for announcements of its endpoints; 0: none.
  std::int64_t last_announcement(AnnouncedEndpoints kind) const;
  /// Number of fragments of that sample of that writer; 0: unknown.
  std::uint32_t count(std::uint32_t writer, std::int64_t sequence_number) const;

  /// Whether packets that name this participant (GUID prefix) may come from there (SourceTable). Notes a packet.
  bool sends_from(std::span<const std::uint8_t> sender, const PacketOrigin& origin);
  /// Whether DDS may store this participant, which is announced (ParticipantPlaces).
  bool has_place(const ParticipantPlaces::Prefix& sender, const PacketOrigin& origin, std::int64_t number);
  /// This participant has received something of this one.
  void answers(const ParticipantPlaces::Prefix& sender);
  /// A reader of this participant has answered a heartbeat of this own writer.
  void note_synchronised(const ParticipantPlaces::Prefix& sender, std::uint32_t writer);
  bool is_synchronised(const ParticipantPlaces::Prefix& sender, std::uint32_t writer);
  /// The next participant that has to give way.
  std::optional<ParticipantPlaces::Farewell> overdue_participant();

  struct Sample {
    std::span<const std::uint8_t> sender;  ///< GUID prefix
    std::uint32_t writer;
    std::int64_t sequence_number;
  };
  /// Refuses leaps of a writer's sequence numbers: Fast DDS visits each omitted number, at half a microsecond
  /// or more. A leap confirmed by the writer's next packets is accepted (it wrote without a reader), except
  /// for absurd ones.
  static constexpr std::int64_t kStep = 1 << 12, kLongestLeap = 1 << 24, kLargestFirst = 1 << 27;
  static constexpr int kConfirmations = 2;
  bool follows(const Sample& sample);

  /// Refuses changes of an endpoint's immutable properties: Fast DDS accepts them, and ends on an assertion
  /// later. Also refuses endpoints beyond the capacity for a known participant: else its endpoints would be
  /// evicted, and could change, while DDS still has them.
  bool same_as_before(const EndpointTraits& endpoint);
  /// DDS has discovered this participant. `guid`: 16 bytes, as below.
  void know(std::span<const std::uint8_t> guid);
  /// DDS has dropped this participant with its endpoints: new ones may have the same GUIDs. Or it has dropped
  /// this endpoint alone: its place may be reused, but its properties stay immutable, because Fast DDS may
  /// still accept an announcement of it that waits for an earlier one.
  void forget(std::span<const std::uint8_t> guid);
  /// DDS has dropped this participant because of its silence. Endpoints announced in the last two seconds
  /// keep their properties: Fast DDS detects silence in a thread of its own, and keeps for ever the results
  /// of an announcement that another thread processes at that moment.
  void forget_silent(std::span<const std::uint8_t> guid);

  /// Marks a sender (GUID prefix) whose packets in shared memory end with invalid submessages
  /// (TransportKind).
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
  void note_announcement(const Submessage& submessage, std::span<const std::uint8_t> body);
  void forget(std::uint64_t participant, std::uint32_t announced_until_s);
  const Clock_s now_s_;
  mutable std::mutex mutex_;  // guards all below
  std::array<Sent, kSent> sent_{};
  std::array<std::int64_t, 2> last_announcements_{};  ///< of AnnouncedEndpoints
  LruTable<Writer, 1024> writers_;
  LruTable<Endpoint, 1024, 16> endpoints_;
  LruTable<Sender, 64, 16> participants_;  ///< known to DDS, at most 256
  LruTable<Sender, 128> leaving_tails_;
  LruTable<Sender, 512> synchronised_;  ///< keys of participant and own writer: note_synchronised()
  SourceTable sources_;
  ParticipantPlaces places_;
};

}  // namespace takt

#pragma once
// The addresses from which participants send. A participant has sockets of its own for sending, so a packet
// that names it and comes from another address and port was sent by another process.
#include <array>
#include <cstdint>

#include "idl/transport/rtps_guard/lru_table.h"

namespace takt {

/// Of fixed size. Times in s of a clock that is never set.
class SourceTable {
 public:
  /// Packets, and the time from the first to the last of them, that prove a source; the longer time if another
  /// source of the participant was proven before.
  static constexpr std::uint32_t kProof = 4, kProof_s = 1, kContest_s = 3;
  /// Source of all packets in shared memory, which only this machine can write: proven at once.
  static constexpr std::uint64_t kSharedMemory = 0;

  /// Notes a packet. False if another source of this participant is proven and this one is not. Any source is
  /// admitted before one is proven, and for kContest_s: a participant may send from several sockets, each of which it
  /// proves.
  bool admits(std::uint64_t participant, std::uint64_t source, std::uint32_t now_s) {
    Participant* known = participants_.find(participant);
    if (known == nullptr)
      known = participants_.insert_for(participant, [](const Participant& one) { return !one.proven(); });
    if (known == nullptr) known = &participants_.insert(participant);
    if (source == kSharedMemory) return known->in_shared_memory = true;
    const bool contested = known->proven();
    Source& one = known->source(source);
    if (one.packets == 0) one.first_s = now_s, one.late = contested;
    if (one.packets < kProof) ++one.packets;
    if (!one.proven && one.packets == kProof && now_s - one.first_s >= (one.late ? kContest_s : kProof_s))
      one.proven = true;
    return one.proven || !contested || (!one.late && now_s - one.first_s <= kContest_s);
  }
  /// The participant has left.
  void forget(std::uint64_t participant) {
    participants_.erase_if([&](const Participant& one) { return one.key == participant; });
  }

 private:
  struct Source {
    std::uint64_t key = 0;
    std::uint32_t first_s = 0, packets = 0;
    bool late = false;  ///< first heard when another one was proven
    bool proven = false;
  };
  struct Participant {
    bool proven() const {
      return in_shared_memory ||
             std::any_of(sources.begin(), sources.end(), [](const Source& one) { return one.proven; });
    }
    /// The newest is first. A further one takes the place of the oldest that is not proven, else of the oldest.
    Source& source(std::uint64_t source_key) {
      auto at = std::find_if(sources.begin(), sources.end(),
                             [&](const Source& one) { return one.key == source_key; });
      if (at == sources.end()) {
        const auto oldest =
            std::find_if(sources.rbegin(), sources.rend(), [](const Source& one) { return !one.proven; });
        at = oldest == sources.rend() ? sources.end() - 1 : oldest.base() - 1;
        *at = {};
        at->key = source_key;
      }
      std::rotate(sources.begin(), at, at + 1);
      return sources.front();
    }
    std::uint64_t key = 0;
    bool in_shared_memory = false;
    std::array<Source, 8> sources{};
  };
  LruTable<Participant, 64, 16> participants_;
};

}  // namespace takt

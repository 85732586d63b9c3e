#pragma once
// Owner of each robot, gripper or device among the senders (command_arbiter.h), with the senders' liveliness
// leases: a sender without a sign of life in time loses its target, before Fast DDS 2.9.1 drops its
// participant.
//
// Not thread-safe.
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "server/dds/command_arbiter.h"
#include "server/dds/command_topics.h"
#include "server/dds/participant.h"
#include "server/dds/sender_registry.h"

namespace takt {

/// A writer of commands that was discovered.
struct CommandWriter {
  std::string topic, type;
  std::uint32_t strength = 0;
  double lease_s = 0.0;    ///< within which it promises a sign of life; infinity: never
  CommandTopic command{};  ///< in the present cell
  bool expired = false;    ///< has not kept the lease; no sender until it is heard of again
  bool wrong_type_reported = false;
};

class CommandOwnership {
 public:
  explicit CommandOwnership(SenderRegistry& senders) : senders_(senders) {}

  /// Sets the source of signs of life; call it ahead of any discovery of writers. nullptr: DDS alone
  /// supervises leases. Participants of this process, whose packets take another way, are not supervised.
  void listen_for(LivelinessTracker* tracker, const DdsGuid& own);
  bool listens() const { return tracker_ != nullptr; }

  /// Another cell, with this many targets: all owners are removed. The caller renews the writers' `command`.
  void restart(std::size_t targets);
  std::map<DdsGuid, CommandWriter>& writers() { return writers_; }
  CommandWriter& add(const DdsGuid& guid, CommandWriter writer);
  void remove(const DdsGuid& guid);

  /// A reader of the target has matched; -1: of several targets. Returns the sender that is not heard beside a stronger one.
  std::optional<std::uint64_t> matched(int target, const DdsGuid& guid, bool exclusive);
  void unmatched(int target, const DdsGuid& guid);
  /// A valid command arrived. std::nullopt: from a sender that has disappeared. `loser`: as of matched().
  std::optional<CommandArbiter::Verdict> on_command(int target, const DdsGuid& guid, bool exclusive,
                                                    std::int64_t received_ns,
                                                    std::optional<std::uint64_t>& loser);

  /// The owner of each target: the number of a sender, or 0.
  std::vector<std::uint64_t> owners() const;

  struct Revoked {
    int target = -1;
    DdsGuid owner;
    double silence_s = 0.0;
  };
  /// Call it often: returns targets whose owner has not kept its lease and that another sender may get, at
  /// once or later. A single owner that comes back stays the owner.
  std::vector<Revoked> expire();

 private:
  std::optional<std::uint64_t> appeared(int target, const DdsGuid& guid, bool exclusive);
  void watch(const DdsGuid& guid, CommandWriter& writer);
  /// The arbiters of the targets that the writer commands: of one, or, for several, of all.
  std::span<CommandArbiter> arbiters_of(const CommandWriter& writer);
  double silence_s(const DdsGuid& guid) const;

  SenderRegistry& senders_;
  LivelinessTracker* tracker_ = nullptr;
  DdsGuid own_;
  std::vector<CommandArbiter> arbiters_;  ///< by target
  std::map<DdsGuid, CommandWriter> writers_;
  std::map<int, DdsGuid> silent_owners_;  ///< by target that exclusive readers keep for them
  std::set<DdsGuid> gone_;                ///< unmatched: samples under way from them are ignored
};

}  // namespace takt

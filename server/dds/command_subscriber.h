#pragma once
// Commands off the wire: sample -> validated command -> RunLoop::append. Whatever is wrong with one is told
// in an event with code, sender and a sentence, and counted; the last good set-point holds.
#include <atomic>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "server/dds/adapter_events.h"
#include "server/dds/command_arbiter.h"
#include "server/dds/participant.h"
#include "server/dds/senders.h"
#include "server/dds/topic_names.h"
#include "server/runtime/run_loop.h"

namespace takt {

class CommandSubscriber {
 public:
  CommandSubscriber(RunLoop& loop, AdapterEvents& events, Senders& senders);
  ~CommandSubscriber();
  CommandSubscriber(const CommandSubscriber&) = delete;
  CommandSubscriber& operator=(const CommandSubscriber&) = delete;

  /// Makes the readers. Call once; the participant must be destroyed before this object.
  void listen(Participant& participant, const TopicNames& topics);

  /// A writer of any topic was discovered. Called by the participant's listener, before a reader of that
  /// topic is told.
  void writer_discovered(const DdsGuid& guid, const std::string& topic, std::uint32_t strength);
  void writer_removed(const DdsGuid& guid);

  std::uint64_t rejected() const { return rejected_.load(std::memory_order_relaxed); }

 private:
  class Reader;
  friend class Reader;

  /// To be called with mutex_ held. See CommandArbiter::appeared.
  std::optional<std::uint64_t> appeared(int target, const DdsGuid& guid, bool exclusive);
  void matched(int target, const DdsGuid& guid, bool exclusive);
  void unmatched(int target, const DdsGuid& guid);
  void incompatible(int target, const std::string& policy);
  /// Ownership, then the loop.
  void deliver(int target, bool exclusive, const Command& command, const DdsGuid& guid,
               std::int64_t received_ns);
  void reject(const Rejection& rejection, const DdsGuid& guid);

  RunLoop& loop_;
  AdapterEvents& events_;
  Senders& senders_;
  TopicNames topics_;
  std::vector<std::unique_ptr<Reader>> readers_;
  std::atomic<std::uint64_t> rejected_{0};
  std::mutex mutex_;
  std::vector<CommandArbiter> arbiters_;        // guarded by mutex_; per target
  std::map<DdsGuid, std::uint32_t> strengths_;  // guarded by mutex_; of the command writers discovered
  std::set<DdsGuid> gone_;  ///< unmatched: what is still under way from them does not count
};

}  // namespace takt

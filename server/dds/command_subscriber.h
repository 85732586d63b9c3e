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

#include "server/dds/command_arbiter.h"
#include "server/dds/participant.h"
#include "server/dds/senders.h"
#include "server/dds/topic_names.h"
#include "server/runtime/adapter_events.h"
#include "server/runtime/run_loop.h"

namespace takt {

class CommandSubscriber {
 public:
  CommandSubscriber(AdapterEvents& events, Senders& senders, TopicNames topics);
  ~CommandSubscriber();
  CommandSubscriber(const CommandSubscriber&) = delete;
  CommandSubscriber& operator=(const CommandSubscriber&) = delete;

  /// Makes the readers for the robots and grippers of this loop's cell; what comes in goes to the loop. Both
  /// must live until close(). Throws DdsError; close() then removes what was made before.
  void open(Participant& participant, RunLoop& loop);
  /// Removes the readers; after it the loop is not used any more. May be called more than once.
  void close();

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

  struct Writer {
    std::string topic;
    std::uint32_t strength = 0;
  };
  /// Of a command writer on a topic that nobody listens to: an event says so.
  std::optional<AdapterEvent> unheard(const DdsGuid& guid, const std::string& topic,
                                      const CellDescription& cell) const;

  RunLoop* loop_ = nullptr;  ///< while open; changed with mutex_ held and no reader there
  Participant* participant_ = nullptr;
  AdapterEvents& events_;
  Senders& senders_;
  TopicNames topics_;
  struct Listening {
    std::unique_ptr<Reader> listener;
    dds::DataReader* reader = nullptr;
  };
  std::vector<Listening> readers_;
  std::atomic<std::uint64_t> rejected_{0};
  std::mutex mutex_;
  std::vector<CommandArbiter> arbiters_;  // guarded by mutex_; per target
  std::map<DdsGuid, Writer> writers_;     // guarded by mutex_; command writers discovered
  std::set<DdsGuid> gone_;                ///< unmatched: what is still under way from them does not count
};

}  // namespace takt

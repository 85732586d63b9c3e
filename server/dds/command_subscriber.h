#pragma once
// Commands off the wire: sample -> validated command -> RunLoop::append. Whatever is wrong with one is reported in an
// event with code, sender and a sentence, and counted; the last good set-point holds.
#include <atomic>
#include <cstdint>
#include <memory>
#include <mutex>
#include <set>
#include <string>
#include <vector>

#include "server/dds/command_ownership.h"
#include "server/dds/command_topics.h"
#include "server/dds/participant.h"
#include "server/dds/sender_registry.h"
#include "server/dds/topic_names.h"
#include "server/runtime/loop/run_loop.h"
#include "server/runtime/requests/event_queue.h"

namespace takt {

class CommandSubscriber {
 public:
  CommandSubscriber(EventQueue& events, SenderRegistry& senders, TopicNames topics);
  ~CommandSubscriber();
  CommandSubscriber(const CommandSubscriber&) = delete;
  CommandSubscriber& operator=(const CommandSubscriber&) = delete;

  /// See CommandOwnership::listen_for().
  void listen_for(const PacketGuard* guard, const DdsGuid& own);

  /// Makes the readers for the robots, grippers and devices of this loop's cell; what comes in goes to the loop. Both
  /// must live until close(). Throws DdsError; close() then removes what was made before.
  void open(Participant& participant, RunLoop& loop);
  /// Removes the readers; after it the loop is not used any more. May be called more than once.
  void close();

  /// A writer of any topic was discovered. Called by the participant's listener, before a reader of that
  /// topic is notified.
  void writer_discovered(const DdsGuid& guid, CommandWriter writer);
  void writer_removed(const DdsGuid& guid);

  /// One thread, often: takes the targets of senders that have not kept their lease, so that the next sender is heard.
  void expire_liveliness_leases();

  std::uint64_t rejected() const { return rejected_.load(std::memory_order_relaxed); }

 private:
  class Reader;
  friend class Reader;
  struct Listening {
    std::unique_ptr<Reader> listener;
    dds::DataReader* reader = nullptr;
  };
  dds::DataReader* make_reader(Reader& listener);
  /// In DDS an exclusive reader keeps to its strongest sender for as long as that one's participant is remembered. A
  /// new reader has none until the first command comes in, and that is not from one that is silent.
  void renew_exclusive_readers(const std::set<int>& targets);
  std::string name_of(int target) const { return std::string(target_name(loop_->cell(), target)); }

  void matched(int target, const DdsGuid& guid, bool exclusive);
  void unmatched(int target, const DdsGuid& guid);
  /// Ownership, then the loop.
  void deliver(int target, bool exclusive, const Command& command, const DdsGuid& guid,
               std::int64_t received_ns);
  void reject(const Rejection& rejection, const DdsGuid& guid);
  /// With mutex_ held.
  void diagnose(const DdsGuid& guid, CommandWriter& writer);

  EventQueue& events_;
  SenderRegistry& senders_;
  const TopicNames topics_;
  RunLoop* loop_ = nullptr;  ///< while open; changed with mutex_ held and no reader there
  Participant* participant_ = nullptr;
  std::atomic<std::uint64_t> rejected_{0};
  std::mutex readers_mutex_;        ///< never taken with mutex_ held
  std::vector<Listening> readers_;  // guarded by readers_mutex_
  std::mutex mutex_;
  CommandOwnership ownership_;  // guarded by mutex_
};

}  // namespace takt

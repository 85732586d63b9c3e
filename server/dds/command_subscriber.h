#pragma once
// Received commands: sample -> validated command -> RunLoop::append. A fault is reported in an event with
// code, sender and a sentence, and counted; the last valid set-point stays.
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

  /// Makes the readers for the robots, grippers and devices of this loop's cell; their commands go to the
  /// loop. Both arguments must live until close(). Throws DdsError; close() then removes the readers made so
  /// far.
  void open(Participant& participant, RunLoop& loop);
  /// Removes the readers; afterwards the loop is unused. May be called more than once.
  void close();

  /// Discovery of a writer of any topic. Called by the participant's listener, ahead of the notification of a
  /// reader of that topic.
  void writer_discovered(const DdsGuid& guid, CommandWriter writer);
  void writer_removed(const DdsGuid& guid);

  /// One thread, often: revokes the targets of senders that have not kept their lease, so that the next
  /// sender gets them.
  void expire_liveliness_leases();

  /// The owners of the targets that have one, in the order of the targets; none while closed.
  std::vector<takt_msgs::msg::TargetOwner> owners() const;

  std::uint64_t rejected() const { return rejected_.load(std::memory_order_relaxed); }

 private:
  class Reader;
  friend class Reader;
  struct Listening {
    std::unique_ptr<Reader> listener;
    dds::DataReader* reader = nullptr;
  };
  dds::DataReader* make_reader(Reader& listener);
  /// In DDS an exclusive reader keeps its strongest sender as long as that one's participant exists. A new
  /// reader has no sender until the first command, which cannot come from a silent one.
  void renew_exclusive_readers(const std::set<int>& targets);
  std::string name_of(int target) const {
    const CellDescription& cell = loop_->cell();
    return target < 0 ? cell.cell : std::string(target_name(cell, target));
  }

  void matched(int target, const DdsGuid& guid, bool exclusive);
  void unmatched(int target, const DdsGuid& guid);
  /// Checks ownership, then appends to the loop.
  void deliver(int target, bool exclusive, const Command& command, const DdsGuid& guid,
               std::int64_t received_ns);
  /// Checks a command of a sample, then delivers it.
  template <typename Message>
  void received(int target, bool exclusive, Message&& message, const DdsGuid& guid, std::int64_t received_ns);
  void received_several(takt_msgs::msg::Commands&& message, const DdsGuid& guid, std::int64_t received_ns);
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
  mutable std::mutex mutex_;
  CommandOwnership ownership_;  // guarded by mutex_
};

}  // namespace takt

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
#include <string_view>
#include <vector>

#include "server/dds/command_arbiter.h"
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

  /// Before any writer is discovered: where to hear of participants. Null: their leases are left to DDS.
  /// Participants of this process, whose packets take another way, are not listened for.
  void listen_for(const PacketGuard* guard, const DdsGuid& own);

  /// Makes the readers for the robots and grippers of this loop's cell; what comes in goes to the loop. Both
  /// must live until close(). Throws DdsError; close() then removes what was made before.
  void open(Participant& participant, RunLoop& loop);
  /// Removes the readers; after it the loop is not used any more. May be called more than once.
  void close();

  struct Discovered {
    DdsGuid guid;
    std::string topic, type;
    std::uint32_t strength = 0;
    double lease_s = 0.0;  ///< within which it promises a sign of life; infinity: never
  };
  /// A writer of any topic was discovered. Called by the participant's listener, before a reader of that
  /// topic is told.
  void writer_discovered(const Discovered& discovered);
  void writer_removed(const DdsGuid& guid);

  /// Publishing thread, often: takes the targets of senders that have not kept their promise of a sign of
  /// life, so that the next sender is heard. Fast DDS 2.9.1 would wait until the participant is given up.
  void expire_liveliness_leases();

  std::uint64_t rejected() const { return rejected_.load(std::memory_order_relaxed); }

 private:
  class Reader;
  friend class Reader;
  enum class Kind { joints, trajectory, gripper, device };
  struct Listening {
    int target = -1;
    Kind kind = Kind::joints;
    bool exclusive = false;
    std::unique_ptr<Reader> listener;
    dds::DataReader* reader = nullptr;
  };
  static const TopicInfo& topic_of(Kind kind);
  /// The robot, gripper or device in the name of a command topic; empty for any other name.
  std::string element_in(const std::string& topic) const;
  void listen(int target, Kind kind);
  void renew_readers(const std::set<int>& targets);
  int target_of_topic(const std::string& topic) const;
  /// With mutex_ held. Adds the targets that are free now, with an event for each.
  void revoke_expired_ownership(std::set<int>& freed, std::vector<DiagnosticEvent>& news);
  dds::DataReader* make_reader(const std::string& topic, const Listening& made);

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
    std::string topic, type;
    std::uint32_t strength = 0;
    double lease_s = 0.0;
    bool silent = false;     ///< has not kept it; no sender until it is heard of again
    bool type_told = false;  ///< that it is the wrong one
  };
  void watch(const DdsGuid& guid, Writer& writer);
  /// Of a command writer on a topic that nobody listens to, or of another type than is listened to: an event
  /// says so.
  std::optional<DiagnosticEvent> diagnose_unmatched_writer(const DdsGuid& guid, Writer& writer,
                                                           const CellDescription& cell) const;

  LivelinessTracker* heard_ = nullptr;  // guarded by mutex_
  DdsGuid own_;                         // guarded by mutex_
  RunLoop* loop_ = nullptr;             ///< while open; changed with mutex_ held and no reader there
  Participant* participant_ = nullptr;
  EventQueue& events_;
  SenderRegistry& senders_;
  TopicNames topics_;
  std::mutex readers_mutex_;        ///< never taken with mutex_ held
  std::vector<Listening> readers_;  // guarded by readers_mutex_
  std::atomic<std::uint64_t> rejected_{0};
  std::mutex mutex_;
  std::vector<CommandArbiter> arbiters_;  // guarded by mutex_; per target
  std::map<DdsGuid, Writer> writers_;     // guarded by mutex_; command writers discovered
  std::map<int, DdsGuid> silent_owners_;  // guarded by mutex_; by target that exclusive readers keep for them
  std::set<DdsGuid> gone_;                ///< unmatched: what is still under way from them does not count
};

}  // namespace takt

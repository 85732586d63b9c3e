#pragma once
// The one thread that writes samples: instants of the loaded scenario, if there is one, events, status and
// replies. The step loop never waits for it, but in lockstep, where no instant may be skipped.
//
// Its writers of description, status and events live as long as the server, and events are numbered through;
// those of the scenario's own topics (cell_publisher.h) come and go with it.
#include <atomic>
#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include "idl/common/histogram.h"
#include "server/dds/cell_publisher.h"
#include "server/dds/command_subscriber.h"
#include "server/dds/control_service.h"
#include "server/dds/guard_watch.h"
#include "server/dds/participant.h"
#include "server/dds/ros_services.h"
#include "server/dds/sender_registry.h"
#include "server/dds/topic_names.h"
#include "server/runtime/host/cell_host.h"
#include "takt_msgs.h"

namespace takt {

class StatePublisher {
 public:
  /// Makes the writers. All must outlive this. Throws DdsError.
  StatePublisher(CellHost& host, Participant& participant, const TopicNames& topics,
                 const SenderRegistry& senders, CommandSubscriber& commands, ControlService& control,
                 RosServices& services);
  ~StatePublisher();
  StatePublisher(const StatePublisher&) = delete;
  StatePublisher& operator=(const StatePublisher&) = delete;

  /// From now on shows this loop's cell: writes its description, then what it publishes. Throws DdsError;
  /// then it shows nothing.
  void open(RunLoop& loop);
  /// Writes what the loop, which has ended, has left, and forgets it.
  void close();
  /// Writes the description of a cell without a scenario.
  void describe(const CellDescription& cell);

  void start();
  /// Writes what is left, then ends the thread. Stop the loop first.
  void stop();

  /// Wall time of writing one instant (state, joint states, clock). Read it after stop().
  const DurationHistogram& write_time() const { return write_time_; }

 private:
  void run();
  // With mutex_ held:
  void write_news(bool with_status);
  void write_events();
  void write_event(takt_msgs::msg::Event& event);
  void write_event(const DiagnosticEvent& event);
  void write_announcement();
  void write_status(const LoopStatus& status, const CellDescription& cell);
  void write_idle_status();
  /// Counts a refusal of DDS; the next status says so.
  void check(const DdsReturnCode& result);

  CellHost& host_;
  Participant& participant_;
  const TopicNames topics_;
  const PacketGuard* guard_;
  GuardWatch guard_watch_;
  const SenderRegistry& senders_;
  CommandSubscriber& commands_;
  ControlService& control_;
  RosServices& services_;

  dds::DataWriter* description_writer_ = nullptr;
  dds::DataWriter* event_writer_ = nullptr;
  dds::DataWriter* status_writer_ = nullptr;

  std::thread thread_;
  std::atomic<bool> stop_{false};
  std::int64_t owners_seen_ns_ = 0;  ///< of the publishing thread

  /// The publishing thread holds it while it writes, the host's while it exchanges the scenario. DDS entities
  /// are made and removed without it.
  std::mutex mutex_;
  std::unique_ptr<CellPublisher> publisher_;  // guarded by mutex_, as all below
  CellDescription nothing_;                   ///< described while there is no scenario
  std::int64_t idle_status_ns_ = 0;           ///< when the last one without a scenario was written
  SimulationState idle_state_{};              ///< and what it said
  std::uint64_t event_number_ = 0;
  int announced_to_ = 0;  ///< readers of events that were there at the last announcement, or before
  std::uint64_t refused_writes_ = 0;
  DurationHistogram write_time_;
};

}  // namespace takt

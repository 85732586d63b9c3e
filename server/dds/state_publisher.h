#pragma once
// Writes samples: instants of the loaded scenario, if any, events, status and replies.
//
// Its writers of description, status and events live as long as the server, and the numbers of events are
// consecutive; those of the scenario's own topics (cell_publisher.h) exist only while it is loaded.
#include <cstdint>
#include <memory>
#include <mutex>
#include <string>

#include "idl/common/histogram.h"
#include "server/dds/action_servers.h"
#include "server/dds/cell_publisher.h"
#include "server/dds/command_subscriber.h"
#include "server/dds/control_service.h"
#include "server/dds/participant.h"
#include "server/dds/ros_services.h"
#include "server/dds/sender_registry.h"
#include "server/dds/topic_names.h"
#include "server/runtime/host/cell_host.h"
#include "takt_msgs.h"

namespace takt {

class StatePublisher final : public InstantWriter {
 public:
  /// Makes the writers. All arguments must outlive this. Throws DdsError.
  StatePublisher(CellHost& host, Participant& participant, const TopicNames& topics,
                 const SenderRegistry& senders, const CommandSubscriber& commands, ControlService& control,
                 RosServices& services, ActionServers& actions);
  StatePublisher(const StatePublisher&) = delete;
  StatePublisher& operator=(const StatePublisher&) = delete;

  /// Publishes this loop's cell from here on: writes its description, then its output. Throws DdsError; then
  /// no cell is published.
  void open(RunLoop& loop);
  /// Writes the remaining output of the loop, which has ended, and releases it.
  void close();
  /// Writes the description of a cell without a scenario.
  void describe(const CellDescription& cell);

  // The I/O thread:

  /// Writes new output, and repeats the newest instant of a standing simulation.
  void write();
  /// The longest time until write() has something to do without news.
  std::int64_t longest_sleep_ns();
  /// Writes the remaining output. The loop has ended.
  void finish();

  /// The loop's thread, in lockstep: writes the newest instant, after the events ahead of it.
  void write_instant() override;

  /// Wall time of writing one instant (state, joint states, clock). Read it when the I/O thread has ended.
  const DurationHistogram& write_time() const { return write_time_; }

 private:
  /// The loop, if any, does not write its instants itself from here on.
  void detach();

  // With mutex_ held:
  void write_news(bool with_status);
  void write_newest();
  void write_events();
  void write_event(takt_msgs::msg::Event& event);
  void write_event(const DiagnosticEvent& event);
  void write_announcement();
  void write_status(const LoopStatus& status, const CellDescription& cell);
  void write_idle_status();
  /// Counts a refusal of DDS; the next status reports it.
  void check(const DdsReturnCode& result);

  CellHost& host_;
  Participant& participant_;
  const TopicNames topics_;
  const SenderRegistry& senders_;
  const CommandSubscriber& commands_;
  ControlService& control_;
  RosServices& services_;
  ActionServers& actions_;

  ReaderCount event_readers_;
  dds::DataWriter* description_writer_ = nullptr;
  dds::DataWriter* event_writer_ = nullptr;
  dds::DataWriter* status_writer_ = nullptr;

  /// The I/O thread holds it during writing, in lockstep the loop's thread too, and the host's thread during an exchange
  /// of the scenario. DDS entities are made and removed without it.
  std::mutex mutex_;
  std::unique_ptr<CellPublisher> publisher_;  // guarded by mutex_, as all below
  CellDescription empty_cell_;                ///< described while there is no scenario
  std::int64_t idle_status_ns_ = 0;           ///< when the last one without a scenario was written
  SimulationState idle_state_{};              ///< and its content
  std::uint64_t event_number_ = 0;
  int announced_to_ = 0;  ///< readers of events at the last announcement
  std::uint64_t refused_writes_ = 0;
  DurationHistogram write_time_;
};

}  // namespace takt

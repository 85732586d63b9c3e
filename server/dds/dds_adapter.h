#pragma once
// The service's DDS interface: one participant that receives commands and sends samples of the CellHost's
// loaded scenario.
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "server/dds/action_servers.h"
#include "server/dds/command_subscriber.h"
#include "server/dds/control_service.h"
#include "server/dds/dds_io_thread.h"
#include "server/dds/participant.h"
#include "server/dds/ros_services.h"
#include "server/dds/sample_receiver.h"
#include "server/dds/sender_registry.h"
#include "server/dds/stale_shm_reaper.h"
#include "server/dds/state_publisher.h"
#include "server/dds/topic_names.h"
#include "server/runtime/host/cell_host.h"

namespace takt {

class DdsAdapter final : public DiscoveryListener, public CellLifecycleListener {
 public:
  /// Make it ahead of the host's open(), so that the first instant is sent. The host must outlive it.
  /// `namespaced_clock_and_tf`: see TopicNames. Throws DdsError, also if the cell's name cannot be part of a
  /// topic.
  DdsAdapter(CellHost& host, ParticipantOptions options, bool namespaced_clock_and_tf = false);
  ~DdsAdapter() override;

  /// Sends the remaining samples, then leaves the domain. Stop the host first.
  void stop();

  const StatePublisher& publisher() const { return *publisher_; }
  /// Counts of the guard in front of the transports; nullptr without one or after stop().
  const PacketGuard* guard() const { return participant_ ? participant_->guard() : nullptr; }

  /// Throws DdsError when a robot's or gripper's name cannot be part of a topic, or the description does not
  /// fit its type.
  void check(const CellDescription& cell) override;
  void opened(RunLoop& loop) override;
  void closed(RunLoop& loop) override;
  void idle(const CellDescription& cell) override;

 private:
  void on_writer(const DiscoveredWriter& writer) override;
  void on_participant(const DdsGuid& participant, const std::string& name) override {
    senders_.name(participant, name);
  }
  /// The loop receives its input while it waits; nullptr: none does any more.
  void receive_in(RunLoop* loop);
  bool is_own(const DdsGuid& writer);
  /// As an event, and on the terminal.
  template <typename Type>
  void report(const Type& event, const DdsGuid& writer);
  void report_shared_clock(const DdsGuid& writer);

  CellHost& host_;
  const TopicNames topics_;
  std::mutex own_mutex_;
  /// Guarded by own_mutex_; std::nullopt during the construction of the participant.
  std::optional<DdsGuid> own_;
  std::vector<DdsGuid> other_clocks_;  ///< guarded by own_mutex_; reported, one per participant, newest last
  SenderRegistry senders_;
  CommandSubscriber commands_;
  ControlService control_;
  RosServices services_;
  ActionServers actions_;
  std::unique_ptr<Participant> participant_;
  std::optional<SampleReceiver> receiver_;
  RunLoop* loop_ = nullptr;  ///< that receives with it
  std::unique_ptr<StatePublisher> publisher_;
  std::optional<DdsIoThread> io_;
  StaleShmReaper remains_;
};

}  // namespace takt

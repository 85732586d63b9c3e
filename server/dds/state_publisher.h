#pragma once
// The one thread that writes samples: instants, events, status and replies, from the outbox of the step loop
// and from the adapter's own events. The step loop never waits for it, but in lockstep, where no instant may
// be skipped.
#include <atomic>
#include <cstdint>
#include <string>
#include <thread>
#include <vector>

#include "server/dds/adapter_events.h"
#include "server/dds/command_subscriber.h"
#include "server/dds/control_service.h"
#include "server/dds/guard_watch.h"
#include "server/dds/participant.h"
#include "server/dds/senders.h"
#include "server/dds/topic_names.h"
#include "server/runtime/histogram.h"
#include "server/runtime/run_loop.h"
#include "takt_msgs.h"

namespace takt {

class StatePublisher {
 public:
  /// Makes the writers and writes the description. Throws DdsError.
  StatePublisher(RunLoop& loop, Participant& participant, const TopicNames& topics, AdapterEvents& events,
                 const Senders& senders, const CommandSubscriber& commands, ControlService& control);
  ~StatePublisher();
  StatePublisher(const StatePublisher&) = delete;
  StatePublisher& operator=(const StatePublisher&) = delete;

  void start();
  /// Writes what is left, then ends the thread. Stop the loop first.
  void stop();

  /// Wall time of writing one instant (state, joint states, clock). Read it after stop().
  const DurationHistogram& write_time() const { return write_time_; }

 private:
  void run();
  void write_news();
  void write_instant(const PublishedSnapshot& published);
  void write_events();
  void write_event(takt_msgs::msg::Event& event);
  void repeat_instant_if_due();
  /// Counts a refusal of DDS; the next status says so.
  void check(const DdsReturnCode& result);

  RunLoop& loop_;
  const PacketGuard* guard_;
  GuardWatch guard_watch_;
  AdapterEvents& events_;
  const Senders& senders_;
  const CommandSubscriber& commands_;
  ControlService& control_;

  dds::DataWriter* state_writer_ = nullptr;
  dds::DataWriter* power_writer_ = nullptr;
  dds::DataWriter* contacts_writer_ = nullptr;
  dds::DataWriter* event_writer_ = nullptr;
  dds::DataWriter* status_writer_ = nullptr;
  dds::DataWriter* clock_writer_ = nullptr;
  std::vector<dds::DataWriter*> joint_writers_;

  std::thread thread_;
  std::atomic<bool> stop_{false};

  // Publishing thread only.
  takt_msgs::msg::CellState state_message_;
  takt_msgs::msg::Power power_message_;
  bool power_known_ = false;  ///< some robot has or had dynamics: power is sent with every state
  takt_msgs::msg::Contacts contacts_message_;
  bool contacts_known_ = false;  ///< some process is or was at level 3: contacts are sent with every state
  std::vector<sensor_msgs::msg::JointState> joint_messages_;
  rosgraph_msgs::msg::Clock clock_message_;
  std::uint64_t event_number_ = 0;
  std::uint64_t refused_writes_ = 0;
  double present_time_s_ = 0.0;  ///< of the newest instant written: stamp of the adapter's own events
  std::uint64_t present_step_ = 0;
  std::uint32_t present_epoch_ = 0;
  bool instant_written_ = false;
  std::int64_t instant_written_ns_ = 0;  ///< the newest instant, first or repeated
  std::int64_t instant_new_ns_ = 0;      ///< the newest instant, when it was new
  DurationHistogram write_time_;
};

}  // namespace takt

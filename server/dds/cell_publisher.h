#pragma once
// The writers of one loaded scenario and their samples: its instants, as state, power, contacts, joint states
// and clock, and the URDF of its robots. Made for each loaded scenario.
#include <cstdint>
#include <deque>
#include <vector>

#include "server/dds/participant.h"
#include "server/dds/reader_count.h"
#include "server/dds/topic_names.h"
#include "server/messages/instant_messages.h"
#include "server/runtime/loop/run_loop.h"
#include "takt_msgs.h"

namespace takt {

class CellPublisher {
 public:
  /// Makes the writers and writes the URDFs. Both arguments must outlive this. Throws DdsError.
  CellPublisher(RunLoop& loop, Participant& participant, const TopicNames& topics);
  /// Removes the writers.
  ~CellPublisher();
  CellPublisher(const CellPublisher&) = delete;
  CellPublisher& operator=(const CellPublisher&) = delete;

  RunLoop& loop() { return loop_; }
  const CellDescription& cell() const { return loop_.cell(); }

  void write(const Snapshot& snapshot);
  /// While the simulation stands, its newest instant is repeated: the state is sent best effort, and a client
  /// that lost it or connects later would get no sample. Skipped frames are sent when they are due.
  void repeat_if_due();
  /// After the newest instant: sends its frames if they were skipped.
  void finish();

  /// Number of samples that DDS refused after the last call.
  std::uint64_t take_refused();

  /// The newest instant written; nullptr ahead of the first.
  const Snapshot* newest() const { return newest_; }
  // Of the newest instant written.
  double present_time_s() const { return present_time_s_; }
  std::uint64_t present_step() const { return present_step_; }
  std::uint32_t present_epoch() const { return present_epoch_; }

 private:
  /// Of a topic of instants, whose readers are counted.
  struct Output {
    dds::DataWriter* writer = nullptr;
    const ReaderCount* readers = nullptr;
    bool is_read() const { return readers != nullptr && readers->any(); }
  };

  void make_writers(const TopicNames& names);
  void remove_writers();
  void write_instant();
  void write_robots_and_clock();
  void write_static_frames();
  void write_frames(std::int64_t now_ns);
  void write_pressures();
  void check(const DdsReturnCode& result) { refused_ += is_ok(result) ? 0U : 1U; }

  RunLoop& loop_;
  Participant& participant_;

  std::deque<ReaderCount> counts_;  ///< one for each output
  Output pressures_;                ///< where there are pairs in surface contact
  Output clock_, tf_;
  std::vector<Output> instants_, joints_;
  dds::DataWriter* tf_static_writer_ = nullptr;
  std::vector<dds::DataWriter*> urdf_writers_;
  std::uint64_t arrivals_ = 0;  ///< of readers, up to the newest repetition

  InstantMessages instant_;
  takt_msgs::msg::ContactPressures pressures_message_;
  const Snapshot* newest_ = nullptr;  ///< the output's, which it keeps until the next one is taken
  std::vector<sensor_msgs::msg::JointState> joint_messages_;
  struct SensorOutput {
    std::size_t device;
    Output output;
    geometry_msgs::msg::WrenchStamped message;
  };
  std::vector<SensorOutput> wrenches_;  ///< of force-torque sensors
  rosgraph_msgs::msg::Clock clock_message_;
  MovingFramesMessage frames_;
  std::int64_t frames_written_ns_ = 0;
  bool frames_skipped_ = false;  ///< the frames of the newest instant have not been sent
  bool static_frames_written_ = false;
  std::uint64_t refused_ = 0;
  double present_time_s_ = 0.0;
  std::uint64_t present_step_ = 0;
  std::uint32_t present_epoch_ = 0;
  bool instant_written_ = false;
  std::int64_t instant_written_ns_ = 0;  ///< the newest instant, first or repeated
  std::int64_t instant_new_ns_ = 0;      ///< time of the newest instant's first publication
  std::int64_t ros_written_ns_ = 0;      ///< joint states and clock, first or repeated
};

}  // namespace takt

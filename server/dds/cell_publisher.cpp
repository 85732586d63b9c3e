#include "server/dds/cell_publisher.h"

#include <utility>

#include "idl/common/stamp.h"
#include "idl/common/utf8.h"
#include "server/runtime/monotonic_clock.h"
#include "takt_topics.h"

namespace takt {
namespace {

// Often at first, for the controller that lockstep waits for.
constexpr std::int64_t kRepeat_ns = 20'000'000;
constexpr std::int64_t kRepeatLater_ns = 100'000'000;
constexpr std::int64_t kFrames_ns = 20'000'000;
constexpr std::int64_t kLater_ns = 2'000'000'000;

}  // namespace

CellPublisher::CellPublisher(RunLoop& loop, Participant& participant, const TopicNames& topics)
    : loop_(loop),
      participant_(participant),
      instant_(loop.cell(), loop.output().contact_capacity),
      frames_(loop.cell()) {
  try {
    make_writers(topics);
  } catch (...) {
    remove_writers();
    throw;
  }
}

CellPublisher::~CellPublisher() {
  remove_writers();
}

void CellPublisher::make_writers(const TopicNames& names) {
  const auto output = [&](const auto& topic, std::string_view element = {}) {
    ReaderCount& readers = counts_.emplace_back([shared = loop_.output().outbound](int change) {
      shared->instant_readers.change(change);
      shared->news.post();
    });
    return Output{participant_.create_writer(topic, names.of(topic, element), &readers), &readers};
  };
  instant_.for_each([&](const auto& topic, const auto&, bool) { instants_.push_back(output(topic)); });
  if (loop_.output().contact_capacity > 0) pressures_ = output(topics::contact_pressures);
  clock_ = output(topics::clock);
  tf_ = output(topics::tf);
  tf_static_writer_ = participant_.create_writer(topics::tf_static, names.of(topics::tf_static));
  for (std::size_t device = 0; device < cell().devices.size(); ++device) {
    if (!has_wrench(cell().devices[device])) continue;
    wrenches_.push_back({device, output(topics::wrench, cell().devices[device].name), {}});
  }
  for (const RobotDescription& robot : cell().robots) {
    joints_.push_back(output(topics::joint_states, robot.name));
    joint_messages_.push_back(make_joint_states_message(robot));
    urdf_writers_.push_back(participant_.create_writer(topics::robot_description,
                                                       names.of(topics::robot_description, robot.name)));
    std_msgs::msg::String urdf;
    urdf.data = utf8_sanitize(robot.urdf, robot.urdf.size(), LineBreaks::allow);
    if (!written(*urdf_writers_.back(), urdf))
      throw DdsError("DDS refused to send the URDF of '" + robot.name + "'.");
  }
}

void CellPublisher::remove_writers() {
  for (ReaderCount& readers : counts_) readers.retire();
  for (dds::DataWriter* writer : {pressures_.writer, clock_.writer, tf_.writer, tf_static_writer_})
    participant_.remove(writer);
  for (const Output& output : instants_) participant_.remove(output.writer);
  for (const Output& output : joints_) participant_.remove(output.writer);
  for (const SensorOutput& sensor : wrenches_) participant_.remove(sensor.output.writer);
  for (dds::DataWriter* writer : urdf_writers_) participant_.remove(writer);
}

void CellPublisher::write(const Snapshot& snapshot) {
  newest_ = &snapshot;
  write_instant();
  write_robots_and_clock();
  write_static_frames();
  frames_skipped_ = true;
  write_frames(monotonic_now_ns());
  write_pressures();
  present_time_s_ = snapshot.time_s;
  present_step_ = snapshot.step;
  present_epoch_ = snapshot.epoch;
  instant_written_ = true;
  instant_new_ns_ = instant_written_ns_ = ros_written_ns_ = monotonic_now_ns();
}

void CellPublisher::write_instant() {
  instant_.fill_some(
      *newest_, [&](std::size_t place) { return instants_[place].is_read(); },
      [&](std::size_t place, auto& message) {
        check(instants_[place].writer->write(&message, dds::HANDLE_NIL));
      });
}

void CellPublisher::write_robots_and_clock() {
  for (std::size_t robot = 0; robot < joints_.size(); ++robot) {
    if (!joints_[robot].is_read()) continue;
    fill(joint_messages_[robot], *newest_, robot);
    check(joints_[robot].writer->write(&joint_messages_[robot], dds::HANDLE_NIL));
  }
  for (SensorOutput& sensor : wrenches_) {
    if (!sensor.output.is_read()) continue;
    fill(sensor.message, cell(), *newest_, sensor.device);
    check(sensor.output.writer->write(&sensor.message, dds::HANDLE_NIL));
  }
  if (!clock_.is_read()) return;
  clock_message_.clock = to_time(newest_->time_s);
  check(clock_.writer->write(&clock_message_, dds::HANDLE_NIL));
}

void CellPublisher::write_static_frames() {
  if (static_frames_written_) return;
  tf2_msgs::msg::TFMessage message = to_message(static_frames(cell(), *newest_), newest_->time_s);
  static_frames_written_ = true;
  check(tf_static_writer_->write(&message, dds::HANDLE_NIL));
}

/// Clients poll between frames: more frames than their history keeps would only replace older ones. A skipped
/// frame is sent later, unless a newer instant arrives in the meantime.
void CellPublisher::write_frames(std::int64_t now_ns) {
  if (now_ns - frames_written_ns_ < kFrames_ns || !tf_.is_read()) return;
  frames_written_ns_ = now_ns;
  frames_skipped_ = false;
  check(tf_.writer->write(&frames_.fill(*newest_), dds::HANDLE_NIL));
}

/// Of the subscribed pairs, while a reader exists.
void CellPublisher::write_pressures() {
  if (!pressures_.is_read()) return;
  PressureSubscriptions& watch = loop_.output().pressures;
  const std::int64_t now = monotonic_now_ns();
  if (!watch.due(now) || !watch.watches(now)) return;
  fill(pressures_message_, cell(), *newest_, watch.look(*newest_, &monotonic_now_ns));
  check(pressures_.writer->write(&pressures_message_, dds::HANDLE_NIL));
}

void CellPublisher::repeat_if_due() {
  if (!instant_written_) return;
  const std::int64_t now = monotonic_now_ns();
  if (frames_skipped_) write_frames(now);
  if (!loop_.output().standing_at_boundary.load(std::memory_order_relaxed)) return;
  // The first samples may be earlier than the reader's own knowledge of the writer.
  const std::uint64_t arrivals = loop_.output().readers.arrivals();
  if (arrivals != std::exchange(arrivals_, arrivals)) instant_new_ns_ = now;
  if (now - ros_written_ns_ >= kRepeatLater_ns) {
    ros_written_ns_ = now;
    write_robots_and_clock();
    write_frames(now);
  }
  const std::int64_t interval = now - instant_new_ns_ < kLater_ns ? kRepeat_ns : kRepeatLater_ns;
  if (now - instant_written_ns_ < interval) return;
  write_pressures();
  write_instant();
  instant_written_ns_ = now;
}

void CellPublisher::finish() {
  if (!frames_skipped_) return;
  frames_written_ns_ = 0;
  write_frames(monotonic_now_ns());
}

std::uint64_t CellPublisher::take_refused() {
  return std::exchange(refused_, 0);
}

}  // namespace takt

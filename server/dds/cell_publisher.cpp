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

bool somebody_reads(dds::DataWriter* writer) {
  dds::PublicationMatchedStatus status;
  return is_ok(writer->get_publication_matched_status(status)) && status.current_count > 0;
}

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
  const auto writer = [&](const auto& topic, std::size_t sample_bytes = 0, std::string_view element = {}) {
    return participant_.create_writer(topic, names.of(topic, element), sample_bytes);
  };
  instant_.for_each([&](const auto& topic, const auto& message, bool) {
    instant_writers_.push_back(writer(topic, cdr::size(message)));
  });
  if (loop_.output().contact_capacity > 0)
    pressures_writer_ = writer(topics::contact_pressures, kLargestUnfragmented_bytes + 1);
  clock_writer_ = writer(topics::clock);
  tf_writer_ = writer(topics::tf);
  tf_static_writer_ = writer(topics::tf_static);
  for (const RobotDescription& robot : cell().robots) {
    joint_writers_.push_back(writer(topics::joint_states, 0, robot.name));
    joint_messages_.push_back(make_joint_states_message(robot));
    urdf_writers_.push_back(writer(topics::robot_description, 0, robot.name));
    std_msgs::msg::String urdf;
    urdf.data = utf8_sanitize(robot.urdf, robot.urdf.size(), LineBreaks::allow);
    if (!written(*urdf_writers_.back(), urdf))
      throw DdsError("DDS refused to send the URDF of '" + robot.name + "'.");
  }
}

void CellPublisher::remove_writers() {
  for (dds::DataWriter* writer : {pressures_writer_, clock_writer_, tf_writer_, tf_static_writer_})
    participant_.remove(writer);
  for (dds::DataWriter* writer : instant_writers_) participant_.remove(writer);
  for (dds::DataWriter* writer : joint_writers_) participant_.remove(writer);
  for (dds::DataWriter* writer : urdf_writers_) participant_.remove(writer);
}

void CellPublisher::write(const Snapshot& snapshot) {
  instant_.fill(snapshot);
  write_instant();
  newest_ = &snapshot;
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
  auto writer = instant_writers_.begin();
  instant_.for_each([&](const auto&, auto& message, bool sent) {
    if (sent && somebody_reads(*writer)) check((*writer)->write(&message, dds::HANDLE_NIL));
    ++writer;
  });
}

void CellPublisher::write_robots_and_clock() {
  for (std::size_t robot = 0; robot < joint_writers_.size(); ++robot) {
    if (!somebody_reads(joint_writers_[robot])) continue;
    fill(joint_messages_[robot], *newest_, robot);
    check(joint_writers_[robot]->write(&joint_messages_[robot], dds::HANDLE_NIL));
  }
  if (!somebody_reads(clock_writer_)) return;
  clock_message_.clock = to_time(newest_->time_s);
  check(clock_writer_->write(&clock_message_, dds::HANDLE_NIL));
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
  if (now_ns - frames_written_ns_ < kFrames_ns || !somebody_reads(tf_writer_)) return;
  frames_written_ns_ = now_ns;
  frames_skipped_ = false;
  check(tf_writer_->write(&frames_.fill(*newest_), dds::HANDLE_NIL));
}

/// Of the subscribed pairs, while a reader exists.
void CellPublisher::write_pressures() {
  if (pressures_writer_ == nullptr) return;
  PressureSubscriptions& watch = loop_.output().pressures;
  const std::int64_t now = monotonic_now_ns();
  if (!watch.due(now) || !watch.watches(now) || !somebody_reads(pressures_writer_)) return;
  fill(pressures_message_, cell(), *newest_, watch.look(*newest_, &monotonic_now_ns));
  check(pressures_writer_->write(&pressures_message_, dds::HANDLE_NIL));
}

void CellPublisher::repeat_if_due() {
  if (!instant_written_) return;
  const std::int64_t now = monotonic_now_ns();
  if (frames_skipped_) write_frames(now);
  if (!loop_.output().standing_at_boundary.load(std::memory_order_relaxed)) return;
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

#include "server/dds/tf_frames.h"

#include "server/dds/convert.h"

namespace takt {
namespace {

void place(geometry_msgs::msg::TransformStamped& message, const CellFrame& frame,
           const builtin_interfaces::msg::Time& stamp) {
  message.header().stamp(stamp);
  auto& transform = message.transform();
  transform.translation().x(frame.p.x());
  transform.translation().y(frame.p.y());
  transform.translation().z(frame.p.z());
  transform.rotation().x(frame.q.x());
  transform.rotation().y(frame.q.y());
  transform.rotation().z(frame.q.z());
  transform.rotation().w(frame.q.w());
}

}  // namespace

tf2_msgs::msg::TFMessage to_message(const std::vector<CellFrame>& frames, double time_s) {
  tf2_msgs::msg::TFMessage message;
  for (const CellFrame& frame : frames) {
    auto& transform = message.transforms().emplace_back();
    transform.header().frame_id(frame.parent);
    transform.child_frame_id(frame.name);
    place(transform, frame, to_time(time_s));
  }
  return message;
}

MovingFramesMessage::MovingFramesMessage(const CellDescription& cell)
    : frames_(cell), message_(to_message(frames_.frames(), 0.0)) {}

tf2_msgs::msg::TFMessage& MovingFramesMessage::fill(const Snapshot& snapshot) {
  const std::vector<CellFrame>& frames = frames_.fill(snapshot);
  const builtin_interfaces::msg::Time stamp = to_time(snapshot.time_s);
  for (std::size_t i = 0; i < frames.size(); ++i) place(message_.transforms()[i], frames[i], stamp);
  return message_;
}

}  // namespace takt

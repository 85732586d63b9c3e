#pragma once
// Names of the topics of a cell: ROS 2 names (/cell/state) as DDS topics (rt/cell/state).
#include <string>
#include <string_view>

namespace takt {

class TopicNames {
 public:
  /// ROS 2 tools expect one source of time and one tree of frames on a domain, /clock and /tf; of several
  /// cells on one domain all but one have `namespaced_clock_and_tf`, theirs are /<cell>/clock and so on.
  explicit TopicNames(const std::string& cell, bool namespaced_clock_and_tf = false)
      : prefix_("rt/" + cell + "/"), ros_prefix_(namespaced_clock_and_tf ? prefix_ : "rt/") {}

  std::string of_cell(std::string_view topic) const { return prefix_ + std::string(topic); }
  std::string of(std::string_view robot_or_gripper, std::string_view topic) const {
    return prefix_ + std::string(robot_or_gripper) + "/" + std::string(topic);
  }
  std::string clock() const { return ros_prefix_ + "clock"; }
  std::string tf() const { return ros_prefix_ + "tf"; }
  std::string tf_static() const { return ros_prefix_ + "tf_static"; }
  bool clock_is_own() const { return ros_prefix_ == prefix_; }

  /// The robot, gripper or device in a topic name of the form rt/<cell>/<name>/<last>; empty when it has
  /// another form.
  std::string name_in(std::string_view topic, std::string_view last) const {
    if (!topic.starts_with(prefix_)) return {};
    topic.remove_prefix(prefix_.size());
    if (topic.size() <= last.size() + 1 || !topic.ends_with(last)) return {};
    topic.remove_suffix(last.size());
    if (topic.back() != '/') return {};
    topic.remove_suffix(1);
    return topic.find('/') == std::string_view::npos ? std::string(topic) : std::string();
  }

 private:
  std::string prefix_, ros_prefix_;
};

inline constexpr std::string_view kJointCommands = "joint_commands";
inline constexpr std::string_view kJointTrajectory = "joint_trajectory";
inline constexpr std::string_view kCommand = "command";  ///< of grippers and devices

/// Whether `name` can be a level of a ROS 2 topic: letters, digits and underscores, no digit first.
inline bool is_topic_level(std::string_view name) {
  if (name.empty() || (name.front() >= '0' && name.front() <= '9')) return false;
  for (const char c : name) {
    const bool fits = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_';
    if (!fits) return false;
  }
  return true;
}

}  // namespace takt

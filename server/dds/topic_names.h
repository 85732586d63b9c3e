#pragma once
// Names of the topics of a cell: ROS 2 names (/cell/state) as DDS topics (rt/cell/state).
#include <string>
#include <string_view>
#include <utility>

#include "idl/common/topic.h"

namespace takt {

class TopicNames {
 public:
  /// ROS 2 tools expect one source of time and one tree of frames on a domain, /clock and /tf; of several
  /// cells on one domain all but one have `namespaced_clock_and_tf`, theirs are /<cell>/clock and so on.
  explicit TopicNames(std::string cell, bool namespaced_clock_and_tf = false)
      : cell_(std::move(cell)), namespaced_(namespaced_clock_and_tf) {}

  /// `element`: the robot, gripper or device.
  std::string of(const TopicInfo& topic, std::string_view element = {}) const {
    const bool own = namespaced_ && !topic.pattern.starts_with("{cell}");
    return "rt/" + (own ? cell_ + "/" : "") + topic.name(cell_, element);
  }
  bool clock_is_own() const { return namespaced_; }

  /// The robot, gripper or device in the name of such a topic; empty when the name has another form.
  std::string element_in(std::string_view name, const TopicInfo& topic) const {
    const std::string prefix = "rt/" + cell_ + "/", suffix = "/" + std::string(topic.last_level());
    if (name.size() <= prefix.size() + suffix.size() || !name.starts_with(prefix) || !name.ends_with(suffix))
      return {};
    name = name.substr(prefix.size(), name.size() - prefix.size() - suffix.size());
    return name.find('/') == std::string_view::npos ? std::string(name) : std::string();
  }

 private:
  std::string cell_;
  bool namespaced_;
};

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

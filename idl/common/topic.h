#pragma once
// Topics as data: each @topic of idl/*.idl becomes a row of takt_topics.h with name, type, direction and QoS,
// used by writers and readers of both ends, recordings and documentation.
#include <cstdint>
#include <string>
#include <string_view>

#include "idl/common/message.h"

namespace takt {

enum class TopicWriter : std::uint8_t { server, client };

/// Kinds of QoS, named after the meaning of samples for their readers.
enum class TopicQos : std::uint8_t {
  instant,        ///< an instant of the cell: a reader that misses one gets the next
  ros,            ///< as ROS 2 nodes read by default
  event,          ///< each counts
  latched,        ///< a late joiner gets the newest at once
  latched_large,  ///< the same, of samples of megabytes
  command,        ///< the newest of the strongest sender counts
  commands,       ///< the same, decided by the server for each target in a sample
  control,        ///< requests and replies
};

/// QoS offered by writers and requested by readers. All keep the last `depth` samples: keeping all would let
/// one frozen reader block its writer.
struct QosPolicy {
  bool reliable = true;
  bool latched = false;  ///< transient local
  int depth = 1;
  bool large = false;      ///< megabytes, which a thread of DDS sends, so that the writing one goes on
  bool exclusive = false;  ///< ownership: of several writers the strongest is heard
  double lease_s = 0.0;    ///< a writer without a sign of life for so long is passed over; 0: never
  /// Wall time between heartbeats of a writer, while a sample is unacknowledged. 0: one with each sample too, so that
  /// each sample costs an acknowledgement.
  double heartbeat_period_s = 0.0;
};

struct TopicInfo {
  std::string_view id;       ///< as in takt::topics
  std::string_view pattern;  ///< "{cell}/{robot}/joint_states"
  const MessageInfo* type;
  TopicWriter writer;
  TopicQos qos;
  int ros_depth;  ///< of TopicQos::ros: samples that are kept for readers

  /// The level behind the last slash.
  constexpr std::string_view last_level() const { return pattern.substr(pattern.rfind('/') + 1); }
  /// Whether each robot, gripper or device has its own.
  constexpr bool of_element() const { return pattern.find('{', 1) != std::string_view::npos; }
  /// What of the cell has its own: "robot", "gripper", "device"; empty for a topic of the whole cell.
  constexpr std::string_view element_kind() const {
    const std::size_t open = pattern.find('{', 1);
    return open == std::string_view::npos ? std::string_view()
                                          : pattern.substr(open + 1, pattern.find('}', open) - open - 1);
  }
  /// Whether a client reads its samples: the server writes it, and it carries no replies.
  constexpr bool is_for_clients() const { return writer == TopicWriter::server && qos != TopicQos::control; }
  /// ROS 2 name without the leading slash; `element`: the robot, gripper or device.
  std::string name(std::string_view cell, std::string_view element = {}) const {
    std::string text;
    for (std::size_t at = 0; at < pattern.size();) {
      const std::size_t open = pattern.find('{', at);
      text += pattern.substr(at, open - at);
      if (open == std::string_view::npos) break;
      at = pattern.find('}', open) + 1;
      text += pattern.substr(open, at - open) == "{cell}" ? cell : element;
    }
    return text;
  }
};

constexpr QosPolicy qos_of(TopicQos kind, int ros_depth = 1) {
  switch (kind) {
    case TopicQos::instant:
      return {.reliable = false};
    case TopicQos::ros:
      return {.depth = ros_depth, .heartbeat_period_s = 0.01};
    case TopicQos::event:
      return {.depth = 1000};
    case TopicQos::latched:
      return {.latched = true};
    case TopicQos::latched_large:
      return {.latched = true, .large = true};
    case TopicQos::control:
      return {.depth = 100};
    case TopicQos::command:
      return {.exclusive = true, .lease_s = 1.0, .heartbeat_period_s = 0.01};
    case TopicQos::commands:
      return {.depth = 10, .lease_s = 1.0, .heartbeat_period_s = 0.01};
  }
  return {};
}
constexpr QosPolicy qos_of(const TopicInfo& topic) {
  return qos_of(topic.qos, topic.ros_depth);
}

template <typename Message>
struct Topic : TopicInfo {
  using Type = Message;
};

}  // namespace takt

#pragma once
// The QoS that the writer of a topic offers, in the form of ROS 2 recordings: metadata of the channel in an MCAP file
// of profile `ros2`. rosbag2 replays the recording with this QoS.
#include <optional>
#include <string>
#include <string_view>

#include "idl/common/topic.h"

namespace takt::recording {

struct OfferedQos {
  bool reliable = true;
  bool latched = false;  ///< late joiners get the newest sample (transient local)
  bool operator==(const OfferedQos&) const = default;
};

OfferedQos offered_qos(const TopicInfo& topic);
/// QoS of a topic (ROS 2 name) that takt-server writes. For other topics, which clients write: reliable and volatile.
OfferedQos qos_of_server(std::string_view topic);

/// Key of the channel's metadata, and its value: a list of one profile in YAML. Policies are numbers of rmw,
/// as every release of ROS 2 from Humble on reads them where the file has no metadata record of rosbag2;
/// words are read from Jazzy on, beside such a record only.
inline constexpr std::string_view kOfferedQosProfiles = "offered_qos_profiles";
std::string offered_qos_profiles(const OfferedQos& qos);
/// Reads that value, also from recordings of other programs: policies as numbers or as words, and any number of
/// profiles (one for each recorded writer). The result is the strongest of them, which is compatible with the readers
/// of all writers. Empty if the text has no profile or an invalid one.
std::optional<OfferedQos> read_offered_qos(const std::string& profiles);

}  // namespace takt::recording

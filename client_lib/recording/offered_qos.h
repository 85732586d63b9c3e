#pragma once
// What the writer of a topic offers, as recordings of ROS 2 say it: metadata of the channel in an MCAP file
// of profile `ros2`. rosbag2 publishes a recording with it again.
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
/// Of a topic (ROS 2 name) as takt-server writes it; of others, which clients write, reliable and volatile.
OfferedQos qos_of_server(std::string_view topic);

/// Key of the channel's metadata, and its value: a list of one profile in YAML. Policies are numbers of rmw,
/// as every release of ROS 2 from Humble on reads them where the file has no metadata record of rosbag2;
/// words are read from Jazzy on, beside such a record only.
inline constexpr std::string_view kOfferedQosProfiles = "offered_qos_profiles";
std::string offered_qos_profiles(const OfferedQos& qos);
/// The other way round, also of other programs' recordings: policies as numbers or as words, any number of
/// profiles (one for each writer that was recorded). Of several the strongest, which readers of all of them
/// accept. Nothing where the text has no profile or one that cannot be read.
std::optional<OfferedQos> read_offered_qos(const std::string& profiles);

}  // namespace takt::recording

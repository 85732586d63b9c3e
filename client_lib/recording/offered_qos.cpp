#include "client_lib/recording/offered_qos.h"

#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <array>

#include "takt_topics.h"

namespace takt::recording {
namespace {

constexpr std::size_t kLongestProfiles_bytes = 1U << 16U;  ///< some hundred profiles

/// One policy of a profile: the first of `names` (what rmw counts from 1), the second, or another word that
/// rmw knows, which says nothing of the writer.
bool is_first(const YAML::Node& policy, const std::array<std::string_view, 2>& names) {
  const auto text = policy.as<std::string>();
  if (text == "1" || text == names[0]) return true;
  constexpr std::array<std::string_view, 8> others{"2", "0",       "3",       "4",
                                                   "5", "unknown", "default", "system_default"};
  if (text == names[1] || text == "best_available" ||
      std::find(others.begin(), others.end(), text) != others.end())
    return false;
  throw YAML::RepresentationException(policy.Mark(), "no policy of rmw: " + text);
}

}  // namespace

OfferedQos offered_qos(const TopicInfo& topic) {
  const QosPolicy policy = qos_of(topic);
  return {policy.reliable, policy.latched};
}

OfferedQos qos_of_server(std::string_view topic) {
  // The last level says it: /CELL/NAME, /CELL/ROBOT/NAME.
  const std::string_view last = topic.substr(topic.rfind('/') + 1);
  for (const TopicInfo* one : topics::kAll)
    if (one->writer == TopicWriter::server && one->last_level() == last) return offered_qos(*one);
  return {};
}

std::string offered_qos_profiles(const OfferedQos& qos) {
  const auto duration = [](std::string_view name) {  // without end, as rmw writes it
    return "  " + std::string(name) + ":\n    sec: 9223372036\n    nsec: 854775807\n";
  };
  // The wire does not carry history and depth: 3 is unknown.
  return "- history: 3\n  depth: 0\n  reliability: " + std::string(qos.reliable ? "1" : "2") +
         "\n  durability: " + (qos.latched ? "1" : "2") + "\n" + duration("deadline") + duration("lifespan") +
         "  liveliness: 1\n" + duration("liveliness_lease_duration") +
         "  avoid_ros_namespace_conventions: false";
}

std::optional<OfferedQos> read_offered_qos(const std::string& profiles) {
  if (profiles.size() > kLongestProfiles_bytes) return std::nullopt;
  try {
    const YAML::Node list = YAML::Load(profiles);
    if (!list.IsSequence() || list.size() == 0) return std::nullopt;
    OfferedQos strongest{false, false};
    for (const YAML::Node& profile : list) {
      strongest.reliable |= is_first(profile["reliability"], {"reliable", "best_effort"});
      strongest.latched |= is_first(profile["durability"], {"transient_local", "volatile"});
    }
    return strongest;
  } catch (const YAML::Exception&) {
    return std::nullopt;
  }
}

}  // namespace takt::recording

#include "client_lib/recording/offered_qos.h"

#include <algorithm>
#include <array>

namespace takt::recording {

OfferedQos qos_of_server(std::string_view topic) {
  // The last level says it: those of a cell are /CELL/NAME, those of a robot /CELL/ROBOT/NAME.
  const std::string_view last = topic.substr(topic.rfind('/') + 1);
  const auto is_one_of = [&](const auto& names) {
    return std::find(names.begin(), names.end(), last) != names.end();
  };
  constexpr std::array<std::string_view, 4> instants{"state", "power", "contacts", "contact_pressures"};
  constexpr std::array<std::string_view, 4> latched{"status", "description", "robot_description",
                                                    "tf_static"};
  return {!is_one_of(instants), is_one_of(latched)};
}

std::string offered_qos_profiles(const OfferedQos& qos) {
  const auto duration = [](std::string_view name) {  // without end, as rmw writes it
    return "  " + std::string(name) + ":\n    sec: 9223372036\n    nsec: 854775807\n";
  };
  // History and depth are not told on the wire: 3 is unknown.
  return "- history: 3\n  depth: 0\n  reliability: " + std::string(qos.reliable ? "1" : "2") +
         "\n  durability: " + (qos.latched ? "1" : "2") + "\n" + duration("deadline") + duration("lifespan") +
         "  liveliness: 1\n" + duration("liveliness_lease_duration") +
         "  avoid_ros_namespace_conventions: false";
}

}  // namespace takt::recording

#pragma once
// Control requests about single components, the entities of simulation_interfaces: who is there, where each
// is, and putting a Part elsewhere. Read here; executed between two steps by the loop.
#include <optional>
#include <string>
#include <variant>

#include "server/runtime/requests/control.h"
#include "server/runtime/requests/request_arguments.h"
#include "server/simulation/model/cell_description.h"
#include "server/simulation/model/snapshot.h"

namespace takt {

/// Nothing when the request is none of these.
std::optional<std::variant<ControlAction, ControlReply>> parse_entity_request(const ControlRequest& request,
                                                                              const CellDescription& cell);

/// `position` (3 numbers, m) and `orientation` (quaternion x y z w) of a pose in the world; nothing of what
/// was not given. A quaternion that is none is a failure.
struct GivenPose {
  std::optional<Vec3> p;
  std::optional<Mat3> R;
};
GivenPose read_pose(RequestArguments& arguments);

/// That there is no such component, with the names there are.
ControlReply no_component_reply(std::uint64_t id, const std::string& name, const CellDescription& cell);

/// Names and kinds as one JSON document in pieces (document_reply.h): [{name, category, hierarchy, mass},
/// ...].
ControlReply entities_reply(std::uint64_t id, const GetEntities& request, const CellDescription& cell);
/// Pose and twist of one component in the world, with state and partner.
ControlReply entity_state_reply(std::uint64_t id, int component, const Snapshot& snapshot,
                                const CellDescription& cell);

}  // namespace takt

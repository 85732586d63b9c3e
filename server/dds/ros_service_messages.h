#pragma once
// Conversion between the services of simulation_interfaces and the control vocabulary of takt: a request
// becomes a ControlRequest (or is refused at once), a ControlReply becomes the response.
#include <memory>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "ros2_service_msgs.h"
#include "server/runtime/requests/control.h"
#include "server/simulation/model/cell_description.h"
#include "server/simulation/model/snapshot.h"

namespace takt::ros {

namespace srv = simulation_interfaces::srv;

/// A request, and the part of it that the response needs.
struct Asked {
  ControlRequest request;
  std::string note;
};
using Question = std::variant<Asked, Refusal>;

Question ask(const srv::GetSimulatorFeatures_Request& request);
Question ask(const srv::GetSimulationState_Request& request);
Question ask(const srv::SetSimulationState_Request& request);
Question ask(const srv::StepSimulation_Request& request);
Question ask(const srv::ResetSimulation_Request& request);
Question ask(const srv::LoadWorld_Request& request);
Question ask(const srv::UnloadWorld_Request& request);
/// All sources are files of the server's machine, so that offline_only changes nothing.
Question ask(const srv::GetAvailableWorlds_Request& request);
Question ask(const srv::GetCurrentWorld_Request& request);
Question ask(const srv::GetNamedPoses_Request& request);
Question ask(const srv::GetNamedPoseBounds_Request& request);
/// A mesh file becomes a uri with a mass of 1 kg, which the caller may change.
Question ask(const srv::GetSpawnables_Request& request);
Question ask(const srv::GetEntities_Request& request);
Question ask(const srv::SetEntityInfo_Request& request);
Question ask(const srv::GetEntityState_Request& request);
Question ask(const srv::SetEntityState_Request& request);
/// The resource's uri is a mesh file, or copy_of:NAME for another one of the Part NAME; behind a question
/// mark the further arguments of spawn_entity: bolt.obj?mass=0.02&hierarchy=3.
Question ask(const srv::SpawnEntity_Request& request);
/// A request for each entity, or a refusal of the call.
std::variant<std::vector<Question>, Refusal> ask(const srv::SpawnEntities_Request& request);
Question ask(const srv::DeleteEntity_Request& request);
Question ask(const takt_msgs::srv::Control_Request& request);

/// The newest published instant; nullptr without a scenario.
struct Instant {
  const CellDescription* cell = nullptr;
  const Snapshot* snapshot = nullptr;
  std::shared_ptr<const EntityInfos> infos{};  ///< never null where something is answered
};
// Services that are no request of takt: answered from the newest instant. Bounds are a box in the entity's frame.
void answer(const Instant& now, const srv::GetEntitiesStates_Request& request,
            srv::GetEntitiesStates_Response& response);
void answer(const Instant& now, const srv::GetEntityInfo_Request& request,
            srv::GetEntityInfo_Response& response);
void answer(const Instant& now, const srv::GetEntityBounds_Request& request,
            srv::GetEntityBounds_Response& response);

simulation_interfaces::msg::Result result_of(const ControlReply& reply);

/// Responses that consist of the result alone.
template <typename Response>
void respond(const ControlReply& reply, const std::string&, Response& response) {
  response.result = result_of(reply);
}
void respond(const ControlReply& reply, const std::string& note,
             srv::GetSimulatorFeatures_Response& response);
void respond(const ControlReply& reply, const std::string& note, srv::GetSimulationState_Response& response);
void respond(const ControlReply& reply, const std::string& note, srv::LoadWorld_Response& response);
void respond(const ControlReply& reply, const std::string& note, srv::GetAvailableWorlds_Response& response);
void respond(const ControlReply& reply, const std::string& note, srv::GetCurrentWorld_Response& response);
void respond(const ControlReply& reply, const std::string& note, srv::GetNamedPoses_Response& response);
/// A pose without bounds is unbounded: bounds of the type EMPTY.
void respond(const ControlReply& reply, const std::string& note, srv::GetNamedPoseBounds_Response& response);
void respond(const ControlReply& reply, const std::string& note, srv::GetSpawnables_Response& response);
void respond(const ControlReply& reply, const std::string& note, srv::GetEntities_Response& response);
void respond(const ControlReply& reply, const std::string& note, srv::GetEntityState_Response& response);
void respond(const ControlReply& reply, const std::string& note, srv::SpawnEntity_Response& response);
/// `replies`: to each of its requests.
void respond(std::span<const ControlReply> replies, srv::SpawnEntities_Response& response);
void respond(const ControlReply& reply, const std::string& note, takt_msgs::srv::Control_Response& response);

}  // namespace takt::ros

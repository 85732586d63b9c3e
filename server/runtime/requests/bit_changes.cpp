#include "server/runtime/requests/bit_changes.h"

#include "server/simulation/step/simulation.h"

namespace takt {
namespace {

Vec3 vec3(const takt_msgs::msg::Vector3& v) {
  return {v.x, v.y, v.z};
}

}  // namespace

std::string apply(const requests::SetLevelOfDetail& request, Simulation& simulation) {
  return simulation.set_level_of_detail(simulation.description().find_process(request.process),
                                        request.level);
}

std::string apply(const requests::SetEntityState& request, Simulation& simulation) {
  if (!request.position && !request.orientation && !request.linear_velocity && !request.angular_velocity)
    return "a position, an orientation, a linear_velocity or an angular_velocity is needed.";
  const int part = simulation.description().find_component(request.entity);
  const ComponentSample now = simulation.make_snapshot().components[static_cast<std::size_t>(part)];
  Pose X_WB{now.q_WB.toRotationMatrix(), now.p_WB};
  Twist V_WB{now.V_WB};
  if (request.position) X_WB.p = vec3(*request.position);
  if (const auto& q = request.orientation)
    X_WB.R = Quat(q->w, q->x, q->y, q->z).normalized().toRotationMatrix();
  if (request.linear_velocity) V_WB.v = vec3(*request.linear_velocity);
  if (request.angular_velocity) V_WB.w = vec3(*request.angular_velocity);
  return simulation.set_component_state(part, X_WB, V_WB);
}

std::string apply(const requests::Attach& request, Simulation& simulation) {
  const CellDescription& cell = simulation.description();
  return simulation.attach(cell.find_component(request.part), cell.find_component(request.to));
}

std::string apply(const requests::Detach& request, Simulation& simulation) {
  return simulation.detach(simulation.description().find_component(request.part));
}

}  // namespace takt

#include "server/headless/instant_json.h"

#include <algorithm>
#include <memory>

#include "client_lib/recording/message_json.h"
#include "idl/common/eigen_messages.h"
#include "server/messages/description_message.h"

namespace takt {

namespace {

Named names_of(CellDescription cell) {
  for (ComponentDescription& component : cell.components)
    component.mesh = std::make_shared<const DescribedMesh>();
  return named_lists(to_message(cell, ""));
}

nlohmann::json vector_json(const Vec3& v) {
  return recording::message_json(to_vector(v), {});
}

void add_loads(nlohmann::json& robot, const RobotDescription& description, const RobotSample& sample) {
  robot["level_of_detail"] = sample.level_of_detail;
  if (sample.level_of_detail < 2) return;
  robot["flange_force"] = vector_json(sample.flange_load_W.f);
  robot["flange_torque"] = vector_json(sample.flange_load_W.t);
  robot["base_force"] = vector_json(sample.base_reaction_W.f);
  robot["base_torque"] = vector_json(sample.base_reaction_W.t);
  for (std::size_t j = 0; j < description.arm.joints.size(); ++j) {
    const DriveSample& drive = sample.drives[j];
    if (!drive.has_motor) continue;
    const std::string& joint = description.arm.joints[j].name;
    robot["motor_current"][joint] = drive.motor_current_A;
    robot["gear_deflection"][joint] = drive.gear_deflection_rad;
    robot["friction_mode"][joint] = static_cast<int>(drive.friction_mode);
  }
}

}  // namespace

InstantJson::InstantJson(const CellDescription& cell)
    : cell_(cell), lists_(names_of(cell)), messages_(cell) {}

nlohmann::json InstantJson::of(const Snapshot& snapshot) {
  messages_.fill(snapshot);
  nlohmann::json instant;
  messages_.for_each([&](const auto& topic, const auto& message, bool) {
    nlohmann::json document = recording::message_json(message, lists_);
    for (const char* other : {"stamp", "applied", "scenario_generation"}) document.erase(other);
    if (topic.id == topics::state.id) {
      instant = std::move(document);
      return;
    }
    for (const char* common : {"time", "step", "epoch"}) document.erase(common);
    const bool content = topic.id != topics::contacts.id || snapshot.contacts.acting;
    if (content) instant[std::string(topic.id)] = std::move(document);
  });
  for (std::size_t r = 0; r < cell_.robots.size(); ++r)
    add_loads(instant["robots"][cell_.robots[r].name], cell_.robots[r], snapshot.robots[r]);
  return instant;
}

nlohmann::json InstantJson::of(const ContactSample& sample) const {
  return recording::message_json(to_message(sample), lists_);
}

}  // namespace takt

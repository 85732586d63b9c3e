#include "server/headless/robot_report.h"

#include <nlohmann/json.hpp>

#include "server/headless/vector_json.h"

namespace takt {

namespace {

using Json = nlohmann::ordered_json;

Json values(const JointArray& array, std::size_t count) {
  return Json(std::vector<double>(array.begin(), array.begin() + static_cast<std::ptrdiff_t>(count)));
}

}  // namespace

Json robots_json(const CellDescription& cell, const Snapshot& state) {
  Json all = Json::object();
  for (std::size_t r = 0; r < state.robots.size(); ++r) {
    const RobotSample& sample = state.robots[r];
    const std::size_t joints = cell.robots[r].arm.joints.size();
    Json item;
    item["level_of_detail"] = sample.level_of_detail;
    item["position"] = values(sample.position, joints);
    item["velocity"] = values(sample.velocity, joints);
    if (sample.level_of_detail > 1) {
      item["torque"] = values(sample.effort, joints);
      // Of gripper and load on the flange, about the flange's origin, world axes.
      item["flange_force"] = vector_json(sample.flange_load_W.f);
      item["flange_torque"] = vector_json(sample.flange_load_W.t);
      item["base_force"] = vector_json(sample.base_reaction_W.f);
      item["base_torque"] = vector_json(sample.base_reaction_W.t);
      item["mechanical_power"] = sample.power.mechanical_total_W;
      item["electrical_power"] = sample.power.electrical_W;
      item["mechanical_energy"] = sample.power.mechanical_energy_J;
      item["electrical_energy"] = sample.power.electrical_energy_J;
    }
    all[cell.robots[r].name] = item;
  }
  return all;
}

}  // namespace takt

#include "server/headless/run_metrics_report.h"

#include <algorithm>
#include <nlohmann/json.hpp>

namespace takt {

namespace {

using Json = nlohmann::ordered_json;

struct Margin {
  std::string of, unit;
  double value = 0.0, limit = 0.0, time_s = 0.0;
  double use() const { return value / limit; }
};

Json steps_json(const CellDescription& cell, const RunMetrics& metrics) {
  Json all = Json::array();
  for (const StepMetrics& step : metrics.steps) {
    Json energy = Json::object();
    for (std::size_t i = 0; i < step.energy_J.size(); ++i)
      energy[metrics.consumers[i].name] = step.energy_J[i];
    all.push_back({{"robot", cell.robots[static_cast<std::size_t>(step.step.robot)].name},
                   {"name", step.step.name},
                   {"named", step.step.named},
                   {"line", step.step.line},
                   {"begin", step.step.begin_s},
                   {"end", step.step.end_s},
                   {"duration", step.step.end_s - step.step.begin_s}});
    if (!step.energy_J.empty()) all.back()["electrical_energy"] = std::move(energy);
  }
  return all;
}

Json robots_json(const CellDescription& cell, const RunMetrics& metrics, std::vector<Margin>& margins) {
  Json all = Json::object();
  for (std::size_t r = 0; r < metrics.robots.size(); ++r) {
    const RobotExtremes& robot = metrics.robots[r];
    Json joints = Json::object();
    for (std::size_t j = 0; j < robot.joints.size(); ++j) {
      const JointModel& model = cell.robots[r].arm.joints[j];
      const JointExtremes& joint = robot.joints[j];
      const bool turns = model.type == JointType::revolute;
      const std::string name = cell.robots[r].name + "." + model.name;
      Json item{{"lowest_position", joint.lowest},
                {"highest_position", joint.highest},
                {"largest_speed", joint.speed.value},
                {"largest_speed_time", joint.speed.time_s}};
      if (model.max_velocity > 0.0)
        margins.push_back({name + " speed", turns ? "rad/s" : "m/s", joint.speed.value, model.max_velocity,
                           joint.speed.time_s});
      if (robot.dynamic) {
        item["largest_effort"] = joint.torque.value;
        item["largest_effort_time"] = joint.torque.time_s;
        if (model.max_effort > 0.0)
          margins.push_back({name + " torque", turns ? "N m" : "N", joint.torque.value, model.max_effort,
                             joint.torque.time_s});
      }
      joints[model.name] = std::move(item);
    }
    Json& reported = all[cell.robots[r].name];
    reported["joints"] = std::move(joints);
    if (!robot.dynamic) continue;
    reported["largest_flange_force"] = robot.flange_force_N.value;
    reported["largest_flange_force_time"] = robot.flange_force_N.time_s;
    reported["largest_flange_torque"] = robot.flange_torque_N_m.value;
    reported["largest_flange_torque_time"] = robot.flange_torque_N_m.time_s;
  }
  return all;
}

}  // namespace

Json run_metrics_json(const CellDescription& cell, const HeadlessResult& result) {
  const RunMetrics& metrics = *result.run_metrics;
  Json all;
  const auto cycle_s = cycle_time_s(metrics);
  all["cycle_time"] = cycle_s ? Json(*cycle_s) : Json(nullptr);
  all["steps"] = steps_json(cell, metrics);
  Json consumers = Json::object();
  for (const ConsumerMetrics& consumer : metrics.consumers)
    consumers[consumer.name] = {{"electrical_energy", consumer.energy_J},
                                {"largest_electrical_power", consumer.power_W.value},
                                {"largest_electrical_power_time", consumer.power_W.time_s}};
  all["consumers"] = std::move(consumers);
  std::vector<Margin> margins;
  all["robots"] = robots_json(cell, metrics, margins);
  Json holding = Json::array();
  const auto name = [&](int component) { return cell.components[static_cast<std::size_t>(component)].name; };
  for (const HoldingExtreme& most : metrics.holding)
    holding.push_back({{"part", name(most.part)},
                       {"holder", name(most.holder)},
                       {"largest_force", most.force_N.value},
                       {"largest_force_time", most.force_N.time_s},
                       {"largest_torque", most.torque_N_m.value},
                       {"largest_torque_time", most.torque_N_m.time_s}});
  all["holding"] = std::move(holding);
  for (const GripExtreme& most : result.grips)
    margins.push_back(
        {cell.grippers[static_cast<std::size_t>(most.gripper)].name + " grip of " + name(most.load.part), "N",
         most.load.needed_N, most.load.force_N, most.time_s});
  for (const AssertionResult& demand : result.assertions)
    if (demand.value && demand.upper && *demand.upper > 0.0)
      margins.push_back({demand.name, demand.unit, *demand.value, *demand.upper, demand.time_s});
  std::stable_sort(margins.begin(), margins.end(),
                   [](const Margin& a, const Margin& b) { return a.use() > b.use(); });
  Json reported = Json::array();
  for (const Margin& margin : margins)
    reported.push_back({{"of", margin.of},
                        {"use", margin.use()},
                        {"value", margin.value},
                        {"limit", margin.limit},
                        {"unit", margin.unit},
                        {"time", margin.time_s}});
  all["margins"] = std::move(reported);
  return all;
}

}  // namespace takt

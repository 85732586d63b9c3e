#include "server/headless/run_summary.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "client_lib/recording/message_json.h"
#include "idl/common/eigen_messages.h"
#include "idl/common/text.h"
#include "server/headless/report.h"
#include "server/headless/table.h"

namespace takt {

namespace {

using Json = nlohmann::ordered_json;

constexpr std::size_t kMostListed = 20;

const std::string& name_of(const CellDescription& cell, int component) {
  return cell.components[static_cast<std::size_t>(component)].name;
}

struct Load {
  std::string of;
  const char* unit = "N";
  double value = 0.0;
  double limit = 0.0;  ///< 0: none
  double time_s = 0.0;
  double use() const { return limit > 0.0 ? value / limit : 0.0; }
};

/// The one that uses more of its limit; without limits the larger one.
bool heavier(const Load& a, const Load& b) {
  return a.use() != b.use() ? a.use() > b.use() : a.value > b.value;
}

std::vector<Load> largest_loads(const CellDescription& cell, const HeadlessResult& result) {
  std::vector<Load> loads;
  const auto keep = [&](std::optional<Load>& most, Load candidate) {
    if (!most || heavier(candidate, *most)) most = std::move(candidate);
  };
  for (std::size_t r = 0; r < cell.robots.size(); ++r) {
    const RobotExtremes& robot = result.run_metrics->robots[r];
    if (!robot.dynamic) continue;
    std::optional<Load> most;
    for (std::size_t j = 0; j < robot.joints.size(); ++j) {
      const JointModel& model = cell.robots[r].arm.joints[j];
      const bool turns = model.type == JointType::revolute;
      const Peak& peak = robot.joints[j].torque;
      keep(most, {cell.robots[r].name + "." + model.name, turns ? "N m" : "N", peak.value, model.max_effort,
                  peak.time_s});
    }
    if (most) loads.push_back(*most);
  }
  for (std::size_t g = 0; g < cell.grippers.size(); ++g) {
    const std::string& gripper = cell.grippers[g].name;
    std::optional<Load> most;
    for (const GripExtreme& grip : result.grips)
      if (grip.gripper == static_cast<int>(g))
        keep(most, {gripper + ", grip of " + name_of(cell, grip.load.part), "N", grip.load.needed_N,
                    grip.load.force_N, grip.time_s});
    const bool by_friction = most.has_value();
    for (const HoldingExtreme& holding : result.run_metrics->holding) {
      const std::string& holder = name_of(cell, holding.holder);
      if (by_friction || (holder != gripper && !holder.starts_with(gripper + "/"))) continue;
      keep(most, {holder + ", holds " + name_of(cell, holding.part), "N", holding.force_N.value, 0.0,
                  holding.force_N.time_s});
    }
    if (most) loads.push_back(*most);
  }
  return loads;
}

Json parts_json(const Scenario& scenario, const CellDescription& cell, const Snapshot& state) {
  Json all = Json::array();
  for (std::size_t i = 0; i < state.components.size(); ++i) {
    if (cell.components[i].type != ComponentType::part) continue;
    const ComponentSample& sample = state.components[i];
    Json& item = all.emplace_back();
    item["name"] = cell.components[i].name;
    item["position"] = recording::message_json(to_vector(sample.p_WB), {});
    item["held_by"] = sample.partner < 0 ? Json(nullptr) : Json(name_of(cell, sample.partner));
    if (const ExpectedPose* expected = expected_pose(scenario, cell.components[i].name))
      item["position_error"] = pose_error(sample, expected->X_WB).position_m;
  }
  return all;
}

/// With micrometres; no "-0.000000".
std::string position_text(const Json& coordinate) {
  const std::string text = fixed_text(coordinate.get<double>(), 6);
  return text == "-0.000000" ? "0.000000" : text;
}

void print_parts(std::ostream& out, const Json& parts, double tolerance_m) {
  Table table;
  std::size_t left_out = 0;
  for (const Json& part : parts) {
    const bool judged = part.contains("position_error");
    const double error_m = judged ? part["position_error"].get<double>() : 0.0;
    const bool outside = error_m > tolerance_m;
    if (table.rows() >= kMostListed && !outside) {
      ++left_out;
      continue;
    }
    table.begin_row();
    table.set("Part", part["name"].get<std::string>());
    for (const char* axis : {"x", "y", "z"})
      table.set(std::string(axis) + " (m)", position_text(part["position"][axis]));
    if (judged)
      table.set("error (mm)", error_m < 0.1 ? fixed_text(1e3 * error_m, 4) : number_text(1e3 * error_m, 4));
    table.set("held by", part["held_by"].is_null() ? "nothing" : part["held_by"].get<std::string>());
    if (outside) table.set("", "outside the tolerance of " + number_text(1e3 * tolerance_m, 3) + " mm");
  }
  if (table.rows() == 0) return;
  out << '\n';
  table.write_aligned(out);
  if (left_out > 0) out << "and " << left_out << " more Parts (--report lists all)\n";
}

void print_loads(std::ostream& out, const Json& loads) {
  if (loads.empty()) return;
  Table table;
  for (const Json& load : loads) {
    table.begin_row();
    table.set("largest load", load["of"].get<std::string>());
    table.set("value", number_text(load["value"].get<double>(), 4));
    table.set("unit", load["unit"].get<std::string>());
    const bool limited = !load["limit"].is_null();
    table.set("limit", limited ? number_text(load["limit"].get<double>(), 4) : "");
    table.set("used (%)", limited ? fixed_text(100.0 * load["use"].get<double>(), 1) : "");
    table.set("at (s)", fixed_text(load["time"].get<double>(), 3));
  }
  out << '\n';
  table.write_aligned(out);
}

void print_warnings(std::ostream& out, const Json& warnings, std::size_t further) {
  if (warnings.empty()) {
    out << "No event of severity warning or error\n";
    return;
  }
  const std::size_t all = warnings.size() + further;
  out << all << (all == 1 ? " event" : " events") << " of severity warning or error:\n";
  for (std::size_t i = 0; i < std::min(warnings.size(), kMostListed); ++i)
    out << "  " << fixed_text(warnings[i]["time"].get<double>(), 3) << " s  "
        << warnings[i]["severity"].get<std::string>() << ": " << warnings[i]["message"].get<std::string>()
        << '\n';
  if (all > kMostListed) out << "  and " << all - kMostListed << " more (--report lists them)\n";
}

}  // namespace

Json run_summary_json(const Scenario& scenario, const CellDescription& cell, const HeadlessResult& result) {
  Json summary{{"cycle_time", nullptr},
               {"parts", parts_json(scenario, cell, result.final_state)},
               {"loads", Json::array()},
               {"largest_contact_force", nullptr}};
  if (const auto cycle_s = cycle_time_s(*result.run_metrics)) summary["cycle_time"] = *cycle_s;
  for (const Load& load : largest_loads(cell, result)) {
    const bool limited = load.limit > 0.0;
    summary["loads"].push_back({{"of", load.of},
                                {"value", load.value},
                                {"unit", load.unit},
                                {"limit", limited ? Json(load.limit) : Json(nullptr)},
                                {"use", limited ? Json(load.use()) : Json(nullptr)},
                                {"time", load.time_s}});
  }
  const auto& contacts = result.contact_extremes;
  const auto most = std::max_element(contacts.begin(), contacts.end(), [](const auto& a, const auto& b) {
    return a.sample.result.normal_force_N < b.sample.result.normal_force_N;
  });
  if (most != contacts.end())
    summary["largest_contact_force"] = {{"base", name_of(cell, most->sample.base)},
                                        {"target", name_of(cell, most->sample.target)},
                                        {"normal_force", most->sample.result.normal_force_N},
                                        {"time", most->time_s}};
  return summary;
}

Json warnings_json(const HeadlessResult& result) {
  Json all = Json::array();
  for (const takt_msgs::msg::Event& event : result.warnings)
    all.push_back({{"time", event.time},
                   {"step", event.step},
                   {"severity", to_string(event.severity)},
                   {"code", event.code},
                   {"subject", event.subject},
                   {"message", event.message}});
  return all;
}

void print_summary(std::ostream& out, const Scenario& scenario, const CellDescription& cell,
                   const HeadlessResult& result) {
  const double simulated_s = result.final_state.time_s;
  out << scenario.name << ": " << fixed_text(simulated_s, 3) << " s simulated in "
      << number_text(result.cpu_s, 3) << " s of computation, ratio "
      << number_text(result.computation_ratio(simulated_s), 3) << ", state hash "
      << hexadecimal_text(result.final_state.state_hash) << '\n';
  const Json summary = run_summary_json(scenario, cell, result);
  if (!summary["cycle_time"].is_null())
    out << "Cycle time " << fixed_text(summary["cycle_time"].get<double>(), 3) << " s\n";
  else if (interrupted(*result.run_metrics))
    out << "No cycle time: the program goes on at the end of the run (--duration)\n";
  if (const Json& most = summary["largest_contact_force"]; !most.is_null())
    out << "Largest contact force " << number_text(most["normal_force"].get<double>(), 4) << " N, "
        << most["base"].get<std::string>() << " and " << most["target"].get<std::string>() << " at "
        << fixed_text(most["time"].get<double>(), 3) << " s\n";
  if (!cell.checked_bodies.empty() && result.collisions.empty())
    out << "Collision checking: nothing came too close\n";
  print_warnings(out, warnings_json(result), result.further_warnings);
  const SolverStatistics& work = result.statistics.solver;
  if (work.forced_steps > 0)
    out << work.forced_steps << " of " << work.steps
        << " solver steps were accepted whatever their error, as smaller ones were not allowed\n";
  print_parts(out, summary["parts"], scenario.expected_tolerance_m);
  print_loads(out, summary["loads"]);
  if (!result.assertions.empty()) out << '\n';
  print_assertions(out, result.assertions);
}

}  // namespace takt

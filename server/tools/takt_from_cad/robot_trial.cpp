#include "server/tools/takt_from_cad/robot_trial.h"

#include <algorithm>
#include <cmath>
#include <exception>
#include <filesystem>
#include <map>
#include <set>

#include "server/geometry/convex/decomposition_cache.h"
#include "server/headless/headless_run.h"
#include "server/scenario/scenario_builder.h"

namespace takt {

namespace {

std::vector<std::size_t> misplaced(const product::Product& product, const CellModel& cell,
                                   const Snapshot& state) {
  std::vector<std::size_t> result;
  for (std::size_t i = 0; i < product.instances.size(); ++i) {
    const int id = cell.description.find_component(product.instances[i].name);
    const PoseError error =
        pose_error(state.components.at(static_cast<std::size_t>(id)), product.instances[i].X_WB);
    if (error.position_m > product::kPlaceTolerance_m ||
        error.angle_rad > product::kPlaceTolerance_deg * M_PI / 180.0)
      result.push_back(i);
  }
  return result;
}

/// For runs at level 1: surfaces of contact take most of the time of loading.
Scenario without_contact(const std::filesystem::path& file) {
  Scenario scenario = read_scenario(file);
  if (!scenario.begins_with_contact()) scenario.contact.given = false;
  return scenario;
}

RobotTrial run_robot(const product::Product& product, const product::RobotPlan& plan,
                     const product::CellFiles& files) {
  const Scenario scenario = without_contact(files.robot_scenario);
  ImportOptions import;
  import.cache_directory = user_cache_directory();
  const auto cell = build_cell(scenario, import);
  Simulation simulation(cell);
  HeadlessOptions options;
  options.duration_s = scenario.duration_s;
  options.program = files.robot_program;
  options.run_metrics = true;
  const HeadlessResult result = run_headless(simulation, scenario, options);
  RobotTrial trial;
  trial.fault = result.fault;
  const bool began = result.final_state.time_s > 0.0;  // else the cell is at fault, not a move
  if (!result.fault.empty() && began && result.run_metrics) {
    for (const StepMetrics& one : result.run_metrics->steps) {
      if (!one.step.named) continue;
      for (std::size_t k = 0; k < plan.moves.size(); ++k)
        if (one.step.name == plan.moves[k].name ||
            one.step.name == "assemble " + product.instances[plan.moves[k].held].name)
          trial.move = k;
    }
  }
  trial.misplaced = misplaced(product, *cell, result.final_state);
  return trial;
}

/// Instances that do not stay in their places though nothing moves them.
std::vector<std::size_t> fallen_parts(const product::Product& product, const std::filesystem::path& file) {
  const Scenario scenario = without_contact(file);
  ImportOptions import;
  import.cache_directory = user_cache_directory();
  const auto cell = build_cell(scenario, import);
  Simulation simulation(cell);
  HeadlessOptions options;
  options.duration_s = scenario.duration_s;
  return misplaced(product, *cell, run_headless(simulation, scenario, options).final_state);
}

/// Those of the fallen that touch none of a larger number which has fallen, too.
std::vector<std::size_t> first_of_the_fallen(const product::Product& product,
                                             const product::Hierarchy& hierarchy,
                                             const std::vector<std::size_t>& fallen) {
  const std::set<std::size_t> all(fallen.begin(), fallen.end());
  std::set<std::size_t> first = all;
  for (const product::Contact& contact : product.contacts) {
    if (!all.contains(contact.first) || !all.contains(contact.second)) continue;
    const int a = hierarchy.numbers[contact.first], b = hierarchy.numbers[contact.second];
    if (a != b) first.erase(a < b ? contact.first : contact.second);
  }
  return {first.begin(), first.end()};
}

}  // namespace

RobotTrial try_robot(const product::Product& product, const product::RobotPlan& plan,
                     const product::CellFiles& files) {
  try {
    return run_robot(product, plan, files);
  } catch (const std::exception& error) {
    return {error.what(), {}, {}};
  }
}

product::CellFiles write_standing_cell(const product::Product& product, product::Disassembly& plan,
                                       const product::Hierarchy& hierarchy, const std::string& directory) {
  while (true) {
    product::CellFiles files = product::write_cell(product, plan, hierarchy, directory);
    std::vector<std::size_t> fallen;
    try {
      fallen = fallen_parts(product, files.scenario);
    } catch (const std::exception& error) {
      files.notes.push_back(std::string("the cell does not run: ") + error.what());
      return files;
    }
    const std::set<std::size_t> before(plan.on_pads.begin(), plan.on_pads.end());
    std::vector<std::size_t> first = first_of_the_fallen(product, hierarchy, fallen);
    std::erase_if(first, [&](std::size_t i) { return before.contains(i); });
    if (first.empty()) {
      for (const std::size_t i : fallen)
        files.notes.push_back(
            product.instances[i].name +
            " does not stay in its place when the cell runs, although the support holds it");
      return files;
    }
    plan.on_pads.insert(plan.on_pads.end(), first.begin(), first.end());
  }
}

product::CellFiles write_tried_cell(const product::Product& product, const product::Disassembly& plan,
                                    const product::Hierarchy& hierarchy, const std::string& directory,
                                    product::RobotPlan& robot) {
  std::map<std::size_t, std::string> refused;
  std::vector<std::filesystem::path> of_robot;  // written for moves that are refused since
  const auto write = [&] {
    return product::write_cell(product, plan, hierarchy, directory, robot.moves.empty() ? nullptr : &robot);
  };
  while (true) {
    robot = product::plan_robot(product, plan, refused);
    const product::CellFiles files = write();
    if (robot.moves.empty()) {
      for (const std::filesystem::path& file : of_robot) std::filesystem::remove(file);
      return files;
    }
    of_robot = {files.robot_scenario, files.robot_program};
    const RobotTrial trial = try_robot(product, robot, files);
    const std::size_t before = refused.size();
    if (trial.move) {
      refused[robot.moves[*trial.move].held] =
          "in a run of the cell its move does not end (" + trial.fault + ")";
    } else if (trial.fault.empty()) {
      for (const std::size_t i : trial.misplaced)
        for (const product::RobotMove& move : robot.moves)
          if (std::find(move.parts.begin(), move.parts.end(), i) != move.parts.end())
            refused[move.held] =
                "in a run of the cell " + product.instances[i].name + " does not come back to its place";
    }
    if (refused.size() > before) continue;
    if (trial.fault.empty() && trial.misplaced.empty()) return files;
    if (!trial.fault.empty())
      robot.notes.push_back("The run of the cell with the robot fails: " + trial.fault);
    for (const std::size_t i : trial.misplaced)
      robot.notes.push_back(
          product.instances[i].name +
          " does not stay in its place: at level 1 its convex shapes touch no part of a larger "
          "number that is held");
    return write();
  }
}

}  // namespace takt

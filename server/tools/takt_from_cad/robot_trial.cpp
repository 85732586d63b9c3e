#include "server/tools/takt_from_cad/robot_trial.h"

#include <algorithm>
#include <cmath>
#include <exception>
#include <filesystem>
#include <map>
#include <set>
#include <stdexcept>

#include "idl/common/text.h"
#include "server/geometry/convex/decomposition_cache.h"
#include "server/headless/headless_run.h"
#include "server/scenario/scenario_builder.h"

namespace takt {

namespace {

/// By instance: how it is out of its place.
std::map<std::size_t, std::string> misplaced(const product::Product& product, const CellModel& cell,
                                             const Snapshot& state) {
  std::map<std::size_t, std::string> result;
  for (std::size_t i = 0; i < product.instances.size(); ++i) {
    const int id = cell.description.find_component(product.instances[i].name);
    const ComponentSample& sample = state.components.at(static_cast<std::size_t>(id));
    const PoseError error = pose_error(sample, product.instances[i].X_WB);
    if (error.position_m > product::kPlaceTolerance_m ||
        error.angle_rad > product::kPlaceTolerance_deg * M_PI / 180.0)
      result[i] =
          number_text(1e3 * error.position_m, 3) + " mm and " +
          number_text(std::round(1e2 * error.angle_rad * 180.0 / M_PI) / 1e2, 4) +
          " deg from its place, held by " +
          (sample.partner < 0 ? "nothing"
                              : cell.description.components[static_cast<std::size_t>(sample.partner)].name);
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
          trial.move = k, trial.step = one.step.name;
    }
  }
  if (result.run_metrics)
    for (const StepMetrics& one : result.run_metrics->steps)
      trial.cycle_s = std::max(trial.cycle_s, one.goes_on ? result.final_state.time_s : one.step.end_s);
  trial.misplaced = misplaced(product, *cell, result.final_state);
  return trial;
}

/// Instances that do not stay in their places though nothing moves them. Throws what ends the run early.
std::map<std::size_t, std::string> fallen_parts(const product::Product& product,
                                                const std::filesystem::path& file) {
  const Scenario scenario = without_contact(file);
  ImportOptions import;
  import.cache_directory = user_cache_directory();
  const auto cell = build_cell(scenario, import);
  Simulation simulation(cell);
  HeadlessOptions options;
  options.duration_s = scenario.duration_s;
  const HeadlessResult result = run_headless(simulation, scenario, options);
  if (!result.fault.empty()) throw std::runtime_error(result.fault);
  return misplaced(product, *cell, result.final_state);
}

/// Those of the fallen that touch none of a larger number which has fallen, too.
std::vector<std::size_t> first_of_the_fallen(const product::Product& product,
                                             const product::Hierarchy& hierarchy,
                                             const std::map<std::size_t, std::string>& fallen) {
  std::set<std::size_t> all;
  for (const auto& [i, how] : fallen) all.insert(i);
  std::set<std::size_t> first = all;
  for (const product::Contact& contact : product.contacts) {
    if (!all.contains(contact.first) || !all.contains(contact.second)) continue;
    const int a = hierarchy.numbers[contact.first], b = hierarchy.numbers[contact.second];
    if (a != b) first.erase(a < b ? contact.first : contact.second);
  }
  return {first.begin(), first.end()};
}

/// Without the place in a program that the reader of a note has not seen, and may not have.
std::string reason_of(const std::string& fault) {
  const std::string mark = ".lua:";
  const std::size_t file = fault.find(mark);
  const std::size_t end = fault.find(": ", file == std::string::npos ? 0 : file + mark.size());
  if (file == std::string::npos || end == std::string::npos) return fault;
  return fault.substr(end + 2, fault.rfind(" (in the routine of ") - end - 2);
}

}  // namespace

RobotTrial try_robot(const product::Product& product, const product::RobotPlan& plan,
                     const product::CellFiles& files) {
  try {
    return run_robot(product, plan, files);
  } catch (const std::exception& error) {
    RobotTrial trial;
    trial.fault = error.what();
    return trial;
  }
}

product::CellFiles write_standing_cell(product::CellWriter& writer, const product::Product& product,
                                       product::Disassembly& plan, const product::Hierarchy& hierarchy) {
  const auto noted = [&](const std::string& note) {
    writer.add_note(note);
    return writer.write_cell(plan);
  };
  while (true) {
    product::CellFiles files = writer.write_cell(plan);
    std::map<std::size_t, std::string> fallen;
    try {
      fallen = fallen_parts(product, files.scenario);
    } catch (const std::exception& error) {
      return noted(std::string("the cell does not run: ") + error.what());
    }
    if (fallen.empty()) return files;
    const std::set<std::size_t> before(plan.on_pads.begin(), plan.on_pads.end());
    std::vector<std::size_t> first = first_of_the_fallen(product, hierarchy, fallen);
    std::erase_if(first, [&](std::size_t i) { return before.contains(i); });
    if (first.empty()) {
      product::CellFiles last;
      for (const auto& [i, how] : fallen)
        last = noted(product.instances[i].name + " does not stay in its place when the cell runs: it ends " +
                     how);
      return last;
    }
    plan.on_pads.insert(plan.on_pads.end(), first.begin(), first.end());
  }
}

std::optional<product::CellFiles> write_tried_cell(product::CellWriter& writer,
                                                   const product::Product& product,
                                                   const product::Disassembly& plan,
                                                   product::RobotPlan& robot) {
  std::map<std::size_t, std::string> refused;
  while (true) {
    robot = product::plan_robot(product, plan, refused);
    if (robot.moves.empty()) {
      writer.remove_robot_cell();
      return std::nullopt;
    }
    const RobotTrial trial = try_robot(product, robot, writer.write_robot_cell(plan, robot));
    const std::size_t before = refused.size();
    if (trial.move) {
      refused[robot.moves[*trial.move].held] =
          "in a run of the cell \"" + trial.step + "\" does not end: " + reason_of(trial.fault);
    } else if (trial.fault.empty()) {
      for (const auto& [i, how] : trial.misplaced)
        for (const product::RobotMove& move : robot.moves)
          if (std::find(move.parts.begin(), move.parts.end(), i) != move.parts.end())
            refused[move.held] = "in a run of the cell " + product.instances[i].name + " ends " + how;
    }
    if (refused.size() > before) continue;
    if (!robot.notes.empty())
      robot.notes.push_back(
          "Parts that the robot does not take stay in their places, and its program does all else: take them "
          "out by hand, or give the cell a tool that holds them and the program their moves");
    if (trial.fault.empty() && trial.misplaced.empty()) {
      robot.cycle_s = trial.cycle_s;
      return writer.write_robot_cell(plan, robot);
    }
    if (!trial.fault.empty())
      robot.notes.push_back("The run of the cell with the robot fails: " + trial.fault);
    for (const auto& [i, how] : trial.misplaced)
      robot.notes.push_back(product.instances[i].name + " does not stay in its place: it ends " + how +
                            "; at level 1 its convex shapes touch no part of a larger number that is held");
    return writer.write_robot_cell(plan, robot);
  }
}

}  // namespace takt

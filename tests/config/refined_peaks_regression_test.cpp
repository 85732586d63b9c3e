// Every shipped scenario at every level of detail: the largest joint torques, loads of flanges, forces of
// contacts, holding forces, powers and energies of a run's report stay within 2 % (contacts 3 %) with a quarter of the
// tolerance (or of the step of a method without error control), in the long form with a tenth. Positions hide
// unresolved forces.
#include <gtest/gtest.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <filesystem>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "server/geometry/convex/decomposition_cache.h"
#include "server/headless/headless_run.h"
#include "server/scenario/scenario_builder.h"
#include "tests/support/effort.h"

namespace takt {
namespace {

namespace fs = std::filesystem;

/// By kind ("torque of N m") and name.
using Peaks = std::map<std::pair<std::string, std::string>, double>;

struct Case {
  std::string scenario;
  int level;
};

/// How far off by more than 2 % a peak may be, for a reason: by kind and name.
using Allowances = Peaks;

Peaks peaks_of(const CellDescription& cell, const RunMetrics& numbers, int level) {
  Peaks peaks;
  const auto component = [&cell](int id) {
    return id < 0 ? std::string("nothing") : cell.components[static_cast<std::size_t>(id)].name;
  };
  for (std::size_t r = 0; r < numbers.robots.size(); ++r) {
    const RobotExtremes& robot = numbers.robots[r];
    if (!robot.dynamic) continue;
    const RobotDescription& described = cell.robots[r];
    for (std::size_t j = 0; j < robot.joints.size(); ++j)
      peaks[{"torque", described.name + " " + described.arm.joints[j].name}] = robot.joints[j].torque.value;
    peaks[{"flange force", described.name}] = robot.flange_force_N.value;
    peaks[{"flange torque", described.name}] = robot.flange_torque_N_m.value;
  }
  for (const ContactExtreme& contact : numbers.contacts)
    peaks[{"contact force", component(contact.sample.base) + " - " + component(contact.sample.target)}] =
        contact.sample.result.normal_force_N;
  // By surface contact the holding forces are contact forces.
  for (const HoldingExtreme& hold : level < 3 ? numbers.holding : std::vector<HoldingExtreme>())
    peaks[{"holding force", component(hold.part) + " by " + component(hold.holder)}] = hold.force_N.value;
  for (const ConsumerMetrics& consumer : numbers.consumers) {
    peaks[{"power", consumer.name}] = consumer.power_W.value;
    peaks[{"energy", consumer.name}] = consumer.energy_J;
  }
  return peaks;
}

void refine(Scenario& scenario) {
  // A long run of short steps is made finer by less.
  constexpr double kMaxSteps = 4e6;
  const double least = test::effort() > 1 ? 0.1 : 0.25;
  const double finer = std::max(least, scenario.duration_s / scenario.step_s / kMaxSteps);
  const bool error_control = solver_has_error_control(scenario.initial_solver());
  Scenario::LevelSolver* section = scenario.begins_with_contact() ? &scenario.contact_solver
                                   : scenario.dynamics_solver && scenario.begins_with(2)
                                       ? &*scenario.dynamics_solver
                                       : nullptr;
  if (error_control)
    (section != nullptr ? section->tolerance : scenario.tolerance) *= finer;
  else if (section != nullptr && section->step_s)
    *section->step_s *= finer;
  else
    scenario.step_s *= finer;
}

/// Substitute forces catch a falling Part at the end of a step, when it is up to g h faster than at the
/// touch; a critically damped spring of pole p then pulls with up to m p g h more.
Allowances of_catches(const CellModel& model, const HeadlessResult& result) {
  Allowances allowed;
  const double g = model.interaction.gravity_W.norm();
  for (const ConnectionChange& change : result.changes) {
    if (change.step == 0 || change.from >= 0 || change.to < 0) continue;
    const auto part = std::find_if(model.parts.begin(), model.parts.end(),
                                   [&](const RigidBodyParameters& p) { return p.body == change.part; });
    const auto& components = model.components;
    const double pole = std::sqrt(g / 1e-4);
    allowed[{"holding force", components[static_cast<std::size_t>(change.part)].name + " by " +
                                  components[static_cast<std::size_t>(change.to)].name}] =
        part->mass_kg * pole * g * model.step_s;
  }
  return allowed;
}

struct Outcome {
  Peaks peaks;
  Allowances allowed;
};

Outcome run(const Case& c, bool refined) {
  ScenarioOptions options;
  options.level_of_detail = c.level;
  Scenario scenario =
      read_scenario(fs::path(TAKT_CONFIG_DIR) / "scenarios" / (c.scenario + ".yaml"), options);
  if (refined) refine(scenario);
  Simulation simulation(build_cell(scenario, {user_cache_directory(), nullptr}));
  HeadlessOptions headless;
  headless.duration_s = scenario.duration_s;
  headless.program = scenario.controller_program;
  headless.run_metrics = true;
  const HeadlessResult result = run_headless(simulation, scenario, headless);
  EXPECT_EQ(result.fault, "");
  EXPECT_TRUE(result.alternating_forces.empty());
  Outcome outcome{peaks_of(simulation.description(), *result.run_metrics, c.level),
                  of_catches(simulation.model(), result)};
  // The magnet tumbles out of its core onto the Tray. How it lands depends on all that comes before: tolerances of 1e-4 to
  // 1e-6 give blows of 152, 281, 265, 259 and 283 N, without order.
  if (c.scenario == "bev_rotor" && c.level == 3) outcome.allowed[{"contact force", "Magnet4 - Tray"}] = 150.0;
  return outcome;
}

/// At levels 1 and 2 a stop takes the speed of a Part on a belt within one step: the shorter the step, the larger the
/// force. Reports of such cells have no peaks to be compared (docs/transport.md).
bool has_stops(const fs::path& file) {
  const Scenario scenario = read_scenario(file);
  return std::any_of(scenario.devices.begin(), scenario.devices.end(),
                     [](const StatedDevice& device) { return std::string(device.type->key) == "conveyors"; });
}

std::vector<Case> cases() {
  std::vector<Case> all;
  const fs::path root = fs::path(TAKT_CONFIG_DIR) / "scenarios";
  for (const auto& entry : fs::recursive_directory_iterator(root)) {
    if (entry.path().extension() != ".yaml" || has_stops(entry.path())) continue;
    const std::string name = fs::relative(entry.path(), root).replace_extension().string();
    for (const int level : {1, 2, 3}) all.push_back({name, level});
  }
  std::sort(all.begin(), all.end(), [](const Case& a, const Case& b) {
    return std::pair(a.scenario, a.level) < std::pair(b.scenario, b.level);
  });
  return all;
}

class RefinedPeaks : public testing::TestWithParam<Case> {};
INSTANTIATE_TEST_SUITE_P(Shipped, RefinedPeaks, testing::ValuesIn(cases()), [](const auto& shipped) {
  std::string name = shipped.param.scenario;
  std::replace_if(
      name.begin(), name.end(), [](unsigned char c) { return std::isalnum(c) == 0; }, '_');
  return name + "_" + std::to_string(shipped.param.level);
});

/// The reference of the 2 %: the peak itself, or a size beside which it is small. Loads of flanges: their
/// force at an arm of 0.1 m.
double scale_of(const Peaks& peaks, const std::pair<std::string, std::string>& name) {
  constexpr double kSmall = 0.1, kArm_m = 0.1;
  double largest = 0.0;
  for (const auto& [other, value] : peaks)
    if (other.first == name.first) largest = std::max(largest, value);
  const auto own = peaks.find(name);
  double scale = std::max(own != peaks.end() ? own->second : 0.0, kSmall * largest);
  if (name.first == "flange torque")
    scale = std::max(scale, kArm_m * peaks.at({"flange force", name.second}));
  return scale;
}

/// A landing has some ten of the solver's steps, whose own error at the shipped tolerance is up to 2.7 % of the peak.
double allowed_share(const std::pair<std::string, std::string>& name) {
  return name.first == "contact force" ? 0.03 : 0.02;
}

TEST_P(RefinedPeaks, PeaksAgreeWithThoseOfARefinedRun) {
  Outcome shipped, refined;
  try {
    shipped = run(GetParam(), false), refined = run(GetParam(), true);
  } catch (const ScenarioError& error) {
    GTEST_SKIP() << error.what();  // a cell that lacks requirements of the level
  }
  Peaks all = refined.peaks;
  all.insert(shipped.peaks.begin(), shipped.peaks.end());
  for (const auto& [name, value] : all) {
    const auto peak = [&name = name](const Peaks& peaks) {
      const auto found = peaks.find(name);
      return found == peaks.end() ? 0.0 : found->second;
    };
    EXPECT_NEAR(peak(shipped.peaks), peak(refined.peaks),
                allowed_share(name) * scale_of(refined.peaks, name) + peak(shipped.allowed))
        << name.first << " of " << name.second;
  }
}

}  // namespace
}  // namespace takt

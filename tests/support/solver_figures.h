#pragma once
// Figures of a solver in surface contact, for tests and for the benchmark of communication steps:
// restitution, sliding, and the largest work of one communication step, counted.
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <numbers>
#include <stdexcept>
#include <string>
#include <vector>

#include "server/scenario/scenario_builder.h"
#include "server/simulation/step/simulation.h"

namespace takt::test {

struct SolverSetting {
  std::string method;
  double tolerance = 0.0;  ///< 0: a method without tolerance
  double step_s = 0.001;   ///< communication step
};

inline std::vector<std::string> overrides_of(const SolverSetting& setting) {
  std::vector<std::string> overrides{"solver.method=" + setting.method,
                                     "solver.step_s=" + std::to_string(setting.step_s)};
  if (setting.tolerance > 0.0) {
    char value[32];
    std::snprintf(value, sizeof value, "%.17g", setting.tolerance);
    overrides.push_back(std::string("solver.tolerance=") + value);
  }
  return overrides;
}

/// The largest work of one communication step.
struct LargestWork {
  std::uint64_t attempts = 0, evaluations = 0;
  std::uint64_t forced_steps = 0;  ///< of the whole run

  void note(const SolverStatistics& before, const SolverStatistics& after) {
    attempts = std::max(attempts, after.steps + after.rejected_steps - before.steps - before.rejected_steps);
    evaluations = std::max(evaluations, after.evaluations - before.evaluations);
    forced_steps = after.forced_steps;
  }
};

/// A scene of config/scenarios/contact, watched after every communication step.
class WatchedScene {
 public:
  WatchedScene(const std::string& name, const SolverSetting& setting, std::vector<std::string> overrides)
      : cell_(load(name, setting, std::move(overrides))),
        simulation_(cell_),
        snapshot_(simulation_.make_snapshot()) {
    simulation_.read_snapshot(snapshot_);
  }
  void step() {
    const SolverStatistics before = simulation_.statistics().solver;
    if (!simulation_.step({})) throw std::runtime_error(simulation_.fault());
    work_.note(before, simulation_.statistics().solver);
    simulation_.read_snapshot(snapshot_);
  }
  double time_s() const { return simulation_.time_s(); }
  const ComponentSample& sample(const std::string& name) const {
    return snapshot_.components[static_cast<std::size_t>(cell_->description.find_component(name))];
  }
  const LargestWork& work() const { return work_; }

 private:
  static std::shared_ptr<const CellModel> load(const std::string& name, const SolverSetting& setting,
                                               std::vector<std::string> overrides) {
    ScenarioOptions options;
    options.overrides = overrides_of(setting);
    options.overrides.insert(options.overrides.end(), overrides.begin(), overrides.end());
    return load_cell(std::filesystem::path(TAKT_CONFIG_DIR) / "scenarios" / "contact" / (name + ".yaml"),
                     options);
  }

  std::shared_ptr<const CellModel> cell_;
  Simulation simulation_;
  Snapshot snapshot_;
  LargestWork work_;
};

struct SolverFigure {
  double value = 0.0;
  LargestWork work;
};

/// Of the box that falls flat onto a plate (drop.yaml): speed of rebound over speed of arrival, by its energy
/// outside the layer. 1 without damping.
inline SolverFigure restitution(const SolverSetting& setting, double areal_damping_N_s_per_m3) {
  constexpr double kG = 9.80665, kHeight = 0.05;
  WatchedScene scene(
      "drop", setting,
      {"contact.defaults.areal_damping_N_s_per_m3=" + std::to_string(areal_damping_N_s_per_m3)});
  double lowest = 1.0, highest = 0.0;
  const double fall_s = std::sqrt(2.0 * kHeight / kG);
  while (scene.time_s() < 2.0 * fall_s) {
    scene.step();
    const ComponentSample& box = scene.sample("Box");
    const double z = box.p_WB.z(), v = box.V_WB.v.z();
    lowest = std::min(lowest, v);
    if (scene.time_s() > fall_s && z >= 0.0 && v > 0.0) highest = std::max(highest, 0.5 * v * v + kG * z);
  }
  return {std::sqrt(highest / (kG * kHeight)), scene.work()};
}

/// Way (m) of the slab of sliding_block.yaml, thrown along the plate at 1 m/s: v^2 / (2 mu g) = 0.16995 m.
inline SolverFigure stopping_distance(const SolverSetting& setting) {
  WatchedScene scene("sliding_block", setting, {});
  while (scene.time_s() < 0.6 - 1e-9) scene.step();
  return {scene.sample("Slab").p_WB.x() + 0.2, scene.work()};
}

/// Way (m) of the block Slides down its slope of 20 degrees in 0.5 s, from rest, where friction holds up to
/// 19 degrees.
inline SolverFigure way_above_friction_angle(const SolverSetting& setting, const std::string& law) {
  const double friction = std::tan(19.0 * std::numbers::pi / 180.0);
  WatchedScene scene("incline", setting,
                     {"contact.defaults.friction_law=" + law,
                      "contact.pairs=[{pair: [Holds, Incline], friction: 0.5}, {pair: [Slides, Incline], "
                      "friction: " +
                          std::to_string(friction) + "}]"});
  const Vec3 begin = scene.sample("Slides").p_WB;
  while (scene.time_s() < 0.5 - 1e-9) scene.step();
  return {(scene.sample("Slides").p_WB - begin).norm(), scene.work()};
}

}  // namespace takt::test

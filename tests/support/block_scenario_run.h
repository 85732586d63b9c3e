#pragma once
// A whole run of one of the block scenarios (config/scenarios), in process, with the results that its tests
// need.
#include <cmath>
#include <filesystem>
#include <functional>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "server/headless/headless_run.h"
#include "server/scenario/scenario_builder.h"
#include "server/simulation/model/cell_model.h"
#include "tests/support/constants.h"

namespace takt::test {

// How the assembled parts sit in one another, from the drawings.
inline const Vec3 kP_in_O(0.015, 0.0, 0.030), kC_in_B(-0.060, 0.0, 0.020), kO_in_B(0.040, 0.0, 0.020);

struct BlockRun {
  Scenario scenario;
  std::shared_ptr<const CellModel> cell;
  HeadlessResult result;
  std::uint64_t lost_part_steps = 0;  ///< steps in which a Part had no partner

  int id(const std::string& name) const { return cell->description.find_component(name); }
  const ComponentSample& sample(const Snapshot& snapshot, const std::string& name) const {
    return snapshot.components[static_cast<std::size_t>(id(name))];
  }
  Pose pose(const Snapshot& snapshot, const std::string& name) const {
    const ComponentSample& s = sample(snapshot, name);
    return Pose::from_quaternion(s.p_WB, s.q_WB);
  }
  /// Origin of `part` in the frame of `base`.
  Vec3 relative(const Snapshot& snapshot, const std::string& part, const std::string& base) const {
    return pose(snapshot, base).inverse() * sample(snapshot, part).p_WB;
  }
  const Snapshot& mark(double time_s) const {
    for (const ReportedInstant& m : result.report_at) {
      if (std::abs(m.instant.time_s - time_s) < 1e-9) return m.snapshot;
    }
    throw std::out_of_range("no mark at this time");
  }
  /// Time of the first change of `part` from `from` to `to` after `after_s`, or NaN.
  double change(const std::string& part, const std::string& from, const std::string& to,
                double after_s = -1.0) const {
    for (const ConnectionChange& c : result.changes) {
      if (c.part == id(part) && c.from == id(from) && c.to == id(to) && c.time_s > after_s) return c.time_s;
    }
    return std::nan("");
  }
  /// Moment that the weights of these parts exert about the origin of `gripper`, in the world frame.
  Vec3 moment_of_weights(const Snapshot& snapshot, const std::vector<std::string>& parts,
                         const std::string& gripper) const {
    Vec3 moment = Vec3::Zero();
    for (const std::string& part : parts) {
      const Component& c = cell->components[static_cast<std::size_t>(id(part))];
      const Vec3 p_Wcm = pose(snapshot, part) * c.p_BBcm;
      moment += (p_Wcm - sample(snapshot, gripper).p_WB).cross(Vec3(0.0, 0.0, -c.mass_kg * kGravity_m_s2));
    }
    return moment;
  }
};

/// Called after every step but not with the initial state.
using SnapshotObserver = std::function<void(const CellModel&, const Snapshot&)>;

/// Runs config/scenarios/NAME.yaml with its own program over its own duration.
inline BlockRun run_block_scenario(const std::string& name, const std::vector<std::string>& overrides = {},
                                   const SnapshotObserver& observer = {}) {
  BlockRun r;
  ScenarioOptions options;
  options.overrides = overrides;
  r.scenario =
      read_scenario(std::filesystem::path(TAKT_CONFIG_DIR) / "scenarios" / (name + ".yaml"), options);
  r.cell = build_cell(r.scenario);
  Simulation simulation(r.cell);
  HeadlessOptions headless;
  headless.duration_s = r.scenario.duration_s;
  headless.program = r.scenario.controller_program;
  Snapshot snapshot = simulation.make_snapshot();
  r.result = run_headless(simulation, r.scenario, headless, [&](const Simulation& s) {
    if (s.step_index() == 0) return;
    s.read_snapshot(snapshot);
    for (const RigidBodyParameters& part : r.cell->parts) {
      if (snapshot.components[static_cast<std::size_t>(part.body)].partner < 0) ++r.lost_part_steps;
    }
    if (observer) observer(*r.cell, snapshot);
  });
  return r;
}

}  // namespace takt::test

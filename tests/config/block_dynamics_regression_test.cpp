// The block scenarios at LoD 2 from start to end: dynamic robots with simplified drives. Places against the
// analytic ones, the load on the flange against statics (thesis 5.2.1), torques against their limits, energy
// against the power it is the integral of.
#include <gtest/gtest.h>

#include <algorithm>

#include "tests/support/block_scenario_run.h"

namespace takt {
namespace {

using test::BlockRun;
using test::kGravity_m_s2;

struct Recorded {
  BlockRun run;
  double lowest_load_N = 1e9,
         highest_load_N = -1e9;  ///< on the flange of Robot2, over the second before 9.8 s
  double load_at_mark_N = 0.0;
  double largest_relative_torque = 0.0;
  std::vector<double> electrical_J, mechanical_J;  ///< by robot: power summed by the trapezoidal rule
};

Recorded record(const std::string& scenario, const std::string& solver) {
  Recorded r;
  std::vector<double> last_electrical, last_mechanical;
  r.run = test::run_block_scenario(
      scenario, {"processes.assembly.level_of_detail=2", "solver.method=" + solver},
      [&](const CellModel& cell, const Snapshot& s) {
        const std::size_t count = s.robots.size();
        if (r.electrical_J.empty()) {
          r.electrical_J.assign(count, 0.0), r.mechanical_J.assign(count, 0.0);
          last_electrical.assign(count, 0.0), last_mechanical.assign(count, 0.0);
          for (std::size_t i = 0; i < count; ++i) {  // the first interval, from the state at rest
            last_electrical[i] = s.robots[i].power.electrical_W;
            last_mechanical[i] = s.robots[i].power.mechanical_total_W;
          }
        }
        for (std::size_t i = 0; i < count; ++i) {
          const RobotSample& robot = s.robots[i];
          r.electrical_J[i] += 0.5 * cell.step_s * (last_electrical[i] + robot.power.electrical_W);
          r.mechanical_J[i] += 0.5 * cell.step_s * (last_mechanical[i] + robot.power.mechanical_total_W);
          last_electrical[i] = robot.power.electrical_W;
          last_mechanical[i] = robot.power.mechanical_total_W;
          const auto& joints = cell.description.robots[i].arm.joints;
          for (std::size_t j = 0; j < joints.size(); ++j)
            r.largest_relative_torque =
                std::max(r.largest_relative_torque, std::abs(robot.effort[j]) / joints[j].max_effort);
        }
        const double load = -s.robots[1].flange_load_W.f.z();
        if (s.time_s > 8.8 && s.time_s <= 9.8 + 1e-9) {
          r.lowest_load_N = std::min(r.lowest_load_N, load);
          r.highest_load_N = std::max(r.highest_load_N, load);
          r.load_at_mark_N = load;
        }
      });
  return r;
}

void expect_good(const Recorded& r) {
  ASSERT_EQ(r.run.result.fault, "");
  EXPECT_EQ(r.run.lost_part_steps, 0U);
  ASSERT_EQ(r.run.scenario.expected.size(), 4U);
  for (const ExpectedPose& expected : r.run.scenario.expected) {
    const ComponentSample& sample = r.run.sample(r.run.result.final_state, expected.part);
    EXPECT_LE(pose_error(sample, expected.X_WB).position_m, 1e-4) << expected.part;
  }
  EXPECT_GT(r.largest_relative_torque, 0.05);
  EXPECT_LT(r.largest_relative_torque, 0.999);  // no drive is at its limit
  for (std::size_t i = 0; i < 2; ++i) {
    const RobotPower& power = r.run.result.final_state.robots[i].power;
    EXPECT_GT(power.electrical_energy_J, 90.0 * 42.0);  // idle power alone
    EXPECT_NEAR(power.electrical_energy_J, r.electrical_J[i], 1e-3 * r.electrical_J[i]);
    EXPECT_NEAR(power.mechanical_energy_J, r.mechanical_J[i], 1e-3 * r.electrical_J[i]);
  }
}

TEST(BlockDynamics, TheAssemblyEndsAtTheAnalyticPlacesAndTheFlangeCarriesTheWeight) {
  const Recorded r = record("block_assembly", "rk2");
  expect_good(r);
  // (5.21): Gripper2 (3 kg) holds C (0.5 kg) still above B.
  EXPECT_NEAR(r.load_at_mark_N, (0.5 + 3.0) * kGravity_m_s2, 1e-4);
  EXPECT_LT(r.highest_load_N - r.lowest_load_N, 1e-3);
}

TEST(BlockDynamics, TheAssemblyEndsAtItsPlacesByTheLinearlyImplicitSolver) {
  const Recorded r = record("block_assembly", "implicit");
  expect_good(r);
  EXPECT_NEAR(r.load_at_mark_N, (0.5 + 3.0) * kGravity_m_s2, 1e-4);
}

TEST(BlockDynamics, TheDisassemblyEndsAtTheAnalyticPlaces) {
  expect_good(record("block_disassembly", "rk2"));
}

TEST(BlockDynamics, RepeatedRunsGiveTheSameBits) {
  const auto hash = [] {
    return test::run_block_scenario("block_assembly",
                                    {"processes.assembly.level_of_detail=2", "duration_s=6"})
        .result.final_state.state_hash;
  };
  EXPECT_EQ(hash(), hash());
}

}  // namespace
}  // namespace takt

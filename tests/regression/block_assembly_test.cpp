// The block scenario at LoD 1 from start to end: final places against the analytic ones, the published times,
// who holds whom at every step, and the loads that follow from statics.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>

#include "server/headless/headless_run.h"
#include "server/headless/report.h"
#include "server/scenario/scenario_builder.h"

namespace takt {
namespace {

const std::filesystem::path kScenario =
    std::filesystem::path(TAKT_CONFIG_DIR) / "scenarios" / "block_assembly.yaml";
constexpr double kGravity = 9.80665;

struct Outcome {
  Scenario scenario;
  std::shared_ptr<const CellModel> cell;
  HeadlessResult result;
  std::uint64_t lost_part_steps = 0;  ///< steps in which a Part had no partner

  int id(const std::string& name) const { return cell->description.find_component(name); }
  const ComponentSample& sample(const Snapshot& snapshot, const std::string& name) const {
    return snapshot.components[static_cast<std::size_t>(id(name))];
  }
  const Snapshot& mark(double time_s) const {
    for (const MarkRecord& m : result.marks) {
      if (std::abs(m.mark.time_s - time_s) < 1e-9) return m.snapshot;
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
};

Outcome run(const std::vector<std::string>& overrides = {}) {
  Outcome r;
  ScenarioOptions options;
  options.overrides = overrides;
  r.scenario = read_scenario(kScenario, options);
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
  });
  return r;
}

const Outcome& reference() {
  static const Outcome r = run();
  return r;
}

TEST(BlockAssembly, EndsAtTheAnalyticPlaces) {
  const Outcome& r = reference();
  ASSERT_EQ(r.result.fault, "");
  EXPECT_NEAR(r.result.final_state.time_s, 42.0, 1e-9);
  ASSERT_EQ(r.scenario.expected.size(), 4U);
  for (const ExpectedPose& expected : r.scenario.expected) {
    const ComponentSample& sample = r.sample(r.result.final_state, expected.part);
    EXPECT_LE(pose_error(sample, expected.X_WB).position_m, 1e-6) << expected.part;  // asked for: 1e-4
    EXPECT_LE(pose_error(sample, expected.X_WB).angle_rad, 1e-6) << expected.part;
    EXPECT_EQ(sample.partner, r.id("Table2")) << expected.part;
    EXPECT_EQ(sample.state, PartState::assembled) << expected.part;
  }
}

TEST(BlockAssembly, EveryPartHasExactlyOnePartnerAtEveryStep) {
  EXPECT_EQ(reference().lost_part_steps, 0U);
}

TEST(BlockAssembly, PublishedTimes) {
  const Outcome& r = reference();
  const double tolerance = 0.05;
  EXPECT_NEAR(r.change("P", "Table1", "Gripper1"), 3.8, tolerance);
  EXPECT_NEAR(r.change("P", "Gripper1", "Table1"), 9.9, tolerance);
  EXPECT_NEAR(r.change("C", "Table1", "Gripper2"), 4.9, tolerance);
  EXPECT_NEAR(r.change("C", "Gripper2", "Table1"), 11.0, tolerance);
  // P rides with O: both are carried by Gripper1, directly.
  EXPECT_NEAR(r.change("O", "Table1", "Gripper1"), 16.0, tolerance);
  EXPECT_NEAR(r.change("P", "Table1", "Gripper1", 10.0), 16.0, tolerance);
  EXPECT_NEAR(r.change("O", "Gripper1", "Table1"), 22.8, tolerance);
  EXPECT_NEAR(r.change("P", "Gripper1", "Table1", 10.0), 22.8, tolerance);
  for (const char* part : {"P", "C", "O", "B"}) {
    EXPECT_NEAR(r.change(part, "Table1", "Gripper2", 25.0), 31.2, tolerance) << part;
    EXPECT_NEAR(r.change(part, "Gripper2", "Table2"), 38.2, tolerance) << part;
  }
  EXPECT_EQ(r.result.changes.size(), 4U + 4U + 4U + 8U) << "connections changed at other times too";
}

TEST(BlockAssembly, PublishedMarks) {
  const Outcome& r = reference();
  const auto relative = [&](const Snapshot& s, const std::string& part, const std::string& base) {
    const ComponentSample& b = r.sample(s, base);
    return Vec3(Pose::from_quaternion(b.p_WB, b.q_WB).inverse() * r.sample(s, part).p_WB);
  };
  const Vec3 P_in_O(0.015, 0.0, 0.030), C_in_B(-0.060, 0.0, 0.020), O_in_B(0.040, 0.0, 0.020);
  EXPECT_LE((relative(r.mark(9.8), "P", "O") - P_in_O).norm(), 1e-6);
  EXPECT_GT(relative(r.mark(9.8), "C", "B").z(), 0.060) << "C is still above B";
  EXPECT_LE((relative(r.mark(10.9), "C", "B") - C_in_B).head<2>().norm(), 1e-6);
  EXPECT_LT(relative(r.mark(10.9), "C", "B").z(), 0.060) << "C is inside B";
  EXPECT_GT(relative(r.mark(20.5), "O", "B").z(), 0.060);
  EXPECT_LE((relative(r.mark(20.5), "O", "B") - O_in_B).head<2>().norm(), 1e-6);
  EXPECT_LE((relative(r.mark(20.5), "P", "O") - P_in_O).norm(), 1e-6);
  for (const double t : {27.0, 38.0}) {
    EXPECT_LE((relative(r.mark(t), "C", "B") - C_in_B).norm(), 1e-6) << t;
    EXPECT_LE((relative(r.mark(t), "O", "B") - O_in_B).norm(), 1e-6) << t;
    EXPECT_LE((relative(r.mark(t), "P", "O") - P_in_O).norm(), 1e-6) << t;
  }
}

TEST(BlockAssembly, SteadyLoads) {
  const Outcome& r = reference();
  // Gripper2 carries C.
  const Wrench& F2 = r.sample(r.mark(9.8), "Gripper2").F_Bo_W;
  EXPECT_NEAR(F2.f.z(), -0.5 * kGravity, 1e-6);
  EXPECT_LE(F2.f.head<2>().norm(), 1e-6);
  // Gripper1 carries P and O; their common centre of mass is not below it.
  const Snapshot& s = r.mark(20.5);
  const ComponentSample& palm = r.sample(s, "Gripper1");
  Vec3 moment = Vec3::Zero();
  for (const char* part : {"P", "O"}) {
    const Component& c = r.cell->components[static_cast<std::size_t>(r.id(part))];
    const ComponentSample& sample = r.sample(s, part);
    const Vec3 p_Wcm = Pose::from_quaternion(sample.p_WB, sample.q_WB) * c.p_BBcm;
    moment += (p_Wcm - palm.p_WB).cross(Vec3(0.0, 0.0, -c.mass_kg * kGravity));
  }
  EXPECT_NEAR(palm.F_Bo_W.f.z(), -1.1 * kGravity, 1e-6);
  EXPECT_LE((palm.F_Bo_W.t - moment).norm(), 1e-6);
  EXPECT_GT(moment.norm(), 0.01);
}

TEST(BlockAssembly, ThesisLawSagsATenthOfAMillimetrePerRegrasp) {
  const Outcome r = run({"interaction.weight_feed_forward=false"});
  ASSERT_EQ(r.result.fault, "");
  EXPECT_EQ(r.lost_part_steps, 0U);
  // Each connection starts at zero force and sags by m g / k = 0.1 mm. B hangs on Table1, Gripper2, Table2; C
  // on Table1, Gripper2, Table1, Gripper2, Table2; O likewise with Gripper1; P on two more.
  const std::map<std::string, int> connections{{"B", 3}, {"C", 5}, {"O", 5}, {"P", 7}};
  for (const ExpectedPose& expected : r.scenario.expected) {
    const ComponentSample& sample = r.sample(r.result.final_state, expected.part);
    EXPECT_NEAR(sample.p_WB.z() - expected.X_WB.p.z(), -1e-4 * connections.at(expected.part), 2e-6)
        << expected.part;
    EXPECT_LE((sample.p_WB - expected.X_WB.p).norm(), 1e-3) << "the thesis' criterion (5.19)";
  }
}

TEST(BlockAssembly, HoldsUpToTheThesisLargestStep) {
  const Outcome r = run({"solver.step_s=0.005"});
  ASSERT_EQ(r.result.fault, "");
  EXPECT_EQ(r.lost_part_steps, 0U);
  EXPECT_LE(max_position_error_m(r.scenario, r.cell->description, r.result.final_state), 1e-4);
}

TEST(BlockAssembly, PlainHullsWorkTooAsInTheThesis) {
  const Outcome r = run({"parts.O.convex=hull", "parts.B.convex=hull"});
  ASSERT_EQ(r.result.fault, "");
  EXPECT_EQ(r.lost_part_steps, 0U);
  EXPECT_LE(max_position_error_m(r.scenario, r.cell->description, r.result.final_state), 1e-4);
}

TEST(BlockAssembly, SameBitsInEveryRun) {
  const Outcome second = run();
  EXPECT_EQ(second.result.final_state.state_hash, reference().result.final_state.state_hash);
}

}  // namespace
}  // namespace takt

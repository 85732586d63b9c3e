// Grips by surface contact: creep of the regularised law against its closed form, none with the stick law.
// And every scene of the library ends at its stated places.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>

#include "tests/support/block_scenario_run.h"

namespace takt {
namespace {

/// How far P comes down relative to Gripper1 between two instants while it is held.
double slip_m(const std::vector<std::string>& overrides, double begin_s, double end_s) {
  double first = 0.0, last = 0.0;
  const test::BlockRun r = test::run_block_scenario(
      "contact/grasp_and_lift", overrides, [&](const CellModel& cell, const Snapshot& s) {
        const auto height = [&](const char* name) {
          return s.components[static_cast<std::size_t>(cell.description.find_component(name))].p_WB.z();
        };
        const double above = height("Gripper1/left_jaw") - height("P");
        if (s.time_s <= begin_s + 1e-9) first = above;
        if (s.time_s <= end_s + 1e-9) last = above;
      });
  EXPECT_EQ(r.result.fault, "");
  return last - first;
}

TEST(ContactGrip, PadsCreepAsTheRegularisedLawPredictsAndStickWithoutCreep) {
  const std::vector<std::string> exact{"solver.method=cvode", "solver.tolerance=1e-8"};
  // Two pads of N each carry m g with mu N (2 s - s^2): v = m g v_eps / (4 mu N) for small s = v / v_eps.
  std::vector<std::string> regularised = exact;
  regularised.push_back(
      "contact.grippers={friction: 0.9, friction_law: regularised, friction_velocity_m_per_s: 1.0e-4}");
  const double expected = 0.3 * test::kGravity_m_s2 * 1e-4 / (4.0 * 0.9 * 150.0);
  EXPECT_NEAR(slip_m(regularised, 7.0, 10.0) / 3.0, expected, 0.05 * expected);
  EXPECT_LE(std::abs(slip_m(exact, 6.0, 11.0)), 1e-7);
}

TEST(ContactGrip, TheCommandedForceDecidesWhetherTheBlockIsLifted) {
  // Two pads carry m g with friction 0.9: 1.64 N of each.
  const auto lifted_m = [](double force_N, double& pressed_N) {
    const test::BlockRun r = test::run_block_scenario(
        "contact/grasp_and_lift", {"controller.parameters.grip_force_N=" + std::to_string(force_N)},
        [&](const CellModel&, const Snapshot& s) {
          if (s.time_s <= 4.1) pressed_N = s.grippers[0].force_N;
        });
    EXPECT_EQ(r.result.fault, "");
    return r.sample(r.result.final_state, "P").p_WB.z() - 0.7;
  };
  double pressed_N = 0.0;
  EXPECT_NEAR(lifted_m(40.0, pressed_N), 0.15, 2e-4);
  EXPECT_NEAR(pressed_N, 40.0, 0.4);
  EXPECT_NEAR(lifted_m(1.2, pressed_N), 0.0, 2e-3);
  EXPECT_NEAR(pressed_N, 1.2, 0.02);
}

TEST(ContactScenes, EachSceneEndsAtItsDocumentedPose) {
  namespace fs = std::filesystem;
  for (const auto& entry : fs::directory_iterator(fs::path(TAKT_CONFIG_DIR) / "scenarios" / "contact")) {
    SCOPED_TRACE(entry.path());
    const test::BlockRun r = test::run_block_scenario("contact/" + entry.path().stem().string());
    EXPECT_EQ(r.result.fault, "");
    for (const ExpectedPose& expected : r.scenario.expected) {
      const PoseError error = pose_error(r.sample(r.result.final_state, expected.part), expected.X_WB);
      EXPECT_LE(error.position_m, r.scenario.expected_tolerance_m) << expected.part;
    }
  }
}

TEST(ContactScenes, APressFitHoldsThePredictedForce) {
  // Pressure k u = 13462 Pa on 1771 mm^2 with friction 0.3: 7.15 N.
  const double holds_N = 7.15;
  const auto fallen_m = [](double weight_N) {
    const test::BlockRun r = test::run_block_scenario(
        "contact/press_fit",
        {"parts.Light.mass_kg=" + std::to_string(weight_N / test::kGravity_m_s2), "duration_s=0.5"});
    EXPECT_EQ(r.result.fault, "");
    return 0.085 - r.sample(r.result.final_state, "Light").p_WB.z();
  };
  EXPECT_LE(fallen_m(0.95 * holds_N), 5e-5);  // let go at once, it swings to nearly twice its weight
  EXPECT_GE(fallen_m(1.05 * holds_N), 1e-3);
}

}  // namespace
}  // namespace takt

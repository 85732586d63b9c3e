// A nut on its bolt against the closed form of the rigid screw.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "server/headless/headless_run.h"
#include "server/scenario/scenario_builder.h"

namespace takt {
namespace {

constexpr double kLead_m = 0.002;

struct ScrewRun {
  double turned_rad = 0.0, travel_m = 0.0, inertia_m2 = 0.0, g = 0.0;
};

ScrewRun run_screw(const std::string& scene, double duration_s,
                   const std::vector<std::string>& overrides = {}) {
  ScenarioOptions read;
  read.overrides = overrides;
  const Scenario scenario = read_scenario(
      std::filesystem::path(TAKT_CONFIG_DIR) / "scenarios" / "contact" / (scene + ".yaml"), read);
  const auto cell = build_cell(scenario);
  Simulation simulation(cell);
  HeadlessOptions options;
  options.duration_s = duration_s;
  const HeadlessResult result = run_headless(simulation, scenario, options);
  EXPECT_EQ(result.fault, "");
  const ComponentSample& nut =
      result.final_state.components[static_cast<std::size_t>(cell->description.find_component("Nut"))];
  const Mat3 R = nut.q_WB.toRotationMatrix();
  return {std::atan2(R(1, 0), R(0, 0)), nut.p_WB.z() - cell->parts[0].X_WB_initial.p.z(),
          cell->parts[0].I_BBcm_B(2, 2) / cell->parts[0].mass_kg, -scenario.gravity_m_per_s2.z()};
}

TEST(Screw, WithoutFrictionANutTurnsDownAsTheRigidScrewDoes) {
  constexpr double kDuration_s = 0.15, kLever_m = kLead_m / (2.0 * std::numbers::pi);
  const ScrewRun nut = run_screw("nut_runs_down", kDuration_s);
  const double expected =
      -0.5 * kDuration_s * kDuration_s * nut.g * kLever_m / (nut.inertia_m2 + kLever_m * kLever_m);
  EXPECT_NEAR(nut.turned_rad, expected, 0.02 * std::abs(expected));
  EXPECT_NEAR(nut.travel_m, kLever_m * nut.turned_rad, 5e-6);
}

TEST(Screw, AboveTheLimitFrictionHoldsIt) {
  const ScrewRun nut = run_screw("nut_locks", 0.1);
  EXPECT_NEAR(nut.turned_rad, 0.0, 2e-3);
  EXPECT_NEAR(nut.travel_m, 0.0, 5e-6);
}

/// `cvode` searches at each evaluation. Steps four times shorter have a sixteenth of the error by a method of order 2; of
/// order 1 a fourth. Patches that were held too long would leave an error that no step makes smaller.
TEST(Screw, HeldPatchesKeepTheOrderOfTheMethod) {
  constexpr double kDuration_s = 0.1;
  const double reference =
      run_screw("nut_runs_down", kDuration_s, {"solver.method=cvode", "solver.tolerance=1e-8"}).turned_rad;
  double longer = 0.0;
  for (const char* step : {"0.002", "0.0005", "0.000125"}) {
    const double error =
        run_screw("nut_runs_down", kDuration_s, {std::string("solver.step_s=") + step}).turned_rad -
        reference;
    RecordProperty(step, std::to_string(error));
    if (longer > 0.0) {
      EXPECT_LT(std::abs(error), longer / 8.0) << step;
    }
    longer = std::abs(error);
  }
  EXPECT_LT(longer, 5e-5);
}

}  // namespace
}  // namespace takt

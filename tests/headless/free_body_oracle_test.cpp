// A box that turns freely about its middle axis tips over again and again (Dzhanibekov, Poinsot): a small error grows with each
// turn. A cell that names no solver is compared with Euler's equations, integrated here in steps of 20 us, and with the
// angular momentum, which is constant in the world.
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>

#include "server/headless/headless_run.h"
#include "server/scenario/scenario_builder.h"
#include "tests/performance/box_file.h"
#include "tests/support/temporary_directory.h"

namespace takt {
namespace {

constexpr double kDuration_s = 5.0;
// Of a box of 0.2 x 0.1 x 0.04 m and 1 kg about its centre.
const Vec3 kInertia_kg_m2 = Vec3(0.01 + 0.0016, 0.04 + 0.0016, 0.04 + 0.01) / 12.0;
const Vec3 kSpin_rad_per_s(0.01, 10.0, 0.0);

struct Turning {
  Eigen::Quaterniond q_WB = Eigen::Quaterniond::Identity();
  Vec3 w_B = kSpin_rad_per_s;
};

Turning rate(const Turning& at) {
  const Vec3 momentum = kInertia_kg_m2.cwiseProduct(at.w_B);
  Turning of;
  of.w_B = momentum.cross(at.w_B).cwiseQuotient(kInertia_kg_m2);
  of.q_WB.coeffs() = 0.5 * (at.q_WB * Eigen::Quaterniond(0.0, at.w_B.x(), at.w_B.y(), at.w_B.z())).coeffs();
  return of;
}

Turning after(const Turning& at, const Turning& rate, double h) {
  Turning next;
  next.w_B = at.w_B + h * rate.w_B;
  next.q_WB.coeffs() = at.q_WB.coeffs() + h * rate.q_WB.coeffs();
  return next;
}

/// Classical Runge-Kutta. `least`: the least speed about the middle axis on the way.
Turning turned(double duration_s, double& least) {
  constexpr int kSteps = 250'000;
  const double h = duration_s / kSteps;
  Turning at;
  for (int i = 0; i < kSteps; ++i) {
    const Turning k1 = rate(at), k2 = rate(after(at, k1, 0.5 * h)), k3 = rate(after(at, k2, 0.5 * h)),
                  k4 = rate(after(at, k3, h));
    for (const auto& [k, share] : {std::pair(k1, 1.0), {k2, 2.0}, {k3, 2.0}, {k4, 1.0}})
      at = after(at, k, share * h / 6.0);
    at.q_WB.normalize();
    least = std::min(least, at.w_B.y());
  }
  return at;
}

TEST(FreeBody, ABoxTurnsAsEulersEquationsSayWithTheDefaultSolver) {
  const test::TemporaryDirectory directory;
  bench::write_box(directory.path() / "box.obj", {-0.1, -0.05, -0.02}, {0.1, 0.05, 0.02});
  const auto file = directory.path() / "free.yaml";
  std::ofstream(file) << "takt_scenario: 1\nname: free\nworld: {gravity_m_per_s2: [0, 0, 0]}\nparts:\n"
                         "  Box: {mesh: box.obj, mass_kg: 1, hierarchy: 1,\n"
                         "        twist: {angular_velocity_rad_per_s: [0.01, 10, 0]}}\n";
  double least = 0.0;
  const Turning expected = turned(kDuration_s, least);
  ASSERT_LT(least, -9.9) << "it has not tipped over";
  for (const char* step_s : {"0.001", "0.02"}) {
    ScenarioOptions options;
    options.overrides = {std::string("solver.step_s=") + step_s};
    const Scenario scenario = read_scenario(file, options);
    Simulation simulation(build_cell(scenario));
    HeadlessOptions run;
    run.duration_s = kDuration_s;
    const HeadlessResult result = run_headless(simulation, scenario, run);
    ASSERT_EQ(result.fault, "");
    const ComponentSample& box = result.final_state.components.front();
    EXPECT_LE(box.q_WB.angularDistance(expected.q_WB), 2e-5) << step_s;
    const Vec3 momentum = box.q_WB * kInertia_kg_m2.cwiseProduct(box.q_WB.conjugate() * box.V_WB.w);
    EXPECT_LE((momentum - kInertia_kg_m2.cwiseProduct(kSpin_rad_per_s)).norm() / momentum.norm(), 1e-6)
        << step_s;
  }
}

}  // namespace
}  // namespace takt

// Surface contact in whole cells, through Simulation, against closed forms: statics of the elastic layer,
// laws of friction, impacts.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <sstream>

#include "tests/support/contact_meshes.h"
#include "tests/support/contact_scene.h"

namespace takt {
namespace {

using test::kG;
using test::kLayer_Pa_per_m;
using test::library_mesh;
using test::library_scene;
using test::SceneRun;
using test::SceneText;
using test::TemporaryDirectory;

constexpr double kSlab_m2 = 0.058 * 0.058;  // 60 mm with chamfers of 1 mm

TEST(SurfaceContactCell, AWeightSinksIntoTheLayerByItsClosedForm) {
  const TemporaryDirectory directory;
  SceneText text;
  text.parts = "  Slab: {mesh: " + library_mesh("slab") + ", mass_kg: 0.2, hierarchy: 1}";
  text.grounds = "  Plate: {mesh: " + library_mesh("plate") + "}";
  SceneRun scene(load_scene(directory, text));
  ASSERT_TRUE(scene.run_to(1.0));
  const auto contact = scene.contact("Slab", "Plate");
  ASSERT_TRUE(contact);
  const double weight = 0.2 * kG;
  EXPECT_NEAR(contact->result.normal_force_N, weight, 1e-6 * weight);
  EXPECT_NEAR(contact->result.area_m2, kSlab_m2, 1e-3 * kSlab_m2);
  const double sinking = weight / (kLayer_Pa_per_m * kSlab_m2);  // 0.433 um
  EXPECT_NEAR(-scene.sample("Slab").p_WB.z(), sinking, 1e-3 * sinking);
  EXPECT_NEAR(contact->result.largest_penetration_m, sinking, 1e-3 * sinking);
}

// The default solver: by its closed form, with two evaluations in a step and a matrix now and then.
TEST(SurfaceContactCell, CalmStepsCostTwoEvaluationsAndAMatrixNowAndThen) {
  const TemporaryDirectory directory;
  SceneText text;
  text.solver = "{step_s: 0.008}\nsleeping: {method: never}";
  text.parts = "  Slab: {mesh: " + library_mesh("slab") + ", mass_kg: 0.2, hierarchy: 1}";
  text.grounds = "  Plate: {mesh: " + library_mesh("plate") + "}";
  SceneRun scene(load_scene(directory, text));
  ASSERT_TRUE(scene.run_to(0.8));
  const SolverStatistics before = scene.simulation().statistics().solver;
  ASSERT_TRUE(scene.run_to(1.6));
  const SolverStatistics& after = scene.simulation().statistics().solver;
  EXPECT_EQ(after.steps - before.steps, 100U);
  EXPECT_EQ(after.evaluations - before.evaluations, 200U);
  EXPECT_LE(after.jacobians - before.jacobians, 5U);
  const double sinking = 0.2 * kG / (kLayer_Pa_per_m * kSlab_m2);
  EXPECT_NEAR(-scene.sample("Slab").p_WB.z(), sinking, 1e-3 * sinking);
}

/// Of a ball of 25 mm with 8 * 4^levels triangles at rest.
double sinking_of_ball(int levels) {
  const TemporaryDirectory directory;
  directory.write("ball.obj", test::obj_text("ball", test::ball(0.025, levels)));
  SceneText text;
  text.parts = "  Ball: {mesh: ball.obj, mass_kg: 0.5, hierarchy: 1, pose: {position_m: [0, 0, 0.0248]}}";
  text.grounds = "  Plate: {mesh: " + library_mesh("plate") + "}";
  SceneRun scene(load_scene(directory, text));
  EXPECT_TRUE(scene.run_to(0.6));
  return 0.025 - scene.sample("Ball").p_WB.z();
}

TEST(SurfaceContactCell, ABallSinksInToTheClosedFormDepth) {
  // m g = k times the cap's volume pi r u^2. Its triangles lie within the ball by up to an edge^2 / (8 r).
  const double u = std::sqrt(0.5 * kG / (std::numbers::pi * 0.025 * kLayer_Pa_per_m));
  const double coarse = std::abs(sinking_of_ball(4) - u), fine = std::abs(sinking_of_ball(5) - u);
  EXPECT_LE(fine, 0.08 * u);
  EXPECT_LE(fine, 0.4 * coarse);
}

constexpr double kSlope = 20.0 * std::numbers::pi / 180.0;

class FrictionAngle : public testing::TestWithParam<std::string> {};

TEST_P(FrictionAngle, ABlockStaysBelowAndSlidesAboveTheFrictionAngle) {
  const double mu = std::tan(kSlope);
  const auto pairs = [](double holds, double slides) {
    return "contact.pairs=[{pair: [Holds, Incline], friction: " + std::to_string(holds) +
           "}, {pair: [Slides, Incline], friction: " + std::to_string(slides) + "}]";
  };
  SceneRun scene(library_scene("incline", {"contact.defaults.friction_law=" + GetParam(),
                                           "solver.tolerance=1e-6", pairs(1.02 * mu, 0.9 * mu)}));
  ASSERT_TRUE(scene.run_to(0.1));
  const double v1 = scene.sample("Slides").V_WB.v.norm();
  const Vec3 at = scene.sample("Holds").p_WB;
  ASSERT_TRUE(scene.run_to(0.4));
  const double v2 = scene.sample("Slides").V_WB.v.norm();
  // Pressure acts along the slope's normal, though friction tips the block forward into the layer.
  const double slides = 0.9 * mu, c = kG * std::cos(kSlope);
  EXPECT_NEAR((v2 - v1) / 0.3, kG * std::sin(kSlope) - slides * c, 1e-5);
  // Regularised: mu (2 s - s^2) = tan, s the speed over v_eps (1 mm/s).
  const double crept = (scene.sample("Holds").p_WB - at).norm();
  if (GetParam() == "stick") {
    EXPECT_LE(crept, 2e-8);
  } else {
    const double creep = 0.001 * (1.0 - std::sqrt(1.0 - 1.0 / 1.02));
    EXPECT_NEAR(crept / 0.3, creep, 2e-3 * creep);
  }
}

INSTANTIATE_TEST_SUITE_P(Laws, FrictionAngle, testing::Values("regularised", "stick"),
                         [](const auto& test) { return test.param; });

TEST(SurfaceContactCell, ASlidingSlabStopsWhereFrictionHasTakenItsEnergy) {
  // Below v_eps the force is mu m g (2 s - s^2): the last part of the way is v_eps^2 ln 2 / (mu g) long.
  const double a = 0.3 * kG, v = 1.0, v_eps = 0.1;
  SceneRun scene(library_scene("sliding_block",
                               {"contact.defaults.friction_velocity_m_per_s=0.1", "solver.tolerance=1e-6"}));
  ASSERT_TRUE(scene.run_to(0.8));
  const double expected = (v * v - v_eps * v_eps) / (2.0 * a) + v_eps * v_eps * std::numbers::ln2 / a;
  EXPECT_NEAR(scene.sample("Slab").p_WB.x() + 0.2, expected, 5e-5);
  EXPECT_GT(std::abs(expected - v * v / (2.0 * a)), 5e-4);  // the correction is seen
}

TEST(SurfaceContactCell, BlocksOnASlopeDoNotCreepWithStick) {
  SceneRun scene(library_scene("incline", {"contact.pairs=[{pair: [\"*\", Incline], friction: 0.5}]"}));
  ASSERT_TRUE(scene.run_to(0.2));
  const Vec3 holds = scene.sample("Holds").p_WB, slides = scene.sample("Slides").p_WB;
  ASSERT_TRUE(scene.run_to(5.2));
  EXPECT_LE((scene.sample("Holds").p_WB - holds).norm(), 1e-8);
  EXPECT_LE((scene.sample("Slides").p_WB - slides).norm(), 1e-8);
}

// A box on its lower edge is in balance where its centre of mass is above the edge, whatever the size of its contact elements.
TEST(SurfaceContactCell, ATallBoxTopplesBeyondItsEdgeAlone) {
  constexpr double kHalfWidth_m = 0.025, kHalfHeight_m = 0.1, kDegree = std::numbers::pi / 180.0;
  const TemporaryDirectory directory;
  std::ostringstream mesh;
  for (int i = 0; i < 8; ++i)
    mesh << "v " << (i & 1 ? 1 : -1) * kHalfWidth_m << ' ' << (i & 2 ? 1 : -1) * kHalfWidth_m << ' '
         << (i & 4 ? 1 : -1) * kHalfHeight_m << '\n';
  mesh << "f 1 3 4 2\nf 5 6 8 7\nf 1 2 6 5\nf 3 7 8 4\nf 1 5 7 3\nf 2 4 8 6\n";
  directory.write("tall.obj", mesh.str());
  const double balance = std::atan(kHalfWidth_m / kHalfHeight_m);
  for (const auto& [from_balance, resample] : {std::pair(-1.2 * kDegree, "auto"),
                                               {1.2 * kDegree, "auto"},
                                               {-1.5 * kDegree, "always"},
                                               {1.5 * kDegree, "always"}}) {
    const double angle = balance + from_balance;
    const double x = -kHalfWidth_m * std::cos(angle) + kHalfHeight_m * std::sin(angle),
                 z = kHalfWidth_m * std::sin(angle) + kHalfHeight_m * std::cos(angle);
    SceneText text;
    text.contact =
        std::string("{defaults: {friction: 0.8}, components: {Box: {resample: ") + resample + "}}}";
    text.parts = "  Box: {mesh: tall.obj, mass_kg: 1, hierarchy: 1, pose: {position_m: [" +
                 std::to_string(x) + ", 0, " + std::to_string(z + 1e-6) + "], rpy_rad: [0, " +
                 std::to_string(angle) + ", 0]}}";
    text.grounds = "  Plate: {mesh: " + library_mesh("plate") + "}";
    SceneRun scene(load_scene(directory, text));
    ASSERT_TRUE(scene.run_to(1.5));
    const double upright = scene.sample("Box").q_WB.toRotationMatrix()(2, 2);
    EXPECT_NEAR(upright, from_balance < 0.0 ? 1.0 : 0.0, 0.01) << from_balance / kDegree << resample;
  }
}

// A ball that slides through the whole impact loses mu times the normal impulse, and turns by its lever: dv = mu J / m,
// dw = 5/2 dv / r. The impact lasts less than a communication step, with damping or almost without.
TEST(SurfaceContactCell, AnObliqueImpactTakesTheImpulseOfFriction) {
  constexpr double kRadius_m = 0.025, kMass_kg = 0.5, kFriction = 0.1, kIn_m_per_s = 0.5;
  for (const char* damping : {"2.5e5", "1e4"}) {
    const TemporaryDirectory directory;
    SceneText text;
    text.contact = std::string("{defaults: {friction: 0.1, areal_damping_N_s_per_m3: ") + damping + "}}";
    text.parts = "  Ball: {mesh: " + library_mesh("sphere") +
                 ", mass_kg: 0.5, hierarchy: 1, pose: {position_m: [-0.05, 0, 0.0251]}, "
                 "twist: {velocity_m_per_s: [1, 0, -0.5]}}";
    text.grounds = "  Plate: {mesh: " + library_mesh("plate") + "}";
    SceneRun scene(load_scene(directory, text));
    const double start_s = scene.simulation().time_s();
    ASSERT_TRUE(scene.run_to(0.04));
    const ComponentSample ball = scene.sample("Ball");
    const double impulse_N_s =
        kMass_kg * (ball.V_WB.v.z() + kIn_m_per_s + kG * (scene.simulation().time_s() - start_s));
    const double lost_m_per_s = kFriction * impulse_N_s / kMass_kg;
    ASSERT_GT(ball.V_WB.v.z(), 0.0);
    EXPECT_NEAR(1.0 - ball.V_WB.v.x(), lost_m_per_s, 0.01 * lost_m_per_s) << damping;
    EXPECT_NEAR(ball.V_WB.w.y(), 2.5 * lost_m_per_s / kRadius_m, 0.03 * 2.5 * lost_m_per_s / kRadius_m)
        << damping;
  }
}

/// Without friction, which takes a few per cent: the layer's normals are not vertical beside the middle.
std::string dropped_ball(const std::string& damping) {
  return "{defaults: {friction: 0, areal_damping_N_s_per_m3: " + damping + "}}";
}

struct Impact {
  double restitution = 0.0, peak_N = 0.0, peak_s = 0.0;
};

/// A ball that meets a plate at 0.5 m/s.
Impact impact(const std::string& damping, const std::string& solver) {
  const TemporaryDirectory directory;
  SceneText text;
  text.solver = solver;
  text.contact = dropped_ball(damping);
  text.parts = "  Ball: {mesh: " + library_mesh("sphere") +
               ", mass_kg: 0.5, hierarchy: 1, pose: {position_m: [0, 0, 0.0251]}, "
               "twist: {velocity_m_per_s: [0, 0, -0.5]}}";
  text.grounds = "  Plate: {mesh: " + library_mesh("plate") + "}";
  SceneRun scene(load_scene(directory, text));
  Impact result;
  double rebound = 0.0;
  std::vector<ContactPeak> peaks;
  scene.simulation().watch_contact_peaks(true);
  while (scene.simulation().time_s() < 0.04 && scene.step()) {
    scene.simulation().read_contact_peaks(peaks);
    for (const ContactPeak& peak : peaks) {
      EXPECT_LE(peak.time_s, scene.simulation().time_s() + 1e-12);
      if (peak.sample.result.normal_force_N > result.peak_N)
        result.peak_N = peak.sample.result.normal_force_N, result.peak_s = peak.time_s;
    }
    rebound = std::max(rebound, scene.sample("Ball").V_WB.v.z());
  }
  result.restitution = rebound / std::sqrt(0.25 + 2.0 * kG * 0.0001);
  return result;
}

TEST(SurfaceContactCell, RestitutionFallsWithDamping) {
  double last = 1.01;  // the ball's triangles let it fall a little further than by its radius
  for (const char* damping : {"1.0e+3", "1.0e+4", "5.0e+4", "2.0e+5", "1.0e+6"}) {
    const double now = impact(damping, "{method: rosenbrock, step_s: 0.001, tolerance: 1.0e-6}").restitution;
    EXPECT_LT(now, last) << damping;
    EXPECT_GE(now, 0.0) << damping;
    last = now;
  }
  EXPECT_LT(last, 0.7);
  EXPECT_GT(impact("1.0e+2", "{method: cvode, step_s: 0.0002, tolerance: 1.0e-8}").restitution, 0.99);
}

TEST(SurfaceContactCell, ThePeakForceOfAnImpactDoesNotDependOnTheTolerance) {
  const double exact = impact("2.5e+5", "{method: cvode, step_s: 0.0001, tolerance: 1.0e-9}").peak_N;
  // Without damping the ball's energy would go into the layer: m v^2 / 2 = pi r k u^3 / 3, F = pi r k u^2.
  const double c = std::numbers::pi * 0.025 * kLayer_Pa_per_m;
  const double elastic = c * std::pow(1.5 * 0.5 * 0.25 / c, 2.0 / 3.0);
  EXPECT_NEAR(exact, elastic, 0.4 * elastic);
  for (const char* solver : {"{method: cvode, step_s: 0.0001, tolerance: 1.0e-6}",
                             "{method: cvode, step_s: 0.0001, tolerance: 1.0e-5}", "{step_s: 0.0001}",
                             "{method: rosenbrock, step_s: 0.0001, tolerance: 1.0e-4}",
                             "{method: rosenbrock, step_s: 0.0001, tolerance: 1.0e-6}"})
    EXPECT_NEAR(impact("2.5e+5", solver).peak_N, exact, 0.01 * exact) << solver;
}

// The ball touches for 2 ms.
TEST(SurfaceContactCell, ThePeakForceOfAnImpactDoesNotDependOnTheCommunicationStep) {
  const Impact exact = impact("2.5e+5", "{method: cvode, step_s: 0.0001, tolerance: 1.0e-9}");
  for (const char* solver : {"{step_s: 0.008}", "{method: rosenbrock, step_s: 0.008, tolerance: 1.0e-4}",
                             "{method: cvode, step_s: 0.008, tolerance: 1.0e-6}",
                             "{method: esdirk, step_s: 0.008, tolerance: 1.0e-6}"}) {
    const Impact coarse = impact("2.5e+5", solver);
    EXPECT_NEAR(coarse.peak_N, exact.peak_N, 0.01 * exact.peak_N) << solver;
    EXPECT_NEAR(coarse.peak_s, exact.peak_s, 2e-4) << solver;
  }
}

TEST(SurfaceContactCell, NoPartTunnelsAtOneMetrePerSecond) {
  for (const double thickness : {0.01, 0.02, 0.04}) {
    for (const char* solver :
         {"{step_s: 0.008}", "{method: rosenbrock, step_s: 0.008, tolerance: 1.0e-4}",
          "{method: cvode, step_s: 0.008, tolerance: 1.0e-6}", "{method: implicit, step_s: 0.001}"}) {
      SCOPED_TRACE(std::string(solver) + " plate of " + std::to_string(thickness) + " m");
      const TemporaryDirectory directory;
      directory.write("plate.obj",
                      test::obj_text("plate", test::moved(test::lattice_box({0.4, 0.2, thickness}, 0.1),
                                                          {Mat3::Identity(), Vec3(0, 0, -0.5 * thickness)})));
      SceneText text;
      text.solver = solver;
      text.parts = "  Box: {mesh: " + library_mesh("block") +
                   ", mass_kg: 0.5, hierarchy: 1, pose: {position_m: [-0.1, 0, 0.02], rpy_deg: [3, 2, 0]}, "
                   "twist: {velocity_m_per_s: [0, 0, -1]}}\n  Ball: {mesh: " +
                   library_mesh("sphere") +
                   ", mass_kg: 0.5, hierarchy: 1, pose: {position_m: [0.1, 0, 0.045]}, "
                   "twist: {velocity_m_per_s: [0, 0, -1]}}";
      text.grounds = "  Plate: {mesh: plate.obj}";
      SceneRun scene(load_scene(directory, text));
      double lowest_box = 1.0, lowest_ball = 1.0;
      while (scene.simulation().time_s() < 0.3 && scene.step()) {
        lowest_box = std::min(lowest_box, scene.sample("Box").p_WB.z());
        lowest_ball = std::min(lowest_ball, scene.sample("Ball").p_WB.z() - 0.025);
      }
      // The ball's energy fits into 1.9 mm of the layer.
      EXPECT_GT(lowest_ball, -0.0025);
      EXPECT_GT(lowest_box, -0.0025);
      EXPECT_LT(lowest_ball, 0.001);  // it was there
    }
  }
}

}  // namespace
}  // namespace takt

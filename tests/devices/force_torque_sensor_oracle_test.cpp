// Force-torque sensors: what they add to a wrench against closed forms and statistics, and the wrench itself against weights,
// momentum and the dynamics of the robot.
#include "server/devices/force_torque_sensor.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "server/headless/in_process_controller.h"
#include "server/scenario/scenario_builder.h"
#include "tests/support/built_programs.h"
#include "tests/support/constants.h"

namespace takt {
namespace {

ForceTorqueSensorParameters quiet() {
  return {};
}
double value_after(SensorChannel& channel, const Wrench& wrench, double period_s) {
  channel.sample(wrench, period_s);
  return channel.values()[0];
}
const Wrench kPull{{10.0, -20.0, 30.0}, {1.0, -2.0, 3.0}};

TEST(SensorChannel, AnIdealSensorReportsTheWrench) {
  SensorChannel channel(quiet());
  channel.sample(kPull, 0.001);
  EXPECT_EQ(channel.values(), (SensorChannel::Values{10.0, -20.0, 30.0, 1.0, -2.0, 3.0}));
  EXPECT_FALSE(channel.overloaded());
}

TEST(SensorChannel, TheFilterAnswersAStepAsFirstOrder) {
  auto p = quiet();
  p.filter_hz = 20.0;
  SensorChannel channel(p);
  channel.sample({}, 0.001);
  for (int k = 1; k <= 50; ++k)
    EXPECT_NEAR(value_after(channel, kPull, 0.001),
                10.0 * (1.0 - std::exp(-2.0 * std::numbers::pi * 20.0 * 0.001 * k)), 1e-12)
        << k;
}

TEST(SensorChannel, NoiseHasItsStandardDeviationAndNoMemory) {
  auto p = quiet();
  p.force.noise = 0.5;
  p.torque.noise = 0.02;
  SensorChannel channel(p);
  constexpr int kSamples = 20000;
  double sum = 0.0, squares = 0.0, products = 0.0, fourth = 0.0, before = 0.0, across = 0.0;
  for (int k = 0; k < kSamples; ++k) {
    channel.sample({}, 0.001);
    const double x = channel.values()[2] / 0.5, y = channel.values()[5] / 0.02;
    sum += x, squares += x * x, fourth += x * x * x * x, products += x * before, across += x * y;
    before = x;
  }
  // Five standard deviations of each estimate.
  const double n = kSamples;
  EXPECT_NEAR(sum / n, 0.0, 5.0 / std::sqrt(n));
  EXPECT_NEAR(squares / n, 1.0, 5.0 * std::sqrt(2.0 / n));
  EXPECT_NEAR(fourth / n, 3.0, 5.0 * std::sqrt(96.0 / n));
  EXPECT_NEAR(products / n, 0.0, 5.0 / std::sqrt(n));
  EXPECT_NEAR(across / n, 0.0, 5.0 / std::sqrt(n));
}

TEST(SensorChannel, DriftIsARandomWalkWhateverTheRate) {
  for (const double period_s : {0.001, 0.01}) {
    double squares = 0.0;
    constexpr int kWalks = 400;
    for (int walk = 0; walk < kWalks; ++walk) {
      auto p = quiet();
      p.seed = static_cast<std::uint64_t>(walk);
      p.force.drift_per_sqrt_s = 2.0;
      SensorChannel channel(p);
      double x = 0.0;
      for (int k = 0; k <= std::lround(0.25 / period_s); ++k) x = value_after(channel, {}, period_s);
      squares += x * x;
    }
    EXPECT_NEAR(squares / kWalks, 4.0 * 0.25, 5.0 * std::sqrt(2.0 / kWalks)) << period_s;
  }
}

TEST(SensorChannel, RangeResolutionBiasAndTare) {
  auto p = quiet();
  p.force.range = 25.0;
  p.force.resolution = 0.25;
  p.force.bias = {0.3, 0.0, 0.0};
  SensorChannel channel(p);
  channel.sample(kPull, 0.001);
  EXPECT_EQ(channel.values()[0], 10.25);
  EXPECT_EQ(channel.values()[2], 25.0) << "30 N are beyond the range";
  EXPECT_EQ(channel.values()[5], 3.0);
  EXPECT_TRUE(channel.overloaded());
  channel.tare();
  channel.sample({{11.0, -20.0, 20.0}, {1.0, -2.0, 3.0}}, 0.001);
  EXPECT_EQ(channel.values(), (SensorChannel::Values{1.0, 0.0, -10.0, 0.0, 0.0, 0.0}));
  EXPECT_FALSE(channel.overloaded());
}

TEST(SensorChannel, TheSameSeedGivesTheSameBitsAlsoAfterARestore) {
  auto p = quiet();
  p.filter_hz = 100.0;
  p.force.noise = p.force.drift_per_sqrt_s = 1.0;
  SensorChannel a(p), b(p);
  for (int k = 0; k < 100; ++k) a.sample(kPull, 0.001);
  std::vector<std::byte> bytes;
  StateWriter out(bytes);
  a.save(out);
  StateReader in(bytes);
  b.load(in);
  for (int k = 0; k < 100; ++k) {
    a.sample(kPull, 0.001);
    b.sample(kPull, 0.001);
    ASSERT_EQ(a.values(), b.values());
  }
  p.seed = 2;
  SensorChannel other(p);
  for (int k = 0; k < 200; ++k) other.sample(kPull, 0.001);
  EXPECT_NE(a.values(), other.values());
}

/// The block scenario with a sensor on each robot, turned and away from the flange.
struct SensedBlock {
  explicit SensedBlock(int level, double rate_hz = 0.0) : scenario(read_scenario(test::kBlockScenario)) {
    for (const char* robot : {"Robot1", "Robot2"}) {
      ScenarioForceTorqueSensor sensor;
      sensor.robot = robot;
      sensor.X_FS = {rotation_from_rpy({0.3, -0.2, 1.1}), {0.01, 0.02, 0.05}};
      sensor.rate_hz = rate_hz;
      scenario.devices.push_back({std::string("FT_") + robot, &device_type("force_torque_sensors"), sensor});
      X_FS = sensor.X_FS;
    }
    for (auto& process : scenario.processes) process.level_of_detail = level;
    simulation = std::make_unique<Simulation>(build_cell(scenario));
    controller = std::make_unique<InProcessController>(scenario.controller_program, *simulation);
    snapshot = simulation->make_snapshot();
  }
  /// One step; afterwards the snapshot is that of its end, and the sensors show the wrench at its begin.
  void step() {
    before = snapshot;
    ASSERT_TRUE(simulation->step(controller->commands(*simulation))) << simulation->fault();
    simulation->read_snapshot(snapshot);
  }
  /// On the flange, about its origin, in the world: from what the sensor shows.
  Wrench shown_W(std::size_t robot) const {
    const auto& values = snapshot.devices[robot].signals;
    const Pose X_WS = flange(robot) * X_FS;
    const Vec3 f = X_WS.R * Vec3(values[0], values[1], values[2]);
    const Vec3 t = X_WS.R * Vec3(values[3], values[4], values[5]);
    return {f, t + (X_WS.p - flange(robot).p).cross(f)};
  }
  /// At the begin of the last step.
  Pose flange(std::size_t robot) const {
    const auto& palm =
        before.components[static_cast<std::size_t>(simulation->description().grippers[robot].component)];
    return Pose::from_quaternion(palm.p_WB, palm.q_WB) *
           simulation->description().grippers[robot].X_FG.inverse();
  }

  Scenario scenario;
  Pose X_FS;
  std::unique_ptr<Simulation> simulation;
  std::unique_ptr<InProcessController> controller;
  Snapshot snapshot, before;
};

TEST(ForceTorqueSensor, ShowsTheWeightOfGripperAndPart) {
  for (const int level : {1, 2}) {
    SensedBlock cell(level);
    while (cell.simulation->time_s() < 9.8) ASSERT_NO_FATAL_FAILURE(cell.step());
    // Gripper2 (3 kg) holds C (0.5 kg) still above B.
    const Vec3 force = cell.shown_W(1).f;
    EXPECT_NEAR(force.z(), -3.5 * test::kGravity_m_s2, 2e-4) << level;
    EXPECT_LT(force.head<2>().norm(), 2e-4) << level;
  }
}

TEST(ForceTorqueSensor, ShowsTheFlangeLoadOfTheDynamics) {
  SensedBlock cell(2);
  double largest = 0.0;
  for (int k = 0; k < 5000; ++k) {
    ASSERT_NO_FATAL_FAILURE(cell.step());
    // A new set-point acts on the drives ahead of the sample, and behind the snapshot before it.
    if (k % 8 == 0) continue;
    for (std::size_t robot : {0U, 1U}) {
      const Wrench expected = cell.before.robots[robot].flange_load_W, shown = cell.shown_W(robot);
      ASSERT_LT((shown.f - expected.f).norm(), 1e-6 * expected.f.norm() + 1e-9) << k;
      ASSERT_LT((shown.t - expected.t).norm(), 1e-6 * expected.f.norm() + 1e-9) << k;
      largest = std::max(largest, (shown.f + Vec3(0.0, 0.0, 3.0 * test::kGravity_m_s2)).norm());
    }
  }
  EXPECT_GT(largest, 1.0) << "the arms accelerate their grippers";
}

// At level 1 the impulse of the flange on the gripper is the change of its momentum less that of its weight.
TEST(ForceTorqueSensor, AtLevelOneTheImpulseIsTheMomentum) {
  SensedBlock cell(1);
  Vec3 impulse = Vec3::Zero(), largest = Vec3::Zero();
  const double step_s = cell.simulation->description().step_s;
  ASSERT_NO_FATAL_FAILURE(cell.step());
  for (int k = 1; k < 3000; ++k) {  // Robot1 moves to P and has not yet gripped it
    ASSERT_NO_FATAL_FAILURE(cell.step());
    const Vec3 inertial = cell.shown_W(0).f + Vec3(0.0, 0.0, 3.0 * test::kGravity_m_s2);
    impulse += inertial * step_s;
    largest = largest.cwiseMax(inertial.cwiseAbs());
  }
  const DynamicRobotParameters& dynamics = cell.simulation->model().dynamics[0]->parameters;
  const auto& gripper = cell.simulation->description().grippers[0];
  Vec3 momentum = Vec3::Zero();
  const auto add = [&](int component, const BodyInertia& body) {
    const ComponentSample& sample = cell.before.components[static_cast<std::size_t>(component)];
    momentum += body.mass_kg * sample.V_WB.at(sample.q_WB * body.p_BBcm_B);
  };
  add(gripper.component, dynamics.grippers[0].palm);
  add(gripper.left_jaw, dynamics.grippers[0].jaw);
  add(gripper.right_jaw, dynamics.grippers[0].jaw);
  EXPECT_GT(largest.maxCoeff(), 1.0);
  // The load is minus the force on the gripper; accelerations of points off the flange are of first order in the step.
  EXPECT_LT((impulse + momentum).norm(), 2e-3 * largest.maxCoeff());
}

TEST(ForceTorqueSensor, SamplesAtItsRateAndKeepsThemInBetween) {
  SensedBlock cell(1, 125.0);
  std::array<double, kMaxSignals> last{};
  int changes = 0;
  for (int k = 0; k < 2000; ++k) {
    ASSERT_NO_FATAL_FAILURE(cell.step());
    const auto& signals = cell.snapshot.devices[0].signals;
    if (signals != last) {
      EXPECT_EQ(k % 8, 0) << k;
      ++changes;
    }
    last = signals;
  }
  EXPECT_GT(changes, 100);
}

TEST(ForceTorqueSensor, IsTheSameAfterARestore) {
  SensedBlock a(1), b(1);
  for (int k = 0; k < 1500; ++k) ASSERT_NO_FATAL_FAILURE(a.step());
  std::vector<std::byte> state;
  a.simulation->save_state(state);
  ASSERT_EQ(b.simulation->restore_state(state), "");
  for (int k = 0; k < 100; ++k) {
    ASSERT_TRUE(a.simulation->step({}));
    ASSERT_TRUE(b.simulation->step({}));
    a.simulation->read_snapshot(a.snapshot);
    b.simulation->read_snapshot(b.snapshot);
    ASSERT_EQ(a.snapshot.devices[0].signals, b.snapshot.devices[0].signals);
  }
}

}  // namespace
}  // namespace takt

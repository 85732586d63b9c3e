// Sensors against closed forms: the instant at which what falls or moves at constant speed crosses a beam, distances,
// weights, temperatures, hysteresis, delays, statistics of the noise; and against all triangles one by one.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>
#include <set>

#include "server/devices/scene_sensors.h"
#include "server/scenario/scenario_builder.h"
#include "server/simulation/model/signals.h"
#include "server/simulation/step/simulation.h"
#include "tests/support/temporary_directory.h"

namespace takt {
namespace {

using ::testing::HasSubstr;

constexpr double kStep_s = 0.001;
constexpr double kSide_m = 0.1;

const std::string kCube =
    "v 0 0 0\nv 0.1 0 0\nv 0.1 0.1 0\nv 0 0.1 0\nv 0 0 0.1\nv 0.1 0 0.1\nv 0.1 0.1 0.1\nv 0 0.1 0.1\n"
    "f 1 4 3\nf 1 3 2\nf 5 6 7\nf 5 7 8\nf 1 2 6\nf 1 6 5\nf 2 3 7\nf 2 7 6\nf 3 4 8\nf 3 8 7\nf 4 1 5\nf 4 "
    "5 8\n";
const std::string kArm = R"(<robot name='r'><link name='base_link'/>
<link name='tool0'><inertial><mass value='2'/><inertia ixx='.1' iyy='.1' izz='.1' ixy='0' ixz='0' iyz='0'/></inertial></link>
<joint name='j' type='revolute'><parent link='base_link'/><child link='tool0'/><axis xyz='0 0 1'/>
<limit lower='-3' upper='3' velocity='2' effort='100'/></joint></robot>)";

std::string head(double gravity) {
  return "takt_scenario: 1\nname: sensors\nworld: {gravity_m_per_s2: [0, 0, " + std::to_string(-gravity) +
         "]}\nsolver: {method: rk2, step_s: 0.001}\n";
}
/// A cube whose corner, its origin, is at `position` and moves with `velocity`.
std::string cube(const std::string& name, const std::string& position,
                 const std::string& velocity = "[0, 0, 0]", const std::string& more = "") {
  return "  " + name + ": {mesh: cube.obj, mass_kg: 1, hierarchy: 2, pose: {position_m: " + position +
         "}, twist: {velocity_m_per_s: " + velocity + "}" + more + "}\n";
}

std::shared_ptr<const CellModel> model_of(const std::string& text) {
  const test::TemporaryDirectory directory;
  directory.write("cube.obj", kCube);
  directory.write("arm.urdf", kArm);
  directory.write("cell.yaml", text);
  return load_cell(directory.path() / "cell.yaml");
}

/// A cell whose sensors show, after a step, the motion at its beginning.
struct Cell {
  explicit Cell(const std::string& text) : model(model_of(text)), simulation(model) {}
  double value(const std::string& name) const {
    const auto found = find_signal(model->description, name);
    EXPECT_TRUE(found) << name;
    return found ? simulation.signal(*found) : std::nan("");
  }
  /// Takes a step and returns the time of the motion that the sensors have seen.
  double step() {
    const double t = simulation.time_s();
    EXPECT_TRUE(simulation.step({})) << simulation.fault();
    return t;
  }
  /// The first time at which the signal has changed to this value, within 1.3 s.
  double time_of(const std::string& name, double wanted) {
    while (simulation.time_s() < 1.3) {
      const double t = step();
      if (value(name) == wanted) return t;
    }
    return std::nan("");
  }
  std::shared_ptr<const CellModel> model;
  Simulation simulation;
};

/// Whether a change was seen in the first step at or after this time.
::testing::AssertionResult first_step_after(double seen, double time) {
  if (seen >= time - 1e-9 && seen < time + kStep_s) return ::testing::AssertionSuccess();
  return ::testing::AssertionFailure() << "seen at " << seen << " s; the closed form has " << time << " s";
}

TEST(LightBarrier, AFallingPartCrossesItAtTheTimeOfFreeFall) {
  // The lower face is 0.5 m above the beam, the upper one 0.6 m.
  for (const double delay_s : {0.0, 0.01}) {
    const std::string delays =
        "on_delay_s: " + std::to_string(delay_s) + ", off_delay_s: " + std::to_string(2.0 * delay_s);
    Cell cell(head(10.0) + "parts:\n" + cube("P", "[0, 0, 1]") +
              "light_barriers: {B: {from_m: [-1, 0.05, 0.5], to_m: [1, 0.03, 0.5], " + delays + "}}\n");
    EXPECT_EQ(cell.value("B.clear"), 1.0);
    EXPECT_TRUE(first_step_after(cell.time_of("B.blocked", 1.0), std::sqrt(2.0 * 0.5 / 10.0) + delay_s));
    EXPECT_EQ(cell.value("B.clear"), 0.0);
    EXPECT_TRUE(
        first_step_after(cell.time_of("B.blocked", 0.0), std::sqrt(2.0 * 0.6 / 10.0) + 2.0 * delay_s));
  }
}

TEST(LightBarrier, ADelayLongerThanThePassageSuppressesIt) {
  // The part is in the beam for 30 ms.
  Cell cell(head(10.0) + "parts:\n" + cube("P", "[0, 0, 1]") +
            "light_barriers: {B: {from_m: [-1, 0.05, 0.5], to_m: [1, 0.05, 0.5], on_delay_s: 0.035}}\n");
  EXPECT_TRUE(std::isnan(cell.time_of("B.blocked", 1.0)));
}

TEST(LightBarrier, OneThatIsCarriedMeetsAPartAtRest) {
  // The beam is 0.2004 m ahead of its carrier and meets the face at x = 1.
  Cell cell(head(0.0) + "parts:\n" + cube("Carrier", "[0, 0, 0]", "[1.25, 0, 0]") + cube("P", "[1, 0, 0]") +
            "light_barriers: {B: {at: Carrier, pose: {position_m: [0.2004, 0, 0]}, from_m: [0, 0.05, -1], "
            "to_m: [0, "
            "0.05, 1]}}\n");
  EXPECT_TRUE(first_step_after(cell.time_of("B.blocked", 1.0), (1.0 - 0.2004) / 1.25));
}

TEST(LightBarrier, GroundsCountWhereSaid) {
  for (const bool sees : {false, true}) {
    Cell cell(head(0.0) + "parts:\n" + cube("P", "[5, 0, 0]") +
              "grounds: {G: {mesh: cube.obj}}\nlight_barriers: {B: {from_m: [0.05, 0.05, -1], to_m: [0.05, "
              "0.04, 1], "
              "sees_grounds: " +
              (sees ? "true" : "false") + "}}\n");
    EXPECT_EQ(cell.value("B.blocked"), sees ? 1.0 : 0.0);
  }
}

TEST(LightCurtain, AFallingPartBreaksTheBeamsBetweenItsFaces) {
  // Beams at z = 0.2, 0.23, ... 0.65; the faces of the part are at 1 - g t^2 / 2 and 0.1 m above. It turns about no axis.
  Cell cell(head(10.0) + "parts:\n" + cube("P", "[0, 0, 1]") + cube("Q", "[0.3, 0, 0.97]") +
            "light_curtains:\n"
            "  C: {pose: {position_m: [-0.5, 0.05, 0.2]}, width_m: 1, beams: 16, pitch_m: 0.03}\n"
            "  Short: {pose: {position_m: [-0.5, 0.04, 0.2]}, width_m: 0.4, beams: 16, pitch_m: 0.03}\n");
  EXPECT_EQ(cell.value("C.clear"), 1.0);
  std::set<double> counts;
  while (cell.simulation.time_s() < 0.45) {
    const double t = cell.step(), lower = 1.0 - 5.0 * t * t;
    int both = 0;
    bool at_an_edge = false;
    for (int beam = 0; beam < 16; ++beam) {
      const double z = 0.2 + 0.03 * beam;
      both += (z > lower && z < lower + kSide_m) || (z > lower - 0.03 && z < lower - 0.03 + kSide_m);
      for (const double face : {lower, lower + kSide_m, lower - 0.03, lower - 0.03 + kSide_m})
        at_an_edge = at_an_edge || std::abs(z - face) < 1e-9;
    }
    if (at_an_edge) continue;
    ASSERT_EQ(cell.value("C.broken_beams"), both) << t;
    ASSERT_EQ(cell.value("C.blocked"), both > 0 ? 1.0 : 0.0) << t;
    ASSERT_EQ(cell.value("C.clear"), both > 0 ? 0.0 : 1.0) << t;
    counts.insert(both);
  }
  EXPECT_GE(counts.size(), 5U);
  EXPECT_EQ(cell.value("Short.broken_beams"), 0.0) << "neither of the parts is within its width";
}

TEST(LightCurtain, MutingHoldsItsOutputClearAndCounts) {
  const std::string text =
      head(10.0) + "parts:\n" + cube("P", "[0, 0, 0.25]") +
      "light_curtains:\n  C: {pose: {position_m: [-0.5, 0.05, 0.2]}, width_m: 1, beams: 4, "
      "pitch_m: 0.03, off_delay_s: 0.003}\n";
  Cell cell(text);
  EXPECT_EQ(cell.value("C.broken_beams"), 2.0);
  EXPECT_EQ(cell.value("C.blocked"), 1.0);
  const auto muting = find_signal(cell.model->description, "C.muting");
  ASSERT_TRUE(muting);
  const auto command = [&](double value) {
    DeviceCommand mute;
    mute.device = muting->device;
    mute.count = 1;
    mute.signals[0] = static_cast<std::uint8_t>(muting->signal);
    mute.values[0] = value;
    const Command commands[] = {mute};
    EXPECT_TRUE(cell.simulation.step(commands)) << cell.simulation.fault();
  };
  command(1.0);
  for (int i = 0; i < 4; ++i) cell.step();
  EXPECT_EQ(cell.value("C.clear"), 1.0);
  EXPECT_EQ(cell.value("C.blocked"), 0.0);
  EXPECT_EQ(cell.value("C.broken_beams"), 2.0);
  command(0.0);
  cell.step();
  EXPECT_EQ(cell.value("C.clear"), 0.0);
}

TEST(ProximityBox, SwitchesAtItsFaceAndBackAtItsHysteresis) {
  // The box from x = 0.95 to 1.05; the front face of the part starts at 0.1, its back face at 0.
  constexpr double kSpeed = 1.3;
  Cell cell(
      head(0.0) + "parts:\n" + cube("P", "[0, 0, 0]", "[1.3, 0, 0]") +
      "proximity_boxes: {S: {pose: {position_m: [1, 0.05, 0.12]}, size_m: [0.1, 0.02, 0.06], hysteresis_m: "
      "0.02}}\n");
  EXPECT_TRUE(first_step_after(cell.time_of("S.detected", 1.0), (0.95 - kSide_m) / kSpeed));
  EXPECT_TRUE(first_step_after(cell.time_of("S.detected", 0.0), (1.05 + 0.02) / kSpeed));
}

TEST(DistanceSensor, MeasuresTheClosedFormUpToItsRange) {
  // Along the world's x axis from the origin; the near face starts at 1.5 m and approaches.
  Cell cell(head(0.0) + "parts:\n" + cube("P", "[1.5, -0.05, -0.05]", "[-1, 0, 0]") +
            "distance_sensors: {D: {pose: {rpy_deg: [0, 90, 0]}, range_m: 1.2, switch_m: 0.8003, "
            "hysteresis_m: 0.1}, R: "
            "{pose: {rpy_deg: [0, 90, 0]}, range_m: 1.2, resolution_m: 0.05}}\n");
  EXPECT_EQ(cell.value("D.distance"), 1.2);
  EXPECT_EQ(cell.value("D.in_range"), 0.0);
  double near_at = -1.0;
  for (int k = 0; k < 1000; ++k) {
    const double t = cell.step();
    const double expected = std::min(1.2, 1.5 - t);
    ASSERT_NEAR(cell.value("D.distance"), expected, 1e-9) << t;
    if (std::abs(1.5 - t - 1.2) > 1e-6) {
      ASSERT_EQ(cell.value("D.in_range"), 1.5 - t < 1.2 ? 1.0 : 0.0) << t;
    }
    ASSERT_NEAR(cell.value("R.distance"), expected, 0.025 + 1e-9);
    ASSERT_NEAR(std::remainder(cell.value("R.distance"), 0.05), 0.0, 1e-12);
    if (near_at < 0.0 && cell.value("D.near") != 0.0) near_at = t;
  }
  EXPECT_TRUE(first_step_after(near_at, 1.5 - 0.8003));
}

TEST(IdentificationReader, ReadsTheNearestPartInRangeOnceEach) {
  // Two cubes pass at 1 m/s, one 0.5 m behind the other; centres at y = 0.
  Cell cell(head(0.0) + "parts:\n" + cube("A", "[-0.05, -0.05, -0.05]", "[1, 0, 0]") +
            cube("B", "[-0.55, -0.05, -0.05]", "[1, 0, 0]") +
            "identification_readers: {Tag: {pose: {position_m: [0.5003, 0, 0]}, range_m: 0.1, hysteresis_m: "
            "0.05}}\n");
  EXPECT_EQ(cell.value("Tag.part"), -1.0);
  EXPECT_TRUE(first_step_after(cell.time_of("Tag.present", 1.0), 0.4003));
  EXPECT_EQ(cell.value("Tag.part"), cell.model->description.find_component("A"));
  EXPECT_TRUE(first_step_after(cell.time_of("Tag.present", 0.0), 0.6503));
  EXPECT_EQ(cell.value("Tag.part"), -1.0);
  EXPECT_TRUE(first_step_after(cell.time_of("Tag.present", 1.0), 0.9003));
  EXPECT_EQ(cell.value("Tag.part"), cell.model->description.find_component("B"));
  EXPECT_EQ(cell.value("Tag.reads"), 2.0);
}

TEST(LimitSwitch, SwitchesAtThePositionOfItsJointAndBackAtTheHysteresis) {
  Cell cell(
      head(0.0) +
      "robots: {R: {urdf: arm.urdf, initial_joints_rad: [0], trajectory: {end_rad: [1], "
      "max_velocity_rad_per_s: "
      "[2], max_acceleration_rad_per_s2: [20]}}}\n"
      "limit_switches: {High: {robot: R, joint: j, position_rad: 0.5, hysteresis_rad: 0.3}, Low: {robot: R, "
      "joint: j, "
      "position_rad: 0.25, side: below}}\n");
  const auto joint = find_signal(cell.model->description, "R.j").value();
  double on_at = -1.0, low_off = -1.0, position = 0.0;
  for (int k = 0; k < 1000; ++k) {
    const double q = cell.simulation.signal(joint);  // of the motion that the sensors see next
    cell.step();
    if (on_at < 0.0 && cell.value("High.active") != 0.0) on_at = q;
    if (low_off < 0.0 && k > 0 && cell.value("Low.active") == 0.0) low_off = q;
    ASSERT_EQ(cell.value("High.active"), q >= 0.5 ? 1.0 : 0.0) << "forwards there is no hysteresis";
    position = q;
  }
  EXPECT_NEAR(position, 1.0, 1e-9);
  EXPECT_GE(on_at, 0.5);
  EXPECT_LT(on_at, 0.5 + 2.0 * kStep_s);
  EXPECT_GT(low_off, 0.25);
  EXPECT_LE(low_off, 0.25 + 2.0 * kStep_s + 1e-9);
  // A forced position is what the switch reads.
  EXPECT_EQ(cell.simulation.force_signal(joint, 0.3), "");
  cell.step();
  EXPECT_EQ(cell.value("High.active"), 1.0) << "within the hysteresis";
  EXPECT_EQ(cell.simulation.force_signal(joint, 0.19), "");
  cell.step();
  EXPECT_EQ(cell.value("High.active"), 0.0);
  EXPECT_EQ(cell.value("Low.active"), 1.0);
}

TEST(ForceSwitch, AGroundFeelsTheWeightOfWhatItCarries) {
  Cell cell(
      head(9.81) + "parts:\n" + cube("P", "[0, 0, 0.1]") +
      "grounds: {G: {mesh: cube.obj}}\nforce_switches: {Light: {component: G, threshold_N: 9.8}, Heavy: "
      "{component: "
      "G, threshold_N: 9.9}}\npresence_sensors: {There: {holder: G}}\n");
  for (int k = 0; k < 300; ++k) cell.step();
  EXPECT_NEAR(cell.value("Light.force"), 9.81, 1e-6);
  EXPECT_EQ(cell.value("Light.reached"), 1.0);
  EXPECT_EQ(cell.value("Heavy.reached"), 0.0);
  EXPECT_EQ(cell.value("There.part_present"), 1.0);
  EXPECT_EQ(cell.value("There.part"), cell.model->description.find_component("P"));
  // Taken away.
  const int part = cell.model->description.find_component("P");
  ASSERT_EQ(cell.simulation.set_component_state(part, {Mat3::Identity(), Vec3(0, 0, 3)}, {}), "");
  cell.step(), cell.step();
  EXPECT_EQ(cell.value("There.part_present"), 0.0);
  EXPECT_EQ(cell.value("There.part"), -1.0);
  EXPECT_EQ(cell.value("Light.reached"), 0.0);
}

TEST(TemperatureSensor, FollowsTheCoolingOfAPartWithItsLag) {
  // C = 10 J/K, h A = 20 W/K: tau = 0.5 s from 100 to 20 degC; the sensor lags by 0.1 s, from the first sample on.
  Cell cell(
      "takt_scenario: 1\nname: s\nworld: {gravity_m_per_s2: [0, 0, 0], temperature_degC: 20}\nparts:\n" +
      cube("P", "[0, 0, 0]", "[0, 0, 0]",
           ", heat: {specific_heat_J_per_kg_K: 10, temperature_degC: 100, surface_m2: 0.1, "
           "cooling_W_per_m2_K: "
           "200}") +
      "temperature_sensors: {T: {of: P, lag_s: 0.1}, S: {of: P, switch_degC: 50, hysteresis_K: 10}}\n");
  const double tau = 0.5, lag = 0.1;
  double off_at = -1.0;
  for (int k = 0; k < 1500; ++k) {
    const double t = cell.step();
    // T' = (u - T) / lag with u - 20 = 80 exp(-t / tau), T(0) = 100.
    const double a = 80.0 * tau / (tau - lag);
    const double expected = 20.0 + a * std::exp(-t / tau) + (80.0 - a) * std::exp(-t / lag);
    // Half a step of lag and rounding of the integration.
    ASSERT_NEAR(cell.value("T.temperature"), expected, 0.17) << t;
    ASSERT_NEAR(cell.value("S.temperature"), 20.0 + 80.0 * std::exp(-t / tau), 2e-4) << t;
    if (off_at < 0.0 && cell.value("S.reached") == 0.0) off_at = t;
  }
  EXPECT_TRUE(first_step_after(off_at, tau * std::log(80.0 / 20.0)));
}

TEST(SensorFilter, NoiseHasItsMeanAndVarianceOverSeeds) {
  constexpr int kSeeds = 4000;
  double sum = 0.0, squares = 0.0, next = 0.0;
  for (int seed = 0; seed < kSeeds; ++seed) {
    MeasuringParameters p;
    p.noise = 0.25;
    p.seed = seed;
    MeasuringFilter filter(p);
    const double first = (filter.sample(3.0, kStep_s) - 3.0) / 0.25,
                 second = (filter.sample(3.0, kStep_s) - 3.0) / 0.25;
    sum += first, squares += first * first, next += first * second;
  }
  // Five standard deviations of each estimate.
  EXPECT_NEAR(sum / kSeeds, 0.0, 5.0 / std::sqrt(kSeeds));
  EXPECT_NEAR(squares / kSeeds, 1.0, 5.0 * std::sqrt(2.0 / kSeeds));
  EXPECT_NEAR(next / kSeeds, 0.0, 5.0 / std::sqrt(kSeeds));
}

TEST(SensorFilter, TheLagIsOfFirstOrder) {
  MeasuringParameters p;
  p.lag_s = 0.02;
  MeasuringFilter filter(p);
  filter.sample(0.0, kStep_s);
  for (int k = 1; k <= 100; ++k)
    ASSERT_NEAR(filter.sample(5.0, kStep_s), 5.0 * (1.0 - std::exp(-k * kStep_s / 0.02)), 1e-12);
}

TEST(SensorFilter, HysteresisAndDelays) {
  SwitchParameters p;
  p.threshold = 10.0;
  p.hysteresis = 2.0;
  p.on_delay_s = 0.003;
  p.off_delay_s = 0.001;
  SwitchFilter filter(p);
  EXPECT_FALSE(filter.sample(9.9, kStep_s));
  for (int k = 0; k < 3; ++k) EXPECT_FALSE(filter.sample(10.0, kStep_s)) << k;
  EXPECT_TRUE(filter.sample(10.0, kStep_s)) << "3 ms after the change";
  for (int k = 0; k < 10; ++k) EXPECT_TRUE(filter.sample(8.0, kStep_s)) << "in the band";
  EXPECT_TRUE(filter.sample(7.9, kStep_s));
  EXPECT_FALSE(filter.sample(9.9, kStep_s)) << "1 ms after the change; the band does not switch on";
  EXPECT_FALSE(filter.sample(10.0, kStep_s));
  EXPECT_FALSE(filter.sample(7.0, kStep_s));
  for (int k = 0; k < 3; ++k) EXPECT_FALSE(filter.sample(10.0, kStep_s)) << "the delay starts again";
  EXPECT_TRUE(filter.sample(10.0, kStep_s));
}

/// Whether a triangle crosses the segment, in the world; the cubes never surround the beam.
bool crossed(const Pose& X_WB, const Vec3& from_W, const Vec3& to_W) {
  // A box: slabs along the axes of the cube.
  const Pose X_BW = X_WB.inverse();
  const Vec3 p = X_BW * from_W, d = X_BW * to_W - p;
  double enter = 0.0, leave = 1.0;
  for (int k = 0; k < 3; ++k) {
    double a = (0.0 - p[k]) / d[k], b = (kSide_m - p[k]) / d[k];
    if (a > b) std::swap(a, b);
    enter = std::max(enter, a), leave = std::min(leave, b);
  }
  return enter <= leave;
}

TEST(SceneSensors, WhatHasMovedIsSeenAtRandomPosesAndAfterARestore) {
  const std::string text = head(0.0) + "interaction: {algorithm: partner_search}\nparts:\n" +
                           cube("A", "[0, 0, 0]", "[0.3, 0, 0]") + cube("B", "[1, 0, 0]") +
                           cube("C", "[2, 0, 0]", "[0, 0.1, 0.2]") +
                           "light_barriers: {Fixed: {from_m: [-0.3, -0.2, -0.1], to_m: [0.4, 0.2, 0.15]}, "
                           "Carried: {at: A, from_m: [0.05, "
                           "0.05, 0.3], to_m: [0.2, 0.3, -0.2]}}\n"
                           "distance_sensors: {D: {pose: {position_m: [0, 0, -0.5]}, range_m: 1}}\n";
  Cell cell(text), restored(text);
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> place(-0.25, 0.25), angle(-1.5, 1.5);
  int fixed = 0, carried = 0, near = 0;
  Snapshot snapshot = cell.simulation.make_snapshot();
  for (int k = 0; k < 1500; ++k) {
    if (k % 3 == 0) {
      const int part = static_cast<int>(random() % 3);
      Pose X{Mat3::Identity(), Vec3::Zero()};
      for (int i = 0; i < 3; ++i) {
        X.p[i] = place(random);
        X.R = X.R * Eigen::AngleAxisd(angle(random), Vec3::Unit(i)).toRotationMatrix();
      }
      ASSERT_EQ(cell.simulation.set_component_state(part, X, {}), "");
    }
    cell.simulation.read_snapshot(snapshot);
    std::vector<Pose> poses;
    for (const ComponentSample& c : snapshot.components) poses.push_back({c.q_WB.toRotationMatrix(), c.p_WB});
    if (k == 700) {
      std::vector<std::byte> bytes;
      ASSERT_EQ(cell.simulation.save_state(bytes), "");
      ASSERT_EQ(restored.simulation.restore_state(bytes), "");
    }
    const bool by_fixed = std::any_of(poses.begin(), poses.end(), [](const Pose& X) {
      return crossed(X, {-0.3, -0.2, -0.1}, {0.4, 0.2, 0.15});
    });
    const bool by_carried =
        crossed(poses[1], poses[0] * Vec3(0.05, 0.05, 0.3), poses[0] * Vec3(0.2, 0.3, -0.2)) ||
        crossed(poses[2], poses[0] * Vec3(0.05, 0.05, 0.3), poses[0] * Vec3(0.2, 0.3, -0.2));
    const bool in_range = std::any_of(poses.begin(), poses.end(), [](const Pose& X) {
      return crossed(X, {0, 0, -0.5}, {0, 0, 0.5});
    });
    ASSERT_TRUE(cell.simulation.step({})) << cell.simulation.fault();
    ASSERT_EQ(cell.value("Fixed.blocked") != 0.0, by_fixed) << k;
    ASSERT_EQ(cell.value("Carried.blocked") != 0.0, by_carried) << k;
    ASSERT_EQ(cell.value("D.in_range") != 0.0, in_range) << k;
    fixed += by_fixed ? 1 : 0, carried += by_carried ? 1 : 0, near += in_range ? 1 : 0;
    if (k == 700) {
      ASSERT_TRUE(restored.simulation.step({}));
      ASSERT_EQ(restored.simulation.state_hash(), cell.simulation.state_hash());
    }
  }
  EXPECT_GT(fixed, 100);
  EXPECT_GT(carried, 50);
  EXPECT_GT(near, 100);
  EXPECT_LT(fixed, 1400);
  EXPECT_LT(carried, 1400);
  EXPECT_LT(near, 1400);
}

TEST(Sensors, MistakesNameFileLineAndKey) {
  const auto error_of = [](const std::string& more) -> std::string {
    try {
      model_of(head(0.0) + "parts:\n" + cube("P", "[0, 0, 0]") +
               "robots: {R: {urdf: arm.urdf, initial_joints_rad: [0]}}\n" + more);
    } catch (const ScenarioError& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_THAT(error_of("limit_switches: {L: {robot: R, joint: k, position_rad: 1}}\n"),
              HasSubstr("limit_switches.L.joint: found 'R.k'; allowed: signals of R: j"));
  EXPECT_THAT(error_of("temperature_sensors: {T: {of: P}}\n"), HasSubstr("found 'P_heat.temperature'"));
  EXPECT_THAT(error_of("force_switches: {F: {signal: Q.force, threshold_N: 1}}\n"),
              HasSubstr("found 'Q.force'"));
  EXPECT_THAT(error_of("force_switches: {F: {threshold_N: 1}}\n"), HasSubstr("force_switches.F"));
  EXPECT_THAT(error_of("light_barriers: {B: {from_m: [0, 0, 0], to_m: [0, 0, 0]}}\n"),
              HasSubstr("two points"));
  EXPECT_THAT(error_of("light_barriers: {B: {at: Nobody, from_m: [0, 0, 0], to_m: [0, 0, 1]}}\n"),
              HasSubstr("light_barriers.B.at: found 'Nobody'"));
  EXPECT_THAT(error_of("proximity_boxes: {B: {size_m: [0, 1, 1]}}\n"), HasSubstr("proximity_boxes.B.size_m"));
}

}  // namespace
}  // namespace takt

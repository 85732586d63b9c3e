// Forces, work and limits of the drives of axes against closed forms: weight and inertia, centripetal and Coriolis
// acceleration, a robot that rides, contact that blocks.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <string>
#include <vector>

#include "tests/support/device_run.h"

namespace takt {
namespace {

using test::at_level;
using test::DeviceRun;
using test::expect_same_after_restoring;

constexpr double kGravity = 9.80665, kBox_kg = 1.0;
using Kind = DeviceNotice::Kind;

std::size_t count(DeviceRun& run, Kind kind) {
  const auto notices = run.simulation().events().device_notices;
  return static_cast<std::size_t>(std::count_if(
      notices.begin(), notices.end(), [kind](const DeviceNotice& notice) { return notice.kind == kind; }));
}

class AxisLoad : public testing::TestWithParam<int> {};

/// 0.2 m at 0.2 m/s and 1 m/s^2: 0.2 s up, 0.8 s of constant speed, 0.2 s to rest.
TEST_P(AxisLoad, ALiftCarriesWeightAndInertiaAndItsWorkIsTheHeight) {
  DeviceRun run("lift", {at_level(GetParam()), "linear_axes.Lift.moving_mass_kg=4"});
  const double mass_kg = kBox_kg + 4.0;
  ASSERT_TRUE(run.run_to(0.5));
  EXPECT_NEAR(run.signal("Lift", "force"), mass_kg * kGravity, 1e-3);
  EXPECT_EQ(run.signal("Lift", "power"), 0.0);
  EXPECT_EQ(run.signal("Lift", "energy"), 0.0);
  run.set("Lift", "set_position", 0.2);
  ASSERT_TRUE(run.run_to(0.69));
  EXPECT_NEAR(run.signal("Lift", "force"), mass_kg * (kGravity + 1.0), 1e-2);
  EXPECT_NEAR(run.signal("Lift", "power"), run.signal("Lift", "force") * 0.189, 1e-9);  // a step before
  ASSERT_TRUE(run.run_to(1.4));
  EXPECT_NEAR(run.signal("Lift", "force"), mass_kg * kGravity, 1e-2);
  EXPECT_NEAR(run.signal("Lift", "energy"), mass_kg * (kGravity * 0.16 + 0.5 * 0.04), 1.2e-2);
  ASSERT_TRUE(run.run_to(1.69));
  EXPECT_NEAR(run.signal("Lift", "force"), mass_kg * (kGravity - 1.0), 1e-2);
  ASSERT_TRUE(run.run_to(2.5));
  EXPECT_NEAR(run.signal("Lift", "force"), mass_kg * kGravity, 1e-3);
  EXPECT_NEAR(run.signal("Lift", "energy"), mass_kg * kGravity * 0.2, 5e-3);
  EXPECT_EQ(run.signal("Lift", "power"), 0.0);
  run.set("Lift", "set_position", 0.0);
  ASSERT_TRUE(run.run_to(4.5));
  EXPECT_NEAR(run.signal("Lift", "energy"), 0.0, 5e-3);
}

/// The box of 0.1 x 0.1 x 0.05 m stands 0.1 m from the axis.
TEST_P(AxisLoad, ATurntableTurnsItsInertiaAndThatOfItsBox) {
  DeviceRun run("turntable",
                {at_level(GetParam()), "contact={defaults: {friction: 0.5, friction_law: stick}}",
                 "turntables.Turntable.moving_inertia_kg_m2=0.05"});
  const double inertia = 0.05 + kBox_kg * (0.02 / 12.0 + 0.01);
  ASSERT_TRUE(run.run_to(0.3));
  run.set("Turntable", "set_speed", 1.0);
  ASSERT_TRUE(run.run_to(0.7));
  EXPECT_NEAR(run.signal("Turntable", "torque"), 2.0 * inertia, 1e-2 * inertia);
  ASSERT_TRUE(run.run_to(2.0));
  EXPECT_NEAR(run.signal("Turntable", "torque"), 0.0, 1e-3 * inertia);
  EXPECT_NEAR(run.signal("Turntable", "energy"), 0.5 * inertia, 1e-2 * inertia);
}

INSTANTIATE_TEST_SUITE_P(Axes, AxisLoad, testing::Values(1, 3),
                         [](const auto& level) { return "Level" + std::to_string(level.param); });

/// A slide of 2 kg on a turntable: at rest it needs m w^2 r towards the axis; at the speed v outwards the table needs
/// 2 m w v r against Coriolis, and its own weight nothing.
TEST(AxisLoads, ASlideOnATurntableFeelsCentripetalAndTheTableCoriolisAcceleration) {
  DeviceRun run(
      "lift",
      {"linear_axes.Lift={grounds: [Platform], mounted_on: Disc, direction: [1, 0, 0], stroke_m: [0, 1], "
       "moving_mass_kg: 2, max_speed_m_per_s: 0.2, max_acceleration_m_per_s2: 1}",
       "parts.Box.pose.position_m=[3, 0, 0]", "world.gravity_m_per_s2=[0, 0, 0]",
       "grounds.Disc={mesh: meshes/plate.obj, pose: {position_m: [-0.5, 0, -0.5]}}",
       "turntables={Table: {grounds: [Disc], center_m: [-0.5, 0, 0], moving_inertia_kg_m2: 0.7, "
       "max_speed_rad_per_s: 3, max_acceleration_rad_per_s2: 6}}"});
  run.set("Table", "set_speed", 3.0);
  ASSERT_TRUE(run.run_to(0.25));
  EXPECT_NEAR(run.signal("Table", "torque"), 6.0 * (0.7 + 2.0 * 0.25), 1e-9);
  ASSERT_TRUE(run.run_to(1.0));
  EXPECT_NEAR(run.signal("Lift", "force"), -2.0 * 9.0 * 0.5, 1e-9);
  EXPECT_NEAR(run.signal("Table", "torque"), 0.0, 1e-9);
  run.set("Lift", "set_position", 0.5);
  ASSERT_TRUE(run.run_to(2.2));
  const double r = 0.5 + run.signal("Lift", "position") - 0.2 * 0.001;  // loads are those of a step before
  EXPECT_NEAR(run.signal("Table", "torque"), 2.0 * 2.0 * 3.0 * 0.2 * r, 1e-9);
  EXPECT_NEAR(run.signal("Lift", "force"), -2.0 * 9.0 * r, 1e-9);
  ASSERT_TRUE(run.run_to(5.0));
  // Its kinetic energy, and none that is lost: what the slide takes out, the table puts in twice.
  const double kinetic_J = 0.5 * 9.0 * (0.7 + 2.0);
  EXPECT_NEAR(run.signal("Table", "energy") + run.signal("Lift", "energy"), kinetic_J, 1e-3 * kinetic_J);
}

TEST(AxisLoads, AnAxisCarriesWhatStandsOnTheAxisThatItCarries) {
  DeviceRun run("lift", {"linear_axes.Lift.mounted_on=Carriage", "linear_axes.Lift.moving_mass_kg=2",
                         "grounds.Carriage={mesh: meshes/plate.obj, pose: {position_m: [0, 0, -0.5]}}",
                         "linear_axes.Track={grounds: [Carriage], direction: [1, 0, 0], stroke_m: [-1, 1], "
                         "moving_mass_kg: 3, max_speed_m_per_s: 0.5, max_acceleration_m_per_s2: 1}"});
  ASSERT_TRUE(run.run_to(0.5));
  EXPECT_NEAR(run.signal("Track", "force"), 0.0, 1e-6);
  run.set("Track", "set_position", -0.9);
  ASSERT_TRUE(run.run_to(0.9));
  EXPECT_NEAR(run.signal("Track", "force"), -(kBox_kg + 2.0 + 3.0), 2e-3);
  EXPECT_NEAR(run.signal("Lift", "force"), (kBox_kg + 2.0) * kGravity, 1e-2);
}

/// The robot's own weight, as its foundation feels it, gives the mass that the track accelerates.
TEST(AxisLoads, ATrackAcceleratesItsRobot) {
  DeviceRun run("robot_track", {at_level(2), "linear_axes.Track.max_speed_m_per_s=1.4",
                                "linear_axes.Track.moving_mass_kg=100"});
  ASSERT_TRUE(run.run_to(0.2));
  const double mass_kg = 100.0 - run.snapshot().robots[0].base_reaction_W.f.z() / kGravity;
  EXPECT_NEAR(run.signal("Track", "force"), 0.0, 1e-3);
  run.set("Track", "set_position", 1.5);
  ASSERT_TRUE(run.run_to(1.2));
  EXPECT_NEAR(run.signal("Track", "force"), mass_kg, 1e-3 * mass_kg);
  EXPECT_NEAR(run.signal("Track", "energy"), 0.5 * mass_kg, 1e-2 * mass_kg);
}

TEST(AxisLoads, FrictionActsAgainstTheMotionAndItsWorkIsLost) {
  DeviceRun run("lift", {"linear_axes.Lift.direction=[1, 0, 0]", "linear_axes.Lift.friction_N=7",
                         "parts.Box.pose.position_m=[3, 0, 0]", "world.gravity_m_per_s2=[0, 0, 0]"});
  run.set("Lift", "set_position", 0.2);
  ASSERT_TRUE(run.run_to(0.6));
  EXPECT_EQ(run.signal("Lift", "force"), 7.0);
  ASSERT_TRUE(run.run_to(2.0));
  EXPECT_EQ(run.signal("Lift", "force"), 0.0);
  run.set("Lift", "set_position", 0.0);
  ASSERT_TRUE(run.run_to(2.6));
  EXPECT_EQ(run.signal("Lift", "force"), -7.0);
  ASSERT_TRUE(run.run_to(4.0));
  EXPECT_NEAR(run.signal("Lift", "energy"), 7.0 * 0.4, 1e-9);
}

TEST(AxisLoads, AtLevelOneARobotCountsNothing) {
  DeviceRun run("robot_track", {at_level(1)});
  run.set("Track", "set_position", 1.5);
  ASSERT_TRUE(run.run_to(0.3));
  EXPECT_NEAR(run.signal("Track", "force"), 0.0, 1e-12);
}

TEST_P(AxisLoad, ALiftThatIsTooWeakForTheWeightStaysAndSaysSoOnce) {
  DeviceRun run("lift", {at_level(GetParam()), "linear_axes.Lift.max_force_N=9.7"});
  ASSERT_TRUE(run.run_to(0.3));
  EXPECT_EQ(run.signal("Lift", "overload"), 0.0);
  run.set("Lift", "set_position", 0.2);
  ASSERT_TRUE(run.step());
  ASSERT_EQ(count(run, Kind::axis_overloaded), 1U);
  const DeviceNotice notice = run.simulation().events().device_notices[0];
  EXPECT_NEAR(notice.load_N, kBox_kg * kGravity, 1e-2);
  EXPECT_EQ(notice.force_N, 9.7);
  for (int i = 0; i < 500; ++i) {
    ASSERT_TRUE(run.step());
    ASSERT_EQ(count(run, Kind::axis_overloaded), 0U);
  }
  EXPECT_EQ(run.signal("Lift", "position"), 0.0);
  EXPECT_EQ(run.signal("Lift", "overload"), 1.0);
  run.set("Lift", "set_position", 0.1);
  ASSERT_TRUE(run.step());
  EXPECT_EQ(count(run, Kind::axis_overloaded), 1U);
}

/// It bears the weight, and not the acceleration: it stops on the way.
TEST(AxisLoads, ALiftThatIsTooWeakForItsAccelerationBrakes) {
  DeviceRun run("lift", {"linear_axes.Lift.max_force_N=10.3"});
  run.set("Lift", "set_position", 0.2);
  ASSERT_TRUE(run.run_to(1.5));
  EXPECT_EQ(run.signal("Lift", "overload"), 1.0);
  EXPECT_GT(run.signal("Lift", "position"), 0.0);
  EXPECT_LT(run.signal("Lift", "position"), 0.02);
  EXPECT_EQ(run.signal("Lift", "speed"), 0.0);
  run.set("Lift", "set_speed", -0.2);
  ASSERT_TRUE(run.run_to(2.0));
  EXPECT_EQ(run.signal("Lift", "overload"), 0.0);
  EXPECT_EQ(run.signal("Lift", "at_lower_end"), 1.0);
}

constexpr double kPiston_m2 = 0.25 * std::numbers::pi * 1e-4;

/// In place of the lift's axis, with these further keys.
std::vector<std::string> lifted_by_piston(const std::string& keys, int level = 1) {
  return {at_level(level), "linear_axes={}",
          "cylinders={Lift: {grounds: [Platform], direction: [0, 0, 1], extend_time_s: 1, bore_m: 0.01, " +
              keys + "}}"};
}

/// Pressure times area of the piston, 1 % below and 12 % above the weight of the box.
TEST_P(AxisLoad, ACylinderLiftsWhatPressureTimesAreaCarries) {
  for (const double share : {0.99, 1.12}) {
    const std::string pressure = std::to_string(share * kBox_kg * kGravity / kPiston_m2);
    DeviceRun run(
        "lift",
        lifted_by_piston("stroke_m: 0.2, acceleration_m_per_s2: 1, rod_m: 0.004, pressure_Pa: " + pressure,
                         GetParam()));
    ASSERT_TRUE(run.run_to(0.3));
    EXPECT_NEAR(run.signal("Lift", "force"), kBox_kg * kGravity, 1e-2);
    run.set("Lift", "extend", 1.0);
    std::size_t overloads = 0;
    while (run.time_s() < 2.5) {
      ASSERT_TRUE(run.step());
      overloads += count(run, Kind::axis_overloaded);
    }
    EXPECT_EQ(overloads, share < 1.0 ? 1U : 0U) << share;
    EXPECT_EQ(run.signal("Lift", "overload"), share < 1.0 ? 1.0 : 0.0) << share;
    EXPECT_EQ(run.signal("Lift", "extended"), share < 1.0 ? 0.0 : 1.0) << share;
    if (share < 1.0) {
      EXPECT_EQ(run.signal("Lift", "position"), 0.0);
    }
  }
}

/// With its force used up a piston gains (F - m g) / m, with the mass of piston and box together.
TEST_P(AxisLoad, APistonAtItsLimitMovesByNewtonsLaw) {
  const double mass_kg = kBox_kg + 5.0, force_N = 62.0;
  const std::string pressure = std::to_string(force_N / kPiston_m2);
  DeviceRun run("lift",
                lifted_by_piston("stroke_m: 0.5, moving_mass_kg: 5, pressure_Pa: " + pressure, GetParam()));
  ASSERT_TRUE(run.run_to(0.3));
  run.set("Lift", "extend", 1.0);
  ASSERT_TRUE(run.run_to(0.9));
  const double gain = force_N / mass_kg - kGravity;
  EXPECT_NEAR(run.signal("Lift", "position"), 0.5 * gain * 0.36, 5e-3 * gain);
  EXPECT_NEAR(run.sample("Platform").V_WB.v.z(), gain * 0.6, 1e-2 * gain);
  EXPECT_NEAR(run.signal("Lift", "force"), force_N, 0.1);
}

/// Down, the weight helps: the drive holds back, and a piston that could not lift it comes in.
TEST(AxisLoads, APistonThatCannotLiftComesDown) {
  DeviceRun run("lift", lifted_by_piston("stroke_m: 0.2, extended: true, pressure_Pa: 1e5"));
  ASSERT_TRUE(run.run_to(0.3));
  EXPECT_NEAR(run.signal("Lift", "force"), kBox_kg * kGravity, 1e-2);  // 7.85 N would lift
  run.set("Lift", "extend", 0.0);
  ASSERT_TRUE(run.run_to(2.0));
  EXPECT_EQ(run.signal("Lift", "retracted"), 1.0);
}

/// The piston is as strong against the box as against nothing: a blow of the contact does not stop it.
TEST(AxisLoads, ACylinderPushesOnAfterTheBlow) {
  DeviceRun run("cylinder", {at_level(3), "cylinders.Cylinder.bore_m=0.02"});
  run.set("Cylinder", "extend", 1.0);
  ASSERT_TRUE(run.run_to(2.0));
  EXPECT_EQ(run.signal("Cylinder", "extended"), 1.0);
  EXPECT_EQ(run.signal("Cylinder", "overload"), 0.0);
  EXPECT_GT(run.sample("Box").p_WB.x(), 0.079);
}

/// A wall 60 mm before the box: the piston stands where it meets both, and its end switch never comes.
TEST(AxisLoads, ABlockedCylinderStandsAndGoesBack) {
  DeviceRun run("cylinder", {at_level(3), "cylinders.Cylinder.bore_m=0.02",
                             "grounds.Wall={mesh: meshes/gate.obj, pose: {position_m: [0.07, 0, 0.002]}}"});
  run.set("Cylinder", "extend", 1.0);
  std::size_t overloads = 0;
  while (run.time_s() < 2.0) {
    ASSERT_TRUE(run.step());
    overloads += count(run, Kind::axis_overloaded);
  }
  EXPECT_EQ(overloads, 1U);
  EXPECT_EQ(run.signal("Cylinder", "overload"), 1.0);
  EXPECT_EQ(run.signal("Cylinder", "extended"), 0.0);
  EXPECT_GT(run.signal("Cylinder", "position"), 0.05);
  EXPECT_GT(run.signal("Cylinder", "force"), 0.25 * std::numbers::pi * 4e-4 * 6e5);
  const double stood = run.signal("Cylinder", "position");
  run.set("Cylinder", "extend", 0.0);
  ASSERT_TRUE(run.run_to(3.0));
  EXPECT_EQ(run.signal("Cylinder", "overload"), 0.0);
  EXPECT_EQ(run.signal("Cylinder", "retracted"), 1.0) << stood;
  EXPECT_NEAR(run.signal("Cylinder", "force"), 0.0, 1e-6);
}

TEST(AxisLoads, WorkAndOverloadAreSavedAndReset) {
  DeviceRun run("lift", {"linear_axes.Lift.max_force_N=10.3"});
  run.set("Lift", "set_position", 0.2);
  expect_same_after_restoring(run, 0.02, 0.7);
  EXPECT_EQ(run.signal("Lift", "overload"), 1.0);
  const double energy_J = run.signal("Lift", "energy");
  EXPECT_GT(energy_J, 0.0);
  std::vector<std::byte> bytes;
  ASSERT_EQ(run.simulation().save_state(bytes), "");
  run.simulation().reset();
  ASSERT_TRUE(run.step());
  EXPECT_EQ(run.signal("Lift", "overload"), 0.0);
  EXPECT_EQ(run.signal("Lift", "energy"), 0.0);
  ASSERT_EQ(run.simulation().restore_state(bytes), "");
  ASSERT_TRUE(run.step());
  EXPECT_EQ(run.signal("Lift", "overload"), 1.0);
  EXPECT_EQ(run.signal("Lift", "energy"), energy_J);
}

TEST(AxisLoads, ARodIsThinnerThanItsPiston) {
  try {
    static_cast<void>(
        test::device_cell("cylinder", {"cylinders.Cylinder.bore_m=0.02", "cylinders.Cylinder.rod_m=0.03"}));
    FAIL();
  } catch (const std::exception& error) {
    EXPECT_NE(std::string(error.what()).find("less than bore_m"), std::string::npos) << error.what();
  }
}

}  // namespace
}  // namespace takt

// Conveyors against closed forms: acceleration by friction and slip (level 3), transport by the substitute force (levels 1 and 2),
// stops and queues; saved states, sleeping.
#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>
#include <numbers>
#include <string>
#include <vector>

#include "tests/support/device_run.h"

namespace takt {
namespace {

using test::at_level;
using test::DeviceRun;
using test::expect_same_after_restoring;

constexpr double kGravity_m_per_s2 = 9.80665;

class FrictionOfBelt : public testing::TestWithParam<std::string> {};

TEST_P(FrictionOfBelt, ABlockAtRestIsAcceleratedByMuGUntilItHasTheSpeedOfTheBelt) {
  const double mu = 0.1, v = 0.2, belt_m_per_s2 = 50.0;
  DeviceRun run("conveyor",
                {at_level(3), "contact.defaults={friction: 0.1, friction_law: " + GetParam() + "}",
                 "conveyors.Conveyor.max_acceleration_m_per_s2=50", "conveyors.Conveyor.running=false"});
  ASSERT_TRUE(run.run_to(0.2));
  const double begin_m = run.sample("First").p_WB.x();
  run.set("Conveyor", "run", 1.0);
  ASSERT_TRUE(run.run_to(0.3));
  // In the first instant the belt is slower than a sliding block would become: mu g t counts from when it slides.
  EXPECT_NEAR(run.sample("First").V_WB.v.x(), mu * kGravity_m_per_s2 * 0.1, 2e-3);
  EXPECT_NEAR(run.sample("First").p_WB.x() - begin_m, 0.5 * mu * kGravity_m_per_s2 * 0.01, 1e-4);
  ASSERT_TRUE(run.run_to(0.6));
  EXPECT_NEAR(run.sample("First").V_WB.v.x(), v, 1e-3);
  // Slip: what the belt is ahead.
  const double slip = run.signal("Conveyor", "position") - (run.sample("First").p_WB.x() - begin_m);
  const double wanted = v * v / (2.0 * mu * kGravity_m_per_s2) - v * v / (2.0 * belt_m_per_s2);
  EXPECT_NEAR(slip, wanted, 0.02 * wanted);
  // Carried at constant speed from here on.
  const double at = run.sample("First").p_WB.x();
  ASSERT_TRUE(run.run_to(1.1));
  EXPECT_NEAR(run.sample("First").p_WB.x() - at, 0.5 * v, 2e-4);
  EXPECT_NEAR(run.sample("First").V_WB.v.x(), v, 1e-4);
  EXPECT_NEAR(run.sample("First").p_WB.y(), 0.0, 1e-5);
}

INSTANTIATE_TEST_SUITE_P(Conveyor, FrictionOfBelt, testing::Values("regularised", "stick"),
                         [](const auto& law) { return law.param; });

/// Sliding, a box of 1 kg takes mu g; at the speed of the belt only its friction is left. Of the work on the box one half is its
/// kinetic energy, the other is lost by slip.
TEST_P(FrictionOfBelt, ItsDriveBearsTheFrictionAndLosesTheSlip) {
  DeviceRun run(
      "conveyor",
      {at_level(3), "contact.defaults={friction: 0.1, friction_law: " + GetParam() + "}",
       "parts.Second.pose.position_m=[0, 3, 0]", "conveyors.Conveyor.max_acceleration_m_per_s2=1000",
       "conveyors.Conveyor.running=false", "conveyors.Conveyor.friction_N=4"});
  ASSERT_TRUE(run.run_to(0.2));
  EXPECT_NEAR(run.signal("Conveyor", "force"), 0.0, 1e-3);
  run.set("Conveyor", "run", 1.0);
  ASSERT_TRUE(run.run_to(0.3));
  EXPECT_NEAR(run.signal("Conveyor", "force"), 4.0 + 0.1 * kGravity_m_per_s2, 0.02);
  EXPECT_NEAR(run.signal("Conveyor", "power"), 0.2 * run.signal("Conveyor", "force"), 1e-9);
  ASSERT_TRUE(run.run_to(0.8));
  EXPECT_NEAR(run.signal("Conveyor", "force"), 4.0, 0.02);
  EXPECT_NEAR(run.signal("Conveyor", "energy"), 4.0 * 0.2 * 0.6 + 0.04, 2e-3);
}

/// At level 1 the belt's mass and the box take m a, and the work is their kinetic energy.
TEST(Conveyor, ItsDriveAcceleratesBeltAndLoad) {
  DeviceRun run("conveyor", {"conveyors.Conveyor.running=false", "conveyors.Conveyor.moving_mass_kg=5",
                             "parts.Second.pose.position_m=[0, 3, 0]"});
  ASSERT_TRUE(run.run_to(0.1));
  run.set("Conveyor", "run", 1.0);
  ASSERT_TRUE(run.run_to(0.29));
  EXPECT_NEAR(run.signal("Conveyor", "force"), 6.0, 0.02);
  ASSERT_TRUE(run.run_to(1.0));
  EXPECT_NEAR(run.signal("Conveyor", "force"), 0.0, 1e-3);
  EXPECT_NEAR(run.signal("Conveyor", "energy"), 0.5 * 6.0 * 0.04, 2e-3);
}

TEST(Conveyor, ATrueStickLawHoldsABlockInTheMaterialOfTheBelt) {
  // Below mu g the block follows the acceleration of the belt, and nothing creeps.
  DeviceRun run("conveyor", {at_level(3), "contact.defaults={friction: 0.3, friction_law: stick}",
                             "conveyors.Conveyor.running=false"});
  ASSERT_TRUE(run.run_to(0.2));
  const double begin_m = run.sample("First").p_WB.x();
  run.set("Conveyor", "run", 1.0);
  ASSERT_TRUE(run.run_to(1.2));
  run.set("Conveyor", "run", 0.0);
  ASSERT_TRUE(run.run_to(2.2));
  EXPECT_NEAR(run.signal("Conveyor", "position"), 0.2, 1e-9);  // v t: ramps at 1 m/s^2 up and down
  EXPECT_NEAR(run.sample("First").p_WB.x() - begin_m, 0.2, 2e-5);
}

TEST(Conveyor, TheSubstituteForceCarriesByTheTravelOfTheBelt) {
  DeviceRun run("conveyor", {"conveyors.Conveyor.running=false"});
  ASSERT_TRUE(run.run_to(0.1));
  EXPECT_EQ(run.signal("Conveyor", "speed"), 0.0);
  run.set("Conveyor", "run", 1.0);
  while (run.time_s() < 1.0) {
    ASSERT_TRUE(run.step());
    const double t = run.time_s() - 0.1;
    const double travel = t < 0.2 ? 0.5 * t * t : 0.02 + 0.2 * (t - 0.2);
    ASSERT_NEAR(run.signal("Conveyor", "position"), travel, 1e-12);
    // m a / k while the belt accelerates: 1 m/s^2 of 9.81, of 0.1 mm.
    ASSERT_NEAR(run.sample("First").p_WB.x(), -0.1 + travel, 6e-5) << t;
  }
  EXPECT_NEAR(run.sample("First").V_WB.v.x(), 0.2, 1e-6);
  EXPECT_EQ(run.signal("Conveyor", "speed"), 0.2);
  run.set("Conveyor", "set_speed", -0.1);
  ASSERT_TRUE(run.run_to(1.5));
  EXPECT_EQ(run.signal("Conveyor", "speed"), -0.1);
  EXPECT_NEAR(run.sample("Second").V_WB.v.x(), -0.1, 1e-6);
  run.set("Conveyor", "run", 0.0);
  ASSERT_TRUE(run.run_to(2.0));
  EXPECT_NEAR(run.sample("First").p_WB.x(), -0.1 + run.signal("Conveyor", "position"), 1e-6);
  EXPECT_EQ(run.signal("Conveyor", "speed"), 0.0);
}

TEST(Conveyor, TwoBoxesQueueAtAStop) {
  for (const int level : {1, 3}) {
    DeviceRun run("conveyor", {at_level(level)});
    ASSERT_TRUE(run.run_to(5.0));
    // Faces at 0.39, and one box further back; at level 1 contact begins at the margin of 0.2 mm.
    const double near = level == 1 ? 3e-4 : 1e-4;
    EXPECT_NEAR(run.sample("First").p_WB.x(), 0.34, near) << level;
    EXPECT_NEAR(run.sample("Second").p_WB.x(), 0.24, 2.0 * near) << level;
    EXPECT_NEAR(run.sample("First").V_WB.v.norm(), 0.0, 1e-3) << level;
    EXPECT_NEAR(run.sample("First").p_WB.z(), run.sample("Second").p_WB.z(), 1e-4) << level;
    EXPECT_NEAR(run.sample("First").p_WB.y(), 0.0, 1e-3) << level;
    // Backwards both leave.
    run.set("Conveyor", "set_speed", -0.2);
    ASSERT_TRUE(run.run_to(6.5));
    EXPECT_LT(run.sample("First").p_WB.x(), 0.2) << level;
    EXPECT_NEAR(run.sample("First").V_WB.v.x(), -0.2, 2e-3) << level;
    EXPECT_NEAR(run.sample("Second").V_WB.v.x(), -0.2, 2e-3) << level;
  }
}

TEST(Conveyor, ABoxMovesAlongAGuideAtAnAngle) {
  // The guide's face is turned by 45 degrees: the box keeps v cos 45 along it, so that x and y grow alike.
  DeviceRun run("conveyor",
                {"grounds.Belt.mesh=meshes/plate.obj", "parts.First.pose={position_m: [-0.1, 0.0, 0]}",
                 "parts.Second.pose={position_m: [-0.1, -0.14, 0]}",
                 "grounds.Stop.pose={position_m: [0.05, 0.0, 0.001], rpy_deg: [0, 0, -45]}"});
  ASSERT_TRUE(run.run_to(0.6));
  const Vec3 before = run.sample("First").p_WB;
  ASSERT_TRUE(run.run_to(0.8));
  const Vec3 moved = run.sample("First").p_WB - before;
  EXPECT_NEAR(std::abs(moved.x()), 0.02, 5e-4);
  EXPECT_NEAR(std::abs(moved.y()), 0.02, 5e-4);
}

TEST(Conveyor, ACurvedBeltTurnsItsBox) {
  for (const int level : {1, 3}) {
    DeviceRun run(
        "conveyor",
        {at_level(level), "grounds.Belt.mesh=meshes/plate.obj", "grounds.Stop.pose.position_m=[0, 1, 0]",
         "contact.defaults={friction: 0.5, friction_law: stick}",
         "parts.First.pose={position_m: [0.1, 0, 0]}", "parts.Second.pose={position_m: [-0.1, 0, 0]}",
         "conveyors.Conveyor.curve={center_m: [0, 0, 0], radius_m: 0.1}",
         "conveyors.Conveyor.max_acceleration_m_per_s2=0.5"});
    const double h = run.simulation().time_s();
    ASSERT_EQ(h, 0.0);
    ASSERT_TRUE(run.run_to(1.5));
    const double angle = run.signal("Conveyor", "position") / 0.1;
    EXPECT_NEAR(angle, (0.5 * 0.5 * 0.16 + 0.2 * 1.1) / 0.1, 1e-9);
    const double near = level == 1 ? 1e-3 : 2e-3;
    EXPECT_NEAR(run.sample("First").p_WB.x(), 0.1 * std::cos(angle), near) << level;
    EXPECT_NEAR(run.sample("First").p_WB.y(), 0.1 * std::sin(angle), near) << level;
    EXPECT_NEAR(run.sample("First").V_WB.w.z(), 2.0, 0.02) << level;
  }
}

TEST(Conveyor, ABeltOnALiftAddsBothMotions) {
  DeviceRun run("conveyor", {"linear_axes={Lift: {grounds: [Belt], direction: [0, 0, 1], stroke_m: [0, 1], "
                             "max_speed_m_per_s: 0.2, max_acceleration_m_per_s2: 1}}",
                             "grounds.Stop.pose.position_m=[0, 1, 0]"});
  run.set("Lift", "set_position", 0.1);
  ASSERT_TRUE(run.run_to(1.0));
  EXPECT_NEAR(run.sample("First").p_WB.z(), 0.1, 1e-5);
  EXPECT_NEAR(run.sample("First").p_WB.x(), -0.1 + 0.02 + 0.2 * 0.8, 1e-5);
}

TEST(Conveyor, ABoxAtRestSleepsAndWakesWithItsBelt) {
  for (const int level : {1, 3}) {
    DeviceRun run("conveyor", {at_level(level), "conveyors.Conveyor.running=false"});
    ASSERT_TRUE(run.run_to(1.0));
    const std::uint64_t skipped = run.simulation().statistics().part_steps_skipped;
    EXPECT_GT(skipped, 0U) << level;
    run.set("Conveyor", "run", 1.0);
    ASSERT_TRUE(run.run_to(1.5));
    EXPECT_EQ(run.simulation().statistics().part_steps_skipped, skipped) << level;
    EXPECT_NEAR(run.sample("First").V_WB.v.x(), 0.2, 2e-3) << level;
  }
}

TEST(Conveyor, EverySolverAndAlgorithmCarriesByTheTravelOfTheBelt) {
  for (const std::string solver : {"rk2", "rk4", "implicit", "rosenbrock", "automatic", "cvode", "ida"}) {
    for (const std::string algorithm : {"partner_search", "substitute_force", "extended_substitute_force"}) {
      DeviceRun run("conveyor", {"solver.method=" + solver, "interaction={algorithm: " + algorithm + "}"});
      ASSERT_TRUE(run.run_to(1.0)) << solver << " " << algorithm;
      const double travel = run.signal("Conveyor", "position");
      EXPECT_NEAR(travel, 0.02 + 0.2 * 0.8, 1e-12);
      EXPECT_NEAR(run.sample("First").p_WB.x(), -0.1 + travel, 5e-6) << solver << " " << algorithm;
      EXPECT_NEAR(run.sample("Second").V_WB.v.x(), 0.2, 1e-4) << solver << " " << algorithm;
      if (algorithm != "partner_search") continue;  // the others tie Parts in a queue to each other
      ASSERT_TRUE(run.run_to(5.0)) << solver << " " << algorithm;
      EXPECT_NEAR(run.sample("First").p_WB.x(), 0.34, 3e-4) << solver << " " << algorithm;
      EXPECT_NEAR(run.sample("Second").p_WB.x(), 0.24, 6e-4) << solver << " " << algorithm;
    }
  }
}

TEST(Conveyor, FiveBoxesQueueWithoutOverlapAndTheBitsRepeat) {
  std::uint64_t hash = 0;
  for (int repeat = 0; repeat < 2; ++repeat) {
    std::vector<std::string> more{"parts.First.pose.position_m=[0.2, 0, 0]",
                                  "parts.Second.pose.position_m=[0.05, 0.03, 0]"};
    for (int i = 2; i < 5; ++i)
      more.push_back("parts.Box" + std::to_string(i) +
                     "={mesh: meshes/box.obj, mass_kg: 0.5, hierarchy: 1, pose: {position_m: [" +
                     std::to_string(0.2 - 0.15 * i) + ", 0, 0]}}");
    DeviceRun run("conveyor", more);
    ASSERT_TRUE(run.run_to(4.0));
    double front = 0.39;
    for (const std::string name : {"First", "Second", "Box2", "Box3", "Box4"}) {
      const double x = run.sample(name).p_WB.x();
      EXPECT_LT(x + 0.05, front + 2e-5) << name;
      EXPECT_GT(x + 0.05, front - 3e-4) << name;
      EXPECT_NEAR(run.sample(name).V_WB.v.norm(), 0.0, 1e-6) << name;
      front = x - 0.05;
    }
    if (repeat == 1) {
      EXPECT_EQ(run.simulation().state_hash(), hash);
    }
    hash = run.simulation().state_hash();
  }
}

TEST(Conveyor, LevelsChangeOnARunningBelt) {
  DeviceRun run("conveyor", {"processes={cell: {level_of_detail: 1, members: all}}"});
  ASSERT_TRUE(run.run_to(0.5));
  for (const int level : {3, 1}) {
    ASSERT_EQ(run.simulation().set_level_of_detail(-1, level), "") << level;
    const double begin_m = run.sample("First").p_WB.x();
    ASSERT_TRUE(run.run(0.3));
    EXPECT_NEAR(run.sample("First").p_WB.x() - begin_m, 0.06, 1e-3) << level;
  }
}

TEST(Conveyor, ASavedStateContinuesWithTheSameBits) {
  for (const int level : {1, 3}) {
    for (const double saved_s : {0.1, 1.0, 3.0}) {
      DeviceRun run("conveyor", {at_level(level), "contact.defaults.friction_law=stick"});
      SCOPED_TRACE(testing::Message() << level << " " << saved_s);
      expect_same_after_restoring(run, saved_s, saved_s + 0.5);
    }
  }
}

TEST(Conveyor, SleepingChangesNoBit) {
  DeviceRun with("conveyor", {"conveyors.Conveyor.running=false"});
  DeviceRun without("conveyor", {"conveyors.Conveyor.running=false", "sleeping={method: never}"});
  for (DeviceRun* run : {&with, &without}) {
    for (const double on : {1.0, 0.0, 1.0}) {
      ASSERT_TRUE(run->run(0.7));
      run->set("Conveyor", "run", on);
      ASSERT_TRUE(run->run(1.0));
    }
  }
  EXPECT_EQ(with.simulation().state_hash(), without.simulation().state_hash());
  EXPECT_GT(with.simulation().statistics().part_steps_skipped, 0U);
}

}  // namespace
}  // namespace takt

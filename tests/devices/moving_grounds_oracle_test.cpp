// Axes, turntables, cylinders and clamps: what lies on their Grounds against closed forms, at all levels of detail; saved states,
// sleeping.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <string>
#include <vector>

#include "server/devices/moving_grounds.h"
#include "server/simulation/model/cell_frames.h"
#include "tests/support/device_run.h"

namespace takt {
namespace {

using test::at_level;
using test::DeviceRun;
using test::expect_same_after_restoring;

/// Position of a trapezoid from rest over `way` at speed v and acceleration a.
double trapezoid(double t, double way, double v, double a) {
  const double ramp = v / a, end = way / v + ramp;
  if (t <= ramp) return 0.5 * a * t * t;
  if (t <= end - ramp) return v * (t - 0.5 * ramp);
  if (t >= end) return way;
  return way - 0.5 * a * (end - t) * (end - t);
}

class AtLevel : public testing::TestWithParam<int> {};

TEST_P(AtLevel, ALiftRaisesItsBoxByItsTrapezoid) {
  DeviceRun run("lift", {at_level(GetParam())});
  ASSERT_TRUE(run.run_to(0.2));
  const double rest = run.sample("Box").p_WB.z();
  run.set("Lift", "set_position", 0.2);
  while (run.time_s() < 1.5) {
    ASSERT_TRUE(run.step());
    const double lifted = trapezoid(run.time_s() - 0.2, 0.2, 0.2, 1.0);
    ASSERT_NEAR(run.sample("Platform").p_WB.z(), lifted, 1e-12) << run.time_s();
    // The spring yields by m a / k: at level 1 that is 1 m/s^2 of 9.81, of 0.1 mm.
    ASSERT_NEAR(run.sample("Box").p_WB.z() - rest, lifted, 6e-5) << run.time_s();
    if (std::abs(run.time_s() - 1.4) > 0.002) {
      ASSERT_EQ(run.signal("Lift", "in_position"), run.time_s() > 1.4 ? 1.0 : 0.0) << run.time_s();
    }
  }
  ASSERT_TRUE(run.run_to(2.0));
  EXPECT_NEAR(run.sample("Box").p_WB.z() - rest, 0.2, 1e-7);
  EXPECT_EQ(run.signal("Lift", "position"), 0.2);
  EXPECT_EQ(run.signal("Lift", "speed"), 0.0);
  EXPECT_EQ(run.signal("Lift", "at_lower_end"), 0.0);
  run.set("Lift", "set_speed", 0.2);
  ASSERT_TRUE(run.run(3.0));
  EXPECT_EQ(run.signal("Lift", "position"), 0.5);
  EXPECT_EQ(run.signal("Lift", "at_upper_end"), 1.0);
  EXPECT_EQ(run.signal("Lift", "in_position"), 0.0);
}

TEST_P(AtLevel, ATurntableTurnsItsBox) {
  DeviceRun run("turntable",
                {at_level(GetParam()), "contact={defaults: {friction: 0.5, friction_law: stick}}"});
  ASSERT_TRUE(run.run_to(0.1));
  run.set("Turntable", "set_position", std::numbers::pi);
  double furthest = 0.0;
  while (run.time_s() < 4.0) {
    ASSERT_TRUE(run.step());
    const double angle = trapezoid(run.time_s() - 0.1, std::numbers::pi, 1.0, 2.0);
    const Vec3 place(0.1 * std::cos(angle), 0.1 * std::sin(angle), run.sample("Box").p_WB.z());
    furthest = std::max(furthest, (run.sample("Box").p_WB - place).norm());
  }
  EXPECT_LT(furthest, 1e-4);
  EXPECT_NEAR(run.sample("Box").p_WB.x(), -0.1, 1e-4);
  EXPECT_NEAR(run.sample("Box").p_WB.y(), 0.0, 1e-4);
  EXPECT_NEAR(std::abs(run.sample("Box").q_WB.z()), 1.0, 1e-4);
}

INSTANTIATE_TEST_SUITE_P(MovingGrounds, AtLevel, testing::Values(1, 3),
                         [](const auto& level) { return "Level" + std::to_string(level.param); });

TEST(MovingGrounds, ALiftOnALinearAxisAddsBothMotions) {
  DeviceRun run("lift", {"linear_axes.Lift.mounted_on=Carriage",
                         "grounds.Carriage={mesh: meshes/plate.obj, pose: {position_m: [0, 0, -0.5]}}",
                         "linear_axes.Track={grounds: [Carriage], direction: [1, 0, 0], stroke_m: [-1, 1], "
                         "max_speed_m_per_s: 0.5, max_acceleration_m_per_s2: 1}"});
  run.set("Lift", "set_position", 0.2);
  run.set("Track", "set_position", -0.5);
  ASSERT_TRUE(run.run_to(0.7));
  EXPECT_NEAR(run.sample("Platform").p_WB.x(), -trapezoid(0.7, 0.5, 0.5, 1.0), 1e-12);
  EXPECT_NEAR(run.sample("Platform").p_WB.z(), trapezoid(0.7, 0.2, 0.2, 1.0), 1e-12);
  EXPECT_NEAR(run.sample("Platform").V_WB.v.x(), -0.5, 1e-12);
  EXPECT_NEAR(run.sample("Platform").V_WB.v.z(), 0.2, 1e-12);
  ASSERT_TRUE(run.run_to(2.0));
  EXPECT_NEAR(run.sample("Box").p_WB.x(), 0.05 - 0.5, 1e-7);
  EXPECT_NEAR(run.sample("Box").p_WB.z(), 0.2, 1e-6);
}

TEST(MovingGrounds, ABoxAtRestSleepsAndWakesWithItsLift) {
  for (const int level : {1, 3}) {
    DeviceRun run("lift", {at_level(level)});
    ASSERT_TRUE(run.run_to(1.0));
    const std::uint64_t skipped = run.simulation().statistics().part_steps_skipped;
    EXPECT_GT(skipped, 0U) << level;
    run.set("Lift", "set_position", 0.2);
    ASSERT_TRUE(run.run_to(2.199));
    EXPECT_EQ(run.simulation().statistics().part_steps_skipped, skipped) << level;
    EXPECT_NEAR(run.sample("Box").p_WB.z(), 0.2, 1e-4) << level;
    ASSERT_TRUE(run.run_to(4.0));
    EXPECT_GT(run.simulation().statistics().part_steps_skipped, skipped) << level;
  }
}

TEST(MovingGrounds, SleepingChangesNoBit) {
  DeviceRun with("lift"), without("lift", {"sleeping={method: never}"});
  for (DeviceRun* run : {&with, &without}) {
    for (const double target : {0.2, 0.05}) {
      ASSERT_TRUE(run->run(1.0));
      run->set("Lift", "set_position", target);
      ASSERT_TRUE(run->run(2.0));
    }
  }
  EXPECT_EQ(with.simulation().state_hash(), without.simulation().state_hash());
  EXPECT_GT(with.simulation().statistics().part_steps_skipped, 0U);
}

TEST(MovingGrounds, AStateInTheMiddleOfAMotionContinuesWithTheSameBits) {
  for (const int level : {1, 3}) {
    DeviceRun run("lift", {at_level(level)});
    run.set("Lift", "set_position", 0.2);
    expect_same_after_restoring(run, 0.6, 1.5);
  }
}

TEST(Cylinder, ItsStrokeTakesItsTimesAndSwitchesSayTheEnds) {
  DeviceRun run("cylinder");
  ASSERT_TRUE(run.run_to(0.1));
  EXPECT_EQ(run.signal("Cylinder", "retracted"), 1.0);
  run.set("Cylinder", "extend", 1.0);
  ASSERT_TRUE(run.run_to(0.5));
  EXPECT_EQ(run.signal("Cylinder", "retracted"), 0.0);
  EXPECT_EQ(run.signal("Cylinder", "extended"), 0.0);
  ASSERT_TRUE(run.run_to(0.598));
  EXPECT_LT(run.signal("Cylinder", "position"), 0.15);
  ASSERT_TRUE(run.run_to(0.601));
  EXPECT_EQ(run.signal("Cylinder", "position"), 0.15);
  EXPECT_EQ(run.signal("Cylinder", "extended"), 1.0);
  run.set("Cylinder", "extend", 0.0);
  ASSERT_TRUE(run.run_to(0.898));
  EXPECT_GT(run.signal("Cylinder", "position"), 0.0);
  ASSERT_TRUE(run.run_to(0.902));
  EXPECT_EQ(run.signal("Cylinder", "position"), 0.0);
  EXPECT_EQ(run.signal("Cylinder", "retracted"), 1.0);
}

TEST(Cylinder, ItPushesABoxToTheEndOfItsStrokeAndLeavesItThere) {
  for (const int level : {1, 3}) {
    DeviceRun run("cylinder", {at_level(level)});
    run.set("Cylinder", "extend", 1.0);
    ASSERT_TRUE(run.run_to(1.0));
    // The pusher's face stands at -0.12 + 0.15, the box' face 0.05 behind its origin. By friction the box runs further, while the
    // pusher stops with 20 m/s^2.
    const double pushed = run.sample("Box").p_WB.x(), v = trapezoid_speed(0.15, 0.5, 20.0);
    const double further = level == 1 ? 0.0 : 0.5 * v * v * (1.0 / (0.3 * 9.80665) - 1.0 / 20.0);
    EXPECT_NEAR(pushed, 0.08 + further, 3e-4) << level;
    EXPECT_NEAR(run.sample("Box").p_WB.y(), 0.0, 1e-4) << level;
    run.set("Cylinder", "extend", 0.0);
    ASSERT_TRUE(run.run_to(2.0));
    EXPECT_NEAR(run.sample("Box").p_WB.x(), pushed, 1e-4) << level;
  }
}

TEST(Cylinder, AStateInTheMiddleOfAPushContinuesWithTheSameBits) {
  for (const int level : {1, 3}) {
    DeviceRun run("cylinder", {at_level(level)});
    run.set("Cylinder", "extend", 1.0);
    expect_same_after_restoring(run, 0.3, 1.0);
  }
}

TEST(Clamp, AClosedClampHoldsABoxOnARunningBeltUntilItOpens) {
  for (const int level : {1, 3}) {
    DeviceRun run("clamp", {at_level(level)});
    while (run.time_s() < 3.0 && run.signal("Clamp", "part_present") == 0.0) ASSERT_TRUE(run.step());
    // The centre of mass enters the volume at x = -0.02.
    EXPECT_NEAR(run.sample("Box").p_WB.x(), -0.02, level == 1 ? 5e-4 : 1e-3) << level;
    EXPECT_EQ(run.signal("Clamp", "opened"), 1.0) << level;
    run.set("Clamp", "close", 1.0);
    ASSERT_TRUE(run.run(0.048));
    EXPECT_EQ(run.signal("Clamp", "closed"), 0.0) << level;
    EXPECT_EQ(run.signal("Clamp", "holding"), 0.0) << level;
    EXPECT_NEAR(run.sample("Box").V_WB.v.x(), 0.2, 2e-3) << level;
    ASSERT_TRUE(run.run(0.1));
    EXPECT_EQ(run.signal("Clamp", "closed"), 1.0) << level;
    EXPECT_EQ(run.signal("Clamp", "holding"), 1.0) << level;
    const double held_m = run.sample("Box").p_WB.x();
    EXPECT_NEAR(held_m, -0.01, 2e-3) << level;
    ASSERT_TRUE(run.run(0.5));
    EXPECT_NEAR(run.sample("Box").p_WB.x(), held_m, 1e-5) << level;
    EXPECT_EQ(run.signal("Conveyor", "speed"), 0.2) << level;
    std::vector<std::byte> bytes;
    ASSERT_EQ(run.simulation().save_state(bytes), "");
    std::uint64_t hash = 0;
    for (int repeat = 0; repeat < 2; ++repeat) {
      run.set("Clamp", "close", 0.0);
      ASSERT_TRUE(run.run(0.5));
      EXPECT_EQ(run.signal("Clamp", "holding"), 0.0) << level;
      EXPECT_EQ(run.signal("Clamp", "opened"), 1.0) << level;
      EXPECT_NEAR(run.sample("Box").V_WB.v.x(), 0.2, 2e-3) << level;
      if (repeat == 1) {
        EXPECT_EQ(run.simulation().state_hash(), hash) << level;
      }
      hash = run.simulation().state_hash();
      ASSERT_EQ(run.simulation().restore_state(bytes), "") << level;
    }
  }
}

TEST(MovingGrounds, AResetRepeatsTheBits) {
  DeviceRun run("lift");
  std::uint64_t hash = 0;
  for (int repeat = 0; repeat < 2; ++repeat) {
    run.set("Lift", "set_position", 0.2);
    ASSERT_TRUE(run.run_to(0.7));
    if (repeat == 1) {
      EXPECT_EQ(run.simulation().state_hash(), hash);
    }
    hash = run.simulation().state_hash();
    run.simulation().reset();
  }
}

TEST(MovingGrounds, TheirFramesMoveAndThoseOfOtherGroundsStand) {
  const auto cell = test::device_cell("cylinder");
  Simulation simulation(cell);
  const Snapshot snapshot = simulation.make_snapshot();
  const auto has = [](const std::vector<CellFrame>& frames, const std::string& name) {
    return std::any_of(frames.begin(), frames.end(), [&](const CellFrame& f) { return f.name == name; });
  };
  MovingFrames moving(cell->description);
  EXPECT_TRUE(has(moving.fill(snapshot), "Pusher"));
  EXPECT_TRUE(has(moving.fill(snapshot), "Box"));
  EXPECT_FALSE(has(moving.fill(snapshot), "Belt"));
  EXPECT_TRUE(has(static_frames(cell->description, snapshot), "Belt"));
  EXPECT_FALSE(has(static_frames(cell->description, snapshot), "Pusher"));
}

TEST(MovingGrounds, MistakesAreRefusedWithTheirPlace) {
  const auto refusal = [](const std::string& name, const std::vector<std::string>& overrides) {
    try {
      static_cast<void>(test::device_cell(name, overrides));
    } catch (const std::exception& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  const auto expect = [&](const std::string& name, const std::string& override_by, const std::string& text) {
    const std::string why = refusal(name, {override_by});
    EXPECT_NE(why.find(text), std::string::npos) << override_by << ": " << why;
  };
  expect("lift", "linear_axes.Lift.grounds=[Nothing]", "'Nothing'");
  expect("lift", "linear_axes.Lift.mounted_on=Platform", "the device itself carries");
  expect("lift", "linear_axes.Lift.stroke_m=[0.5, 0]", "a greater upper end");
  expect("lift", "linear_axes.Lift.position_m=0.7", "within stroke_m");
  expect("lift", "linear_axes.Lift.direction=[0, 0, 0]", "without direction");
  expect("lift",
         "turntables={Second: {grounds: [Platform], center_m: [0, 0, 0], max_speed_rad_per_s: 1, "
         "max_acceleration_rad_per_s2: 1}}",
         "which another device carries");
  expect("cylinder", "cylinders.Cylinder.extend_time_s=0.1", "at least 2 sqrt");
}

}  // namespace
}  // namespace takt

// A robot on the carriage of an axis: its motion and its loads against closed forms, collisions of its base, saved states.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <string>
#include <vector>

#include "server/simulation/model/cell_frames.h"
#include "tests/support/device_run.h"

namespace takt {
namespace {

using test::at_level;
using test::DeviceRun;
using test::expect_same_after_restoring;

constexpr double kGravity = 9.80665, kGripper_kg = 3.0;

class Riding : public testing::TestWithParam<int> {};

TEST_P(Riding, AStandingArmMovesWithItsCarriage) {
  DeviceRun run("robot_track", {at_level(GetParam())});
  ASSERT_TRUE(run.run_to(0.2));
  const Vec3 from = run.sample("Gripper").p_WB;
  run.set("Track", "set_position", 1.5);
  double furthest = 0.0, fastest = 0.0;
  while (run.time_s() < 3.7) {
    ASSERT_TRUE(run.step());
    const double way = run.sample("Carriage").p_WB.y();
    furthest = std::max(furthest, (run.sample("Gripper").p_WB - from - Vec3(0.0, way, 0.0)).norm());
    fastest = std::max(fastest, run.sample("Gripper").V_WB.v.y());
  }
  // Drives yield: by the square of their bandwidth of 60 rad/s an acceleration of 1 m/s^2 moves a stiff arm by 0.3 mm.
  EXPECT_LT(furthest, GetParam() == 1 ? 1e-12 : 1e-3);
  EXPECT_NEAR(fastest, 0.5, GetParam() == 1 ? 1e-12 : 0.02);
  EXPECT_EQ(run.signal("Track", "in_position"), 1.0);
  EXPECT_NEAR(run.sample("Gripper").p_WB.y() - from.y(), 1.5, 1e-5);
}
INSTANTIATE_TEST_SUITE_P(Robot, Riding, testing::Values(1, 2),
                         [](const auto& level) { return "Level" + std::to_string(level.param); });

/// While the carriage gains 1 m/s^2 along y, mass times this acts on flange and foundation against it, once the arm is at rest on
/// the carriage.
TEST(RidingRobot, AccelerationLoadsFlangeAndFoundation) {
  DeviceRun run("robot_track", {at_level(2), "linear_axes.Track.max_speed_m_per_s=1.4"});
  ASSERT_TRUE(run.run_to(0.2));
  const RobotSample rest = run.snapshot().robots[0];
  run.set("Track", "set_position", 1.5);
  ASSERT_TRUE(run.run_to(1.2));
  const RobotSample gains = run.snapshot().robots[0];
  EXPECT_NEAR(rest.flange_load_W.f.z(), -kGripper_kg * kGravity, 1e-6);
  EXPECT_NEAR(gains.flange_load_W.f.y(), -kGripper_kg, 1e-3 * kGripper_kg);
  EXPECT_NEAR(gains.flange_load_W.f.z(), -kGripper_kg * kGravity, 1e-2);
  const double mass_kg = -rest.base_reaction_W.f.z() / kGravity;
  EXPECT_GT(mass_kg, 25.0);
  EXPECT_NEAR(gains.base_reaction_W.f.y(), -mass_kg, 1e-3 * mass_kg);
  EXPECT_NEAR(gains.base_reaction_W.f.x(), 0.0, 1e-3 * mass_kg);
}

/// On a turntable at 1 rad/s the flange carries the gripper's mass times the distance from the axis.
TEST(RidingRobot, ATurntableLoadsByItsCentripetalAcceleration) {
  DeviceRun run(
      "robot_track",
      {at_level(2), "grounds.Disc={mesh: meshes/track_carriage.obj, pose: {position_m: [-0.75, 0, 0.7]}}",
       "robots.Robot.mounted_on=Disc",
       "turntables.Turn={grounds: [Disc], center_m: [-1.75, 0, 0], max_speed_rad_per_s: 1, "
       "max_acceleration_rad_per_s2: 1}"});
  ASSERT_TRUE(run.run_to(0.2));
  const Vec3 rest_p = run.sample("Gripper").p_WB;
  run.set("Turn", "set_speed", 1.0);
  ASSERT_TRUE(run.run_to(4.0));
  const Vec3 center(-1.75, 0.0, 0.0), arm = run.sample("Gripper").p_WB - center;
  const Vec3 outwards = Vec3(arm.x(), arm.y(), 0.0).normalized();
  EXPECT_NEAR(run.sample("Gripper").V_WB.w.z(), 1.0, 1e-5);
  EXPECT_NEAR(Vec3(arm.x(), arm.y(), 0.0).norm(), Vec3(rest_p.x() + 1.75, rest_p.y(), 0.0).norm(), 1e-3);
  // Its centre of mass is on the gripper's axis, which points down.
  const Vec3 load = run.snapshot().robots[0].flange_load_W.f;
  EXPECT_NEAR(load.dot(outwards), kGripper_kg * Vec3(arm.x(), arm.y(), 0.0).norm(), 0.02 * kGripper_kg);
  EXPECT_NEAR(load.z(), -kGripper_kg * kGravity, 1e-2);
  EXPECT_NEAR(load.dot(outwards.cross(Vec3::UnitZ())), 0.0, 0.02 * kGripper_kg);
}

TEST(RidingRobot, LevelsOfDetailChangeWhileItRides) {
  DeviceRun run("robot_track", {at_level(1)});
  run.set("Track", "set_position", 1.5);
  for (const int level : {2, 1, 2}) {
    ASSERT_TRUE(run.run(0.5));
    ASSERT_EQ(run.simulation().set_level_of_detail(0, level), "");
    ASSERT_TRUE(run.run(0.002));
    EXPECT_NEAR(run.sample("Gripper").V_WB.v.y(), run.signal("Track", "speed"), 0.02) << level;
  }
  ASSERT_TRUE(run.run_to(4.0));
  EXPECT_NEAR(run.sample("Carriage").p_WB.y(), 1.5, 1e-12);
}

TEST(RidingRobot, AStateInTheMiddleOfARideContinuesWithTheSameBits) {
  for (const int level : {1, 2}) {
    DeviceRun run("robot_track", {at_level(level)});
    run.set("Track", "set_position", 1.5);
    SCOPED_TRACE(level);
    expect_same_after_restoring(run, 1.0, 2.0);
  }
}

TEST(RidingRobot, ItsStandingArmCollidesWithWhatIsInTheWay) {
  DeviceRun run(
      "robot_track",
      {at_level(1), "grounds.Post={mesh: ../meshes/P.obj, pose: {position_m: [-0.75, 0.9, 0.75]}}"});
  run.set("Track", "set_position", 1.5);
  std::vector<std::string> met;
  while (run.time_s() < 4.0) {
    ASSERT_TRUE(run.step());
    for (const CollisionEvent& event : run.simulation().events().collision_events) {
      const auto& bodies = run.simulation().description().checked_bodies;
      met.push_back(bodies[static_cast<std::size_t>(event.a)] + " " +
                    bodies[static_cast<std::size_t>(event.b)]);
    }
  }
  const auto of_base = [](const std::string& pair) {
    return pair.find("Robot/base_link") != std::string::npos && pair.find("Post") != std::string::npos;
  };
  EXPECT_TRUE(std::any_of(met.begin(), met.end(), of_base)) << met.size();
  for (const std::string& pair : met) EXPECT_NE(pair.find("Post"), std::string::npos) << pair;
}

TEST(RidingRobot, TheTreeOfFramesHasItsBaseOnTheCarriage) {
  DeviceRun run("robot_track");
  const auto frames = static_frames(run.simulation().description(), run.snapshot());
  const std::string base = base_frame(run.simulation().description().robots[0]);
  const auto found =
      std::find_if(frames.begin(), frames.end(), [&](const CellFrame& f) { return f.name == base; });
  ASSERT_NE(found, frames.end());
  EXPECT_EQ(found->parent, "Carriage");
  EXPECT_NEAR(found->p.norm(), 0.0, 1e-12);
}

}  // namespace
}  // namespace takt

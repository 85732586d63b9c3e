// Kinematics and motion of the controller that takt-ur shows.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "client_lib/gateway/resynchronisation.h"
#include "client_lib/gateway/ur/dh.h"
#include "client_lib/gateway/ur/motion.h"
#include "tests/gateway/ur10e.h"

namespace {

using takt::ArmModel;
using takt::Mat3;
using takt::Pose;
using takt::Vec3;
using takt::test::dh;
using takt::test::kA;
using takt::test::kAlpha;
using takt::test::kD;
using takt::test::kHome;
using takt::test::ur10e;
using takt::ur::Motion;
using takt::ur::Vector6;

TEST(DhParameters, OfARobotWithPublishedParametersAreThese) {
  const auto found = takt::ur::dh_parameters(ur10e()).parameters;
  for (std::size_t i = 0; i < 6; ++i) {
    EXPECT_NEAR(found.a.at(i), kA.at(i), 1e-12) << i;
    EXPECT_NEAR(found.d.at(i), kD.at(i), 1e-12) << i;
    EXPECT_NEAR(found.alpha.at(i), kAlpha.at(i), 1e-12) << i;
    EXPECT_NEAR(found.theta.at(i), 0.0, 1e-12) << i;
  }
}

TEST(DhParameters, OfAnyArmGiveItsFlange) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> number(-1.0, 1.0);
  for (int run = 0; run < 50; ++run) {
    ArmModel arm = ur10e();
    for (auto& joint : arm.joints) {
      joint.axis = Vec3(number(random), number(random), number(random)).normalized();
      joint.X_PJ = {takt::rotation_from_rpy({number(random), number(random), number(random)}),
                    Vec3(number(random), number(random), number(random))};
    }
    const auto found = takt::ur::dh_parameters(arm);
    std::array<double, 16> q{};
    for (std::size_t i = 0; i < 6; ++i) q.at(i) = 3.0 * number(random);
    Pose X = found.X_R0;
    for (std::size_t i = 0; i < 6; ++i)
      X = X * dh(q.at(i) + found.parameters.theta.at(i), found.parameters.d.at(i), found.parameters.a.at(i),
                 found.parameters.alpha.at(i));
    X = X * found.X_6F;
    takt::ArmPoses poses;
    takt::forward_kinematics(arm, q.data(), poses);
    EXPECT_LT((X.p - poses.X_RF.p).norm(), 1e-9) << run;
    EXPECT_LT((X.R - poses.X_RF.R).norm(), 1e-9) << run;
  }
}

struct Robot {
  ArmModel arm = ur10e();
  Motion motion{arm, 0.002};
  Robot() { motion.reset(kHome); }
  /// Advances until the path ends; cycles.
  int run_to_rest(double scaling = 1.0) {
    int cycles = 0;
    while ((motion.follows() || !motion.at_rest()) && cycles < 100000 && motion.advance(scaling)) ++cycles;
    return cycles;
  }
};

TEST(UrMotion, AJointMoveEndsAtItsTargetAndKeepsItsDuration) {
  Robot robot;
  Vector6 to = kHome;
  to[0] += 0.5;
  robot.motion.move_joints(to, {.duration_s = 2.0});
  EXPECT_NEAR(0.002 * robot.run_to_rest(), 2.0, 0.005);
  EXPECT_EQ(robot.motion.position(), to);
  robot.motion.move_joints(kHome, {.duration_s = 2.0});
  EXPECT_NEAR(0.002 * robot.run_to_rest(0.5), 4.0, 0.01) << "half the speed takes twice the time";
}

TEST(UrMotion, ADurationThatTheRobotCannotKeepIsExceeded) {
  Robot robot;
  Vector6 to = kHome;
  to[0] += 3.0;
  robot.motion.move_joints(to, {.duration_s = 0.1});
  double fastest = 0.0;
  while (robot.motion.follows()) {
    robot.motion.advance(1.0);
    fastest = std::max(fastest, std::abs(robot.motion.velocity()[0]));
  }
  EXPECT_LE(fastest, 2.0 * (1.0 + 1e-9));
  EXPECT_EQ(robot.motion.position(), to);
}

TEST(UrMotion, ALineMovesTheToolStraight) {
  Robot robot;
  robot.motion.set_tool({Mat3::Identity(), Vec3(0.0, 0.02, 0.1)});
  const Pose start = robot.motion.tool_pose(kHome);
  Pose end = start;
  end.p += Vec3(-0.1, 0.15, 0.05);
  ASSERT_TRUE(robot.motion.move_line(end, {}));
  const Vec3 direction = (end.p - start.p).normalized();
  while (robot.motion.follows()) {
    ASSERT_TRUE(robot.motion.advance(1.0));
    const Vec3 way = robot.motion.tool_pose(robot.motion.position()).p - start.p;
    EXPECT_LT((way - direction * direction.dot(way)).norm(), 1e-9);
  }
  EXPECT_LT((robot.motion.tool_pose(robot.motion.position()).p - end.p).norm(), 1e-9);
}

TEST(UrMotion, ALineThatIsTooFastForTheJointsTakesLonger) {
  Robot robot;
  Pose end = robot.motion.tool_pose(kHome);
  end.p += Vec3(-0.3, 0.3, 0.1);
  ASSERT_TRUE(robot.motion.move_line(end, {.duration_s = 0.05}));
  double fastest = 0.0;
  while (robot.motion.follows()) {
    ASSERT_TRUE(robot.motion.advance(1.0));
    for (const double speed : robot.motion.velocity()) fastest = std::max(fastest, std::abs(speed));
  }
  EXPECT_GT(fastest, 1.0);
  EXPECT_LE(fastest, 2.0);
  EXPECT_LT((robot.motion.tool_pose(robot.motion.position()).p - end.p).norm(), 1e-9);
}

TEST(UrMotion, AnArcPassesThroughItsMiddle) {
  Robot robot;
  const Pose start = robot.motion.tool_pose(kHome);
  Pose via = start, end = start;
  via.p += Vec3(0.05, 0.05, 0.0);
  end.p += Vec3(0.1, 0.0, 0.0);
  ASSERT_TRUE(robot.motion.move_arc(via, end, {}));
  double nearest = 1.0;
  while (robot.motion.follows()) {
    ASSERT_TRUE(robot.motion.advance(1.0));
    nearest = std::min(nearest, (robot.motion.tool_pose(robot.motion.position()).p - via.p).norm());
  }
  EXPECT_LT(nearest, 1e-3);
  EXPECT_LT((robot.motion.tool_pose(robot.motion.position()).p - end.p).norm(), 1e-9);
}

TEST(UrMotion, ALineOutOfReachIsRefused) {
  Robot robot;
  EXPECT_FALSE(robot.motion.move_line({Mat3::Identity(), Vec3(10.0, 0.0, 0.0)}, {}));
}

TEST(UrMotion, ServoFollowsSetPointsAndContinuesWhereOneIsMissing) {
  Robot robot;
  robot.motion.begin_servo();
  Vector6 q = kHome;
  for (int i = 0; i < 10; ++i) {
    q[5] += 0.001;
    robot.motion.servo(q);
    robot.motion.advance(1.0);
    EXPECT_EQ(robot.motion.position(), q);
  }
  robot.motion.advance(1.0);
  EXPECT_NEAR(robot.motion.position()[5], q[5] + 0.001, 1e-12);
}

TEST(UrMotion, StopBrakesWithItsDeceleration) {
  Robot robot;
  robot.motion.speed({1.0, 0, 0, 0, 0, 0});
  for (int i = 0; i < 200; ++i) robot.motion.advance(1.0);
  EXPECT_NEAR(robot.motion.velocity()[0], 1.0, 1e-9);
  robot.motion.stop(4.0);
  EXPECT_NEAR(0.002 * robot.run_to_rest(), 1.0 / 4.0, 0.01);
}

TEST(UrMotion, SpeedsOfJointsAndToolAreReachedWithTheirAcceleration) {
  // v = a t and, for the joints, s = a t^2 / 2.
  constexpr double kSeconds = 0.5, kAcceleration = 0.8;
  Robot joints, tool;
  joints.motion.speed({1.0, 0, 0, 0, 0, -0.5}, kAcceleration);
  tool.motion.tool_speed_command({0.0, 0.0, 0.2, 0.0, 0.0, 0.0}, 0.2);
  for (int i = 0; i < 250; ++i) {
    EXPECT_FALSE(joints.motion.has_speed());
    EXPECT_FALSE(tool.motion.has_speed());
    joints.motion.advance(1.0);
    ASSERT_TRUE(tool.motion.advance(1.0));
  }
  EXPECT_NEAR(joints.motion.velocity()[0], kAcceleration * kSeconds, 1e-9);
  EXPECT_NEAR(joints.motion.velocity()[5], -0.5 * kAcceleration * kSeconds, 1e-9) << "both end together";
  EXPECT_NEAR(joints.motion.position()[0] - kHome[0], 0.5 * kAcceleration * kSeconds * kSeconds, 1e-9);
  const auto twist = tool.motion.tool_speed(tool.motion.position(), tool.motion.velocity());
  EXPECT_NEAR(twist[2], 0.2 * kSeconds, 1e-3);
  EXPECT_NEAR(twist[0], 0.0, 1e-3);
  for (int i = 0; i < 500; ++i) {
    joints.motion.advance(1.0);
    tool.motion.advance(1.0);
  }
  EXPECT_TRUE(joints.motion.has_speed());
  EXPECT_TRUE(tool.motion.has_speed());
}

TEST(UrMotion, AToolSpeedThatLeavesTheReachStopsTheRobot) {
  Robot robot;
  const Vec3 start = robot.motion.tool_pose(kHome).p;
  robot.motion.tool_speed_command({0.2, 0.0, 0.0, 0.0, 0.0, 0.0}, 1.2);
  int cycles = 0;
  for (; robot.motion.advance(1.0); ++cycles) {
    ASSERT_LT(cycles, 10000) << "beyond the reach";
    const Vec3 way = robot.motion.tool_pose(robot.motion.position()).p - start;
    ASSERT_LT(std::hypot(way.y(), way.z()), 5e-3) << cycles;
    for (std::size_t i = 0; i < 6; ++i)
      ASSERT_LE(std::abs(robot.motion.velocity()[i]), robot.arm.joints[i].max_velocity);
  }
  EXPECT_GT(cycles, 500);
  for (int i = 0; i < 250; ++i) EXPECT_TRUE(robot.motion.advance(1.0));
  EXPECT_TRUE(robot.motion.at_rest());
}

TEST(UrMotion, ACubicSplineIsItsPolynomial) {
  Robot robot;
  takt::ur::Spline spline;
  spline.duration_s = 1.0;
  spline.last = true;
  spline.coefficients[0] = kHome;
  spline.coefficients[2][0] = 0.3;  // 0.3 (t^2 - 2/3 t^3): at rest at its end
  spline.coefficients[3][0] = -0.2;
  robot.motion.run_spline(spline);
  for (int i = 1; robot.motion.follows(); ++i) {
    robot.motion.advance(1.0);
    const double t = std::min(1.0, 0.002 * i);
    EXPECT_NEAR(robot.motion.position()[0], kHome[0] + 0.3 * t * t - 0.2 * t * t * t, 1e-9);
  }
  EXPECT_TRUE(robot.motion.at_rest());
}

TEST(Resynchronisation, LeadsTheRobotToCommandsThatMove) {
  takt::gateway::Resynchronisation resynchronisation(
      {.on_jump = takt::gateway::OnJump::ramp, .ramp_speed = 0.5});
  std::vector<double> command{1.0, 0.0}, before{0.0, 0.0};
  const std::vector<double> present{0.0, 0.0};
  int cycles = 0;
  while (!resynchronisation.engaged()) {
    command[1] += 0.001;
    const auto set_point = resynchronisation.next(command, present, 0.01);
    ASSERT_TRUE(set_point);
    EXPECT_NEAR((*set_point)[0] - before[0], 0.005, 1e-12);
    before = *set_point;
    ++cycles;
  }
  EXPECT_EQ(cycles, 200);
  EXPECT_EQ(before, command);
}

TEST(Resynchronisation, RefusesUntilTheControllerIsNear) {
  takt::gateway::Resynchronisation resynchronisation(
      {.on_jump = takt::gateway::OnJump::refuse, .nearness = 0.05});
  const std::vector<double> present{0.0};
  EXPECT_FALSE(resynchronisation.next(std::vector<double>{0.2}, present, 0.01));
  EXPECT_TRUE(resynchronisation.next(std::vector<double>{0.04}, present, 0.01));
}

}  // namespace

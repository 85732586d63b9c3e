// Kinematic robot and gripper: continuity of the interpolation, rated velocities, exact rest.
#include <gtest/gtest.h>

#include <cmath>

#include "plant_models/gripper/parallel_gripper.h"
#include "plant_models/robot/kinematic_robot.h"

namespace takt {
namespace {

KinematicRobot slide(double max_velocity = 2.0) {
  KinematicRobotParameters p;
  p.robot = 0;
  JointModel joint;
  joint.name = "x";
  joint.type = JointType::prismatic;
  joint.axis = Vec3::UnitX();
  joint.lower = -1.0, joint.upper = 1.0, joint.max_velocity = max_velocity;
  p.arm.joints.push_back(joint);
  return KinematicRobot(p);
}

struct State {
  double q = 0.0, qd = 0.0;
};
State state(const KinematicRobot& robot, double t) {
  JointArray q{}, qd{};
  robot.joint_state(t, q.data(), qd.data());
  return {q[0], qd[0]};
}

TEST(KinematicRobot, TheRobotFollowsAStreamOnePeriodLaterWithContinuousVelocity) {
  KinematicRobot robot = slide();
  const double T = 0.008;
  const auto q = [](double t) { return 0.1 * (1.0 - std::cos(3.0 * t)); };
  const auto v = [](double t) { return 0.3 * std::sin(3.0 * t); };
  State before{};
  for (int k = 0; k < 200; ++k) {
    const double t = k * T;
    before = state(robot, t);
    const double position = q(t + T), velocity = v(t + T);
    robot.set_point(t, T, &position, &velocity);
    EXPECT_EQ(state(robot, t).q, before.q) << "a new set-point must not move the robot";
    EXPECT_EQ(state(robot, t).qd, before.qd);
    EXPECT_NEAR(state(robot, t + T).q, position, 1e-15);
    EXPECT_NEAR(state(robot, t + T).qd, velocity, 1e-13);
    EXPECT_NEAR(state(robot, t + 0.5 * T).q, q(t + 0.5 * T), 1e-8);  // cubic: error of order T^4
    const double d = 1e-7;                                           // velocity is the derivative of position
    EXPECT_NEAR((state(robot, t + 0.3 * T + d).q - state(robot, t + 0.3 * T - d).q) / (2 * d),
                state(robot, t + 0.3 * T).qd, 1e-7);
  }
}

TEST(KinematicRobot, TheRobotCoastsToRestWithoutAJumpWhenTheStreamStops) {
  KinematicRobot robot = slide();
  const double position = 0.01, velocity = 1.0, T = 0.01;
  robot.set_point(0.0, T, &position, &velocity);
  EXPECT_NEAR(state(robot, T).qd, 1.0, 1e-12);
  EXPECT_NEAR(state(robot, T + 1e-9).qd, 1.0, 1e-6);
  EXPECT_NEAR(state(robot, 2 * T).q, 0.015, 1e-12);  // v T / 2 beyond the set-point
  EXPECT_EQ(state(robot, 2 * T).qd, 0.0);
  EXPECT_TRUE(robot.at_rest(2 * T));
  EXPECT_EQ(state(robot, 5.0).q, state(robot, 2 * T).q);
}

TEST(KinematicRobot, AJumpTakesTheTimeOfTheRatedVelocity) {
  KinematicRobot robot = slide(0.5);
  const double position = 0.4;
  robot.set_point(0.0, 0.008, &position, nullptr);
  double fastest = 0.0;
  for (double t = 0.0; t < 2.0; t += 1e-3) fastest = std::max(fastest, std::abs(state(robot, t).qd));
  EXPECT_LE(fastest, 0.5 * (1.0 + 1e-9));
  EXPECT_GT(fastest, 0.49);
  EXPECT_EQ(state(robot, 2.0).q, 0.4);
}

TEST(KinematicRobot, VelocitiesAreDerivedFromAStreamOfPositions) {
  KinematicRobot robot = slide();
  const double T = 0.01;
  for (int k = 0; k < 50; ++k) {
    const double position = 0.2 * (k + 1) * T;
    robot.set_point(k * T, T, &position, nullptr);
  }
  EXPECT_NEAR(state(robot, 49.5 * T).qd, 0.2, 1e-9);
}

TEST(KinematicRobot, AConstantSetPointChangesNothing) {
  KinematicRobot robot = slide();
  const double position = 0.1, velocity = 0.0;
  robot.set_point(0.0, 0.1, &position, &velocity);
  const std::uint64_t revision = robot.revision();
  const State at_rest = state(robot, 0.2);
  robot.set_point(0.2, 0.1, &position, &velocity);
  EXPECT_EQ(robot.revision(), revision);
  EXPECT_EQ(state(robot, 0.25).q, at_rest.q);
  EXPECT_TRUE(robot.at_rest(0.2));
}

TEST(KinematicRobot, AccelerationIsTheDerivativeOfTheVelocity) {
  KinematicRobot robot = slide();
  const double position = 0.003, velocity = 0.4;
  robot.set_point(0.0, 0.008, &position, &velocity);
  for (const double t : {0.001, 0.005, 0.0079, 0.0081, 0.012, 0.0159, 0.02}) {
    JointArray acceleration{};
    robot.joint_acceleration(t, acceleration.data());
    const double h = 1e-6;
    EXPECT_NEAR(acceleration[0], (state(robot, t + h).qd - state(robot, t - h).qd) / (2.0 * h), 1e-6) << t;
  }
}

TEST(KinematicRobot, TheRobotFollowsATrajectoryUntilTheFirstSetPoint) {
  KinematicRobot robot = slide();
  const double from[] = {0.1}, to[] = {0.6};
  const MotionLimits limits[] = {{1.0, 4.0}};  // 0.25 s each to accelerate and brake, 0.25 s in between
  robot.set_trajectory(point_to_point(1.0, from, to, limits));
  for (int repetition = 0; repetition < 2; ++repetition) {
    EXPECT_EQ(state(robot, 0.5).q, 0.1);
    EXPECT_NEAR(state(robot, 1.25).q, 0.1 + 0.125, 1e-15);
    EXPECT_NEAR(state(robot, 1.3).qd, 1.0, 1e-14);
    EXPECT_NEAR(state(robot, 1.6).qd, 0.6, 1e-14);
    EXPECT_FALSE(robot.at_rest(1.7));
    EXPECT_TRUE(robot.at_rest(1.75));
    EXPECT_EQ(state(robot, 2.0).q, 0.6);
    double t = 0.0;
    for (const double corner : {1.0, 1.25, 1.5, 1.75})
      EXPECT_NEAR(t = robot.next_time_event(t), corner, 1e-15);
    EXPECT_GT(robot.next_time_event(t), 1e300);

    const double position = 0.35, velocity = 0.0;
    const State before = state(robot, 1.4);
    robot.set_point(1.4, 0.5, &position, &velocity);
    EXPECT_EQ(state(robot, 1.4).q, before.q);
    EXPECT_EQ(state(robot, 1.4).qd, before.qd);
    EXPECT_NEAR(state(robot, 3.0).q, 0.35, 1e-15);
    EXPECT_GT(robot.next_time_event(0.0), 1e300);
    robot.reset();
  }
  // A path too short for full speed, and one of zero length.
  const double near[] = {0.2}, square[] = {0.1};
  EXPECT_EQ(point_to_point(0.0, from, near, limits).size(), 3u);
  EXPECT_NEAR(point_to_point(0.0, from, near, limits)[1].qd[0], std::sqrt(0.1 * 4.0), 1e-15);
  EXPECT_EQ(point_to_point(0.0, from, square, limits).size(), 1u);
  EXPECT_THROW(point_to_point(0.0, from, to, std::vector<MotionLimits>{{1.0, 0.0}}), std::invalid_argument);
  std::vector<TrajectoryKnot> knots(2);
  EXPECT_THROW(robot.set_trajectory(knots), std::invalid_argument) << "equal times";
  knots[1].t = 1.0, knots[1].qd[0] = 0.5;
  EXPECT_THROW(robot.set_trajectory(knots), std::invalid_argument) << "moves at the end";
}

TEST(ParallelGripper, EachJawMovesAtRatedSpeed) {
  ParallelGripperParameters p;
  p.max_width_m = p.initial_width_m = 0.15;
  p.jaw_speed_m_per_s = 0.075;
  ParallelGripper gripper(p);
  EXPECT_FALSE(gripper.moving(0.0));
  gripper.move_to(1.0, 0.0);
  EXPECT_NEAR(gripper.width(1.0), 0.15, 1e-15);
  EXPECT_NEAR(gripper.width(1.5), 0.15 - 0.075, 1e-15);
  EXPECT_EQ(gripper.speed(1.5, ParallelGripper::left), -0.075);
  EXPECT_NEAR(gripper.next_time_event(1.5), 2.0, 1e-15);
  EXPECT_EQ(gripper.speed(2.1, ParallelGripper::left), 0.0);
  gripper.stop_jaw(1.5, ParallelGripper::left, 0.03);
  EXPECT_TRUE(gripper.blocked(ParallelGripper::left));
  EXPECT_FALSE(gripper.blocked(ParallelGripper::right));
  EXPECT_NEAR(gripper.coordinate(3.0, ParallelGripper::left), 0.03, 1e-15);
  EXPECT_NEAR(gripper.coordinate(3.0, ParallelGripper::right), 0.0, 1e-15);
  gripper.move_to(3.0, 0.0);
  EXPECT_TRUE(gripper.blocked(ParallelGripper::left)) << "pressing on does not free the jaw";
  gripper.move_to(3.0, 0.1);
  EXPECT_FALSE(gripper.blocked(ParallelGripper::left));
  EXPECT_NEAR(gripper.width(9.0), 0.1, 1e-15);
}

TEST(ParallelGripper, JawFacesAreOpposite) {
  const Pose left = ParallelGripper::jaw_pose(ParallelGripper::left, 0.04);
  const Pose right = ParallelGripper::jaw_pose(ParallelGripper::right, 0.03);
  EXPECT_NEAR((left * Vec3(0, 0.01, 0)).y(), 0.05, 1e-15);    // material of the left jaw lies outwards
  EXPECT_NEAR((right * Vec3(0, 0.01, 0)).y(), -0.04, 1e-15);  // and so does that of the right one
  EXPECT_NEAR(right.R.determinant(), 1.0, 1e-15);
}

}  // namespace
}  // namespace takt

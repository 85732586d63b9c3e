// takt::Arm on the UR10e: poses in the world, and trajectories as the server's cubic curves read them.
#include "client_lib/kinematics/arm.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <random>

#include "idl/common/eigen_messages.h"
#include "tests/support/controller_test_cell.h"

namespace takt {
namespace {

using testing::HasSubstr;
using testing::ThrowsMessage;

const Pose kBase{rotation_from_rpy({0.0, 0.0, 0.4}), {-0.75, 0.1, 0.7}};
const Pose kTool{rotation_from_rpy({0.1, 0.0, 0.2}), {0.0, 0.02, 0.2}};
const std::vector<double> kHome(controller::kHome1.begin(), controller::kHome1.begin() + 6);

const Arm& arm() {
  static const Arm made("Robot1", controller::ur10e(), kBase, kTool);
  return made;
}

takt_msgs::msg::Transform message_of(const Pose& X) {
  return {to_vector(X.p), to_rotation_matrix(X.R)};
}

takt_msgs::msg::CellDescription description() {
  takt_msgs::msg::CellDescription cell;
  for (const char* name : {"Robot0", "Robot1"}) {
    auto& robot = cell.robots.emplace_back();
    robot.name = name;
    for (const JointModel& joint : arm().model().joints) {
      robot.joints.push_back({joint.name, joint.type, message_of(joint.X_PJ), to_vector(joint.axis),
                              joint.lower, joint.upper, joint.max_velocity, joint.max_effort});
    }
    robot.flange = message_of(arm().model().X_JF);
    robot.base = message_of(kBase);
  }
  auto& gripper = cell.grippers.emplace_back();
  gripper.name = "Gripper1";
  gripper.robot = 1;
  gripper.mount = message_of({Mat3::Identity(), {0.0, 0.02, 0.1}});
  gripper.tool_center_point = message_of({kTool.R, {0.0, 0.0, 0.1}});
  return cell;
}

double distance(const Pose& a, const Pose& b) {
  return std::max((a.p - b.p).norm(), (a.R - b.R).norm());
}

/// The cubic between two points at part u of the time between them.
std::vector<double> between(const TrajectoryPoint& a, const TrajectoryPoint& b, double u) {
  const double h = b.time_s - a.time_s;
  std::vector<double> q(a.positions.size());
  for (std::size_t j = 0; j < q.size(); ++j)
    q[j] = (1.0 + 2.0 * u) * (1.0 - u) * (1.0 - u) * a.positions[j] +
           u * (1.0 - u) * (1.0 - u) * h * a.velocities[j] + u * u * (3.0 - 2.0 * u) * b.positions[j] -
           u * u * (1.0 - u) * h * b.velocities[j];
  return q;
}

TEST(Arm, ForwardAndInverseKinematicsAreInverse) {
  std::mt19937 random(11);
  for (int i = 0; i < 300; ++i) {
    std::vector<double> q;
    for (const JointModel& joint : arm().model().joints)
      q.push_back(std::uniform_real_distribution<double>(joint.lower, joint.upper)(random));
    const Pose X_WT = arm().forward_kinematics(q);
    ASSERT_LT(distance(arm().forward_kinematics(arm().inverse_kinematics(X_WT, kHome)), X_WT), 1e-11) << i;
  }
}

TEST(Arm, TheDescriptionOfACellMakesTheSameArm) {
  const takt_msgs::msg::CellDescription cell = description();
  EXPECT_LT(
      distance(Arm(cell, "Robot1", "Gripper1").forward_kinematics(kHome), arm().forward_kinematics(kHome)),
      1e-14);
  EXPECT_LT(distance(Arm(cell, "Robot1").forward_kinematics(kHome) * kTool, arm().forward_kinematics(kHome)),
            1e-14);
  const Pose X_WT = arm().forward_kinematics(kHome);
  EXPECT_EQ(pose_of(isometry_of(X_WT)), X_WT);
  EXPECT_THAT([&] { Arm(cell, "Robot7"); },
              ThrowsMessage<MotionError>(HasSubstr("no robot 'Robot7'; it has Robot0, Robot1")));
  EXPECT_THAT([&] { Arm(cell, "Robot0", "Gripper1"); },
              ThrowsMessage<MotionError>(HasSubstr("'Gripper1' is not on robot 'Robot0'")));
}

TEST(Arm, APoseOutOfReachIsReportedWithItsDistance) {
  const Pose far{Mat3::Identity(), kBase.p + Vec3{5.0, 0.0, 0.0}};
  EXPECT_THAT([&] { (void)arm().inverse_kinematics(far, kHome); },
              ThrowsMessage<MotionError>(HasSubstr("cannot be reached")));
  EXPECT_THAT([&] { (void)arm().forward_kinematics(std::vector<double>(5)); },
              ThrowsMessage<MotionError>(HasSubstr("has 6 joints (shoulder_pan_joint")));
}

TEST(Arm, TheToolMovesOnAStraightLineAndTurnsAboutOneAxis) {
  const Pose start = arm().forward_kinematics(kHome);
  Pose end = start;
  end.p += Vec3{-0.1, 0.15, 0.05};
  end.R = Eigen::AngleAxisd(0.5, Vec3(1.0, 2.0, 2.0) / 3.0).toRotationMatrix() * start.R;
  const std::vector<TrajectoryPoint> points = arm().plan_line(kHome, end);
  ASSERT_GT(points.size(), 50U);
  EXPECT_LT(distance(arm().forward_kinematics(points.back().positions), end), 1e-11);
  EXPECT_EQ(points.back().velocities, std::vector<double>(6, 0.0));
  const Vec3 way = end.p - start.p;
  TrajectoryPoint before{0.0, kHome, std::vector<double>(6, 0.0)};
  double last = 0.0;
  for (const TrajectoryPoint& point : points) {
    for (const double u : {0.5, 1.0}) {
      const Pose X = arm().forward_kinematics(between(before, point, u));
      const double s = (X.p - start.p).dot(way) / way.squaredNorm();
      EXPECT_GE(s, last - 1e-12);
      last = s;
      const Pose expected{Eigen::AngleAxisd(0.5 * s, Vec3(1.0, 2.0, 2.0) / 3.0).toRotationMatrix() * start.R,
                          start.p + s * way};
      ASSERT_LT(distance(X, expected), u == 1.0 ? 1e-11 : 2e-8) << "at " << point.time_s;
    }
    before = point;
  }
}

TEST(Arm, JointMovesKeepTheSpeedLimitsBetweenTheirPointsToo) {
  std::mt19937 random(12);
  std::uniform_real_distribution<double> range(-1.5, 1.5);
  for (int i = 0; i < 20; ++i) {
    std::vector<double> target = kHome;
    for (std::size_t j = 0; j < target.size(); ++j) {
      const JointModel& joint = arm().model().joints[j];
      target[j] = std::clamp(target[j] + range(random), joint.lower, joint.upper);
    }
    const std::vector<TrajectoryPoint> points =
        arm().plan_joint_move(kHome, target, {.speed = 1.0, .acceleration_rad_per_s2 = 40.0});
    EXPECT_EQ(points.back().positions, target);
    TrajectoryPoint before{0.0, kHome, std::vector<double>(6, 0.0)};
    for (const TrajectoryPoint& point : points) {
      constexpr int kParts = 16;
      std::vector<double> last = before.positions;
      for (int part = 1; part <= kParts; ++part) {
        const std::vector<double> q = between(before, point, static_cast<double>(part) / kParts);
        for (std::size_t j = 0; j < q.size(); ++j)
          ASSERT_LE(std::abs(q[j] - last[j]) * kParts / Arm::kPeriod_s,
                    arm().model().joints[j].max_velocity * (1.0 + 1e-9));
        last = q;
      }
      before = point;
    }
  }
}

TEST(Arm, LinesThatAreTooFastAreRefused) {
  Pose end = arm().forward_kinematics(kHome);
  end.p.z() += 0.2;
  EXPECT_THAT(
      [&] { (void)arm().plan_line(kHome, end, {.speed_m_per_s = 50.0, .acceleration_m_per_s2 = 500.0}); },
      ThrowsMessage<MotionError>(HasSubstr("go slower")));
  EXPECT_THAT([&] { (void)arm().plan_line(kHome, end, {}, 0.0); },
              ThrowsMessage<MotionError>(HasSubstr("period_s = 0 is not allowed")));
}

}  // namespace
}  // namespace takt

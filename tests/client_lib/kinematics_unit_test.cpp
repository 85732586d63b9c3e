// Inverse kinematics and the motions built on it, on the UR10e.
#include <gmock/gmock.h>

#include <random>

#include "client_lib/kinematics/inverse_kinematics.h"
#include "client_lib/kinematics/motions.h"
#include "tests/support/controller_test_cell.h"

namespace takt::controller {
namespace {

using testing::HasSubstr;

constexpr double kPeriod_s = 0.008;
const Pose kX_FT{Mat3::Identity(), {0.0, 0.0, 0.2}};

Pose flange(const ArmModel& arm, const JointArray& q) {
  ArmPoses poses;
  forward_kinematics(arm, q.data(), poses);
  return poses.X_RF;
}

JointArray random_joints(const ArmModel& arm, std::mt19937& random, double share = 1.0) {
  JointArray q{};
  for (size_t i = 0; i < arm.joints.size(); ++i) {
    std::uniform_real_distribution<double> value(share * arm.joints[i].lower, share * arm.joints[i].upper);
    q[i] = value(random);
  }
  return q;
}

bool within_limits(const ArmModel& arm, const JointArray& q) {
  for (size_t i = 0; i < arm.joints.size(); ++i) {
    if (q[i] < arm.joints[i].lower || q[i] > arm.joints[i].upper) return false;
  }
  return true;
}

/// The UR10e on a linear axis of one metre: seven joints, one of them prismatic.
ArmModel arm_on_rail() {
  ArmModel arm = ur10e();
  JointModel rail;
  rail.name = "rail";
  rail.type = JointType::prismatic;
  rail.axis = Vec3::UnitX();
  rail.lower = -0.5;
  rail.upper = 0.5;
  rail.max_velocity = 0.5;
  arm.joints.insert(arm.joints.begin(), rail);
  return arm;
}

void expect_random_poses_solved(const ArmModel& arm, int count, unsigned seed) {
  std::mt19937 random(seed);
  for (int i = 0; i < count; ++i) {
    const Pose target = flange(arm, random_joints(arm, random));
    const IkSolution solution = solve_ik(arm, target, random_joints(arm, random, 0.5));
    ASSERT_TRUE(solution.found) << "pose " << i;
    const Pose reached = flange(arm, solution.q);
    ASSERT_LT((reached.p - target.p).norm(), 2e-12);
    ASSERT_LT((reached.R - target.R).norm(), 4e-12);
    ASSERT_TRUE(within_limits(arm, solution.q));
  }
}

TEST(InverseKinematics, RandomReachablePosesAreReached) {
  expect_random_poses_solved(ur10e(), 1000, 1);
}

TEST(InverseKinematics, ArmsOfMoreThanSixJointsReachPoses) {
  expect_random_poses_solved(arm_on_rail(), 100, 2);
}

TEST(InverseKinematics, TheSolutionIsNearTheSeed) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> small(-0.02, 0.02);
  for (int i = 0; i < 500; ++i) {
    JointArray q = kHome1;
    for (size_t j = 0; j < 6; ++j) q[j] += 20.0 * small(random);
    JointArray near = q;
    for (size_t j = 0; j < 6; ++j) near[j] += small(random);
    const IkSolution solution = solve_ik(ur10e(), flange(ur10e(), near), q);
    ASSERT_TRUE(solution.found);
    for (size_t j = 0; j < 6; ++j) ASSERT_NEAR(solution.q[j], near[j], 1e-9);
  }
}

TEST(InverseKinematics, PosesOutOfReachAreReported) {
  Pose target = flange(ur10e(), kHome1);
  target.p = Vec3(2.0, 0.0, 0.5);
  const IkSolution solution = solve_ik(ur10e(), target, kHome1);
  EXPECT_FALSE(solution.found);
  // The flange reaches 0.6127 + 0.57155 + the wrist's offsets; the residual is the missing distance.
  EXPECT_GT(solution.position_error_m, 0.5);
  EXPECT_LT(solution.position_error_m, 1.2);
}

TEST(InverseKinematics, TheRotationVectorInvertsTheRotation) {
  std::mt19937 random(4);
  std::normal_distribution<double> value;
  for (const double angle : {0.0, 1e-12, 1e-6, 0.1, 1.0, 2.6, 3.0, 3.14159, M_PI - 1e-9}) {
    for (int i = 0; i < 50; ++i) {
      const Vec3 axis = Vec3(value(random), value(random), value(random)).normalized();
      const Vec3 found = rotation_vector(Eigen::AngleAxisd(angle, axis).toRotationMatrix());
      EXPECT_LT((found - angle * axis).norm(), 1e-8 * (angle > 3.0 ? 1.0 : 1e-6) + 1e-15) << angle;
    }
  }
}

TEST(InverseKinematics, JointVelocitiesGiveTheTwist) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> value(-1.0, 1.0);
  for (const ArmModel& arm : {ur10e(), arm_on_rail()}) {
    for (int i = 0; i < 200; ++i) {
      const JointArray q = random_joints(arm, random);
      ArmPoses poses;
      forward_kinematics(arm, q.data(), poses);
      Twist wanted;
      wanted.v = Vec3(value(random), value(random), value(random));
      wanted.w = Vec3(value(random), value(random), value(random));
      JointArray qd{};
      if (!joint_velocities(arm, poses, wanted, qd)) continue;
      const Twist got = flange_twist(arm, poses, qd.data());
      ASSERT_LT((got.v - wanted.v).norm() + (got.w - wanted.w).norm(), 1e-6);
    }
  }
}

TEST(InverseKinematics, AStretchedArmIsSingular) {
  const JointArray stretched{0.3, -1.0, 0.0, 0.5, 1.0, 0.0};
  ArmPoses poses;
  forward_kinematics(ur10e(), stretched.data(), poses);
  JointArray qd{};
  EXPECT_FALSE(joint_velocities(ur10e(), poses, {{0.1, 0.0, 0.0}, {0.0, 0.0, 0.0}}, qd));
}

TEST(JointMotion, JointsMoveInSynchronyWithinLimits) {
  const ArmModel& arm = ur10e();
  std::mt19937 random(6);
  for (int i = 0; i < 50; ++i) {
    const JointArray from = random_joints(arm, random), to = random_joints(arm, random);
    const JointMotionOptions options{0.7, 1.2, 0.0};
    const JointMotion motion(arm, from, to, options, kPeriod_s);
    ArmSetPoint before{from, {}}, here;
    for (long k = 1; k <= motion.periods(); ++k) {
      motion.evaluate(k, here);
      const double share = (here.position[0] - from[0]) / (to[0] - from[0]);
      for (size_t j = 0; j < 6; ++j) {
        ASSERT_NEAR((here.position[j] - from[j]) / (to[j] - from[j]), share, 1e-9);
        ASSERT_LE(std::abs(here.velocity[j]), 0.7 * arm.joints[j].max_velocity * (1.0 + 1e-12));
        ASSERT_LE(std::abs(here.velocity[j] - before.velocity[j]), 1.2 * kPeriod_s * (1.0 + 1e-12));
      }
      before = here;
    }
    EXPECT_EQ(before.position, to);
    EXPECT_EQ(before.velocity, JointArray{});
  }
}

TEST(JointMotion, PositionsOutOfRangeAreRefused) {
  JointArray to = kHome1;
  to[2] = 3.5;
  try {
    JointMotion(ur10e(), kHome1, to, {}, kPeriod_s);
    FAIL() << "not refused";
  } catch (const std::runtime_error& error) {
    EXPECT_THAT(error.what(), HasSubstr("elbow_joint: position 3.5 rad is outside [-3.14159, 3.14159]"));
  }
}

TEST(LineMotion, TheMotionIsStraightAndTurnsEvenly) {
  const ArmModel& arm = ur10e();
  const Pose start = flange(arm, kHome1) * kX_FT;
  const Vec3 axis = Vec3(0.2, -0.3, 0.9).normalized();
  Pose end = start;
  end.p += Vec3(0.25, -0.2, -0.15);
  end.R = Eigen::AngleAxisd(0.6, axis).toRotationMatrix() * start.R;
  const LineMotion motion(arm, kX_FT, kHome1, end, {}, kPeriod_s);
  const Vec3 along = (end.p - start.p).normalized();
  ArmSetPoint here{kHome1, {}};
  for (long k = 1; k <= motion.periods(); ++k) {
    motion.evaluate(k, here);
    const Pose X_RT = flange(arm, here.position) * kX_FT;
    const Vec3 way = X_RT.p - start.p;
    ASSERT_LT((way - way.dot(along) * along).norm(), 1e-11);
    // The share of the turn is the share of the way, about the same axis.
    const double share = way.dot(along) / (end.p - start.p).norm();
    const Mat3 turned = Eigen::AngleAxisd(0.6 * share, axis).toRotationMatrix() * start.R;
    ASSERT_LT((X_RT.R - turned).norm(), 1e-10);
  }
  const Pose reached = flange(arm, here.position) * kX_FT;
  EXPECT_LT((reached.p - end.p).norm(), 2e-12);
  EXPECT_LT((reached.R - end.R).norm(), 4e-12);
  EXPECT_EQ(here.velocity, JointArray{});
}

TEST(LineMotion, TheVelocityIsTheDerivativeOfThePosition) {
  const ArmModel& arm = ur10e();
  Pose end = flange(arm, kHome1) * kX_FT;
  end.p += Vec3(0.2, 0.1, -0.2);
  end.R = Eigen::AngleAxisd(0.4, Vec3::UnitX()).toRotationMatrix() * end.R;
  // A short period: central differences are then good to the square of it.
  constexpr double kShort_s = 1e-3;
  const LineMotion motion(arm, kX_FT, kHome1, end, {}, kShort_s);
  std::vector<ArmSetPoint> run{{kHome1, {}}};
  for (long k = 1; k <= motion.periods(); ++k) {
    run.push_back(run.back());
    motion.evaluate(k, run.back());
  }
  for (size_t k = 1; k + 1 < run.size(); ++k) {
    for (size_t j = 0; j < 6; ++j) {
      const double difference = (run[k + 1].position[j] - run[k - 1].position[j]) / (2.0 * kShort_s);
      ASSERT_NEAR(run[k].velocity[j], difference, 2e-5) << "joint " << j << " period " << k;
    }
  }
}

void expect_refused(const Pose& end, const LineOptions& options, const JointArray& from,
                    const char* expected) {
  try {
    LineMotion(ur10e(), kX_FT, from, end, options, kPeriod_s);
    FAIL() << "not refused";
  } catch (const std::runtime_error& error) {
    EXPECT_THAT(error.what(), HasSubstr(expected));
  }
}

TEST(LineMotion, UnreachableLinesAreRefusedBeforeTheStart) {
  Pose end = flange(ur10e(), kHome1) * kX_FT;
  end.p.x() += 1.5;
  expect_refused(end, {}, kHome1, "cannot be followed");
  end = flange(ur10e(), kHome1) * kX_FT;
  end.p.z() -= 0.3;
  LineOptions fast;
  fast.speed_m_per_s = 30.0;
  fast.acceleration_m_per_s2 = 1000.0;
  expect_refused(end, fast, kHome1, "joint elbow_joint: the straight line needs ");
  expect_refused(end, fast, kHome1, "allowed are 3.14159 rad/s");
  LineOptions hasty;
  hasty.duration_s = 0.1;
  expect_refused(end, hasty, kHome1, "duration_s = 0.1 is too short");
  LineOptions wrong;
  wrong.speed_m_per_s = 0.0;
  expect_refused(end, wrong, kHome1, "speed_m_per_s = 0");
}

}  // namespace
}  // namespace takt::controller

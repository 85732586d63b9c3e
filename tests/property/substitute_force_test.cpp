// Laws every pair wrench must obey, over random motions: force and moment balance, frame invariance, no
// torque at closing, no damping of a common rigid motion, power only taken out by the damper.
#include "server/contact/substitute_force.h"

#include <gtest/gtest.h>

#include <random>

namespace takt {
namespace {

class SubstituteForceProperty : public ::testing::Test {
 protected:
  double uniform(double lower, double upper) {
    return std::uniform_real_distribution<double>(lower, upper)(random_);
  }
  Vec3 vector(double size) { return {uniform(-size, size), uniform(-size, size), uniform(-size, size)}; }
  Pose random_pose() {
    const Vec3 axis = vector(1.0).normalized();
    return {Eigen::AngleAxisd(uniform(-3.0, 3.0), axis).toRotationMatrix(), vector(2.0)};
  }
  BodyMotion body(const Pose& X_WB, const Vec3& p_BBcm) {
    BodyMotion m;
    m.X_WB = X_WB;
    m.V_WB = {vector(1.0), vector(2.0)};
    m.p_WBcm = X_WB * p_BBcm;
    return m;
  }
  SubstituteParameters gains() {
    const Mat3 I = Vec3(uniform(1e-3, 1e-2), uniform(1e-3, 1e-2), uniform(1e-3, 1e-2)).asDiagonal();
    return substitute_parameters(uniform(0.1, 5.0), I, 9.80665, 1e-4, 1.0);
  }
  /// Small displacement of a body, as it occurs under load.
  BodyMotion displaced(const BodyMotion& m, const Vec3& p_BBcm) {
    const Vec3 turn = vector(1e-3);
    BodyMotion d = m;
    d.X_WB.R = Eigen::AngleAxisd(turn.norm(), turn.normalized()).toRotationMatrix() * m.X_WB.R;
    d.X_WB.p += vector(1e-4);
    d.p_WBcm = d.X_WB * p_BBcm;
    return d;
  }
  std::mt19937 random_{7};
};

TEST_F(SubstituteForceProperty, ForceAndMomentBalance) {
  for (int trial = 0; trial < 2000; ++trial) {
    const Vec3 cm_base = vector(0.1), cm_target = vector(0.1);
    const BodyMotion base = body(random_pose(), cm_base), target = body(random_pose(), cm_target);
    Connection connection;
    connection.gains = gains();
    connection.feed_forward_W = vector(10.0);
    capture_offset(base, target, connection);
    const BodyMotion moved = displaced(base, cm_base);
    const Wrench on_base = substitute_wrench(connection, moved, target);
    const Wrench on_target = reaction_on_target(on_base, moved, target);
    const Vec3 force_sum = on_base.f + on_target.f;
    const Vec3 moment_about_origin =
        on_base.t + moved.p_WBcm.cross(on_base.f) + on_target.t + target.p_WBcm.cross(on_target.f);
    const double scale = on_base.f.norm() * 4.0 + on_base.t.norm();
    ASSERT_LE(force_sum.norm(), 1e-12 * scale);
    ASSERT_LE(moment_about_origin.norm(), 1e-12 * scale);
  }
}

TEST_F(SubstituteForceProperty, ZeroAtClosingExceptFeedForward) {
  for (int trial = 0; trial < 2000; ++trial) {
    const Vec3 cm = vector(0.1);
    BodyMotion base = body(random_pose(), cm), target = body(random_pose(), vector(0.1));
    base.V_WB = target.V_WB = {};
    Connection connection;
    connection.gains = gains();
    capture_offset(base, target, connection);
    const Wrench F = substitute_wrench(connection, base, target);
    // Rounding of positions of metres, seen through the stiffness.
    ASSERT_LE(F.f.norm(), 1e-14 * connection.gains.k_tr_N_per_m);
    ASSERT_LE(F.t.norm(),
              1e-14 * connection.gains.K_rot_B.norm());  // as printed, (3.8) would give a torque here
  }
}

TEST_F(SubstituteForceProperty, ACommonRigidMotionIsNotDamped) {
  for (int trial = 0; trial < 2000; ++trial) {
    BodyMotion base = body(random_pose(), vector(0.1)), target = body(random_pose(), vector(0.1));
    base.V_WB.w = target.V_WB.w;
    base.V_WB.v = target.V_WB.at(base.X_WB.p - target.X_WB.p);
    Connection connection;
    connection.gains = gains();
    capture_offset(base, target, connection);
    const Wrench F = substitute_wrench(connection, base, target);
    ASSERT_LE(F.f.norm(), 1e-9 * connection.gains.d_tr_N_s_per_m);
    ASSERT_LE(F.t.norm(), 1e-8);
  }
}

TEST_F(SubstituteForceProperty, TurningTheWholeSceneTurnsTheWrench) {
  for (int trial = 0; trial < 2000; ++trial) {
    const Vec3 cm_base = vector(0.1), cm_target = vector(0.1);
    const BodyMotion base = body(random_pose(), cm_base), target = body(random_pose(), cm_target);
    Connection connection;
    connection.gains = gains();
    capture_offset(base, target, connection);
    const BodyMotion moved = displaced(base, cm_base);
    const Pose X_VW = random_pose();  // the scene seen from another frame V
    const auto turned = [&](const BodyMotion& m) {
      BodyMotion t;
      t.X_WB = X_VW * m.X_WB;
      t.V_WB = {X_VW.R * m.V_WB.v, X_VW.R * m.V_WB.w};
      t.p_WBcm = X_VW * m.p_WBcm;
      return t;
    };
    const Wrench F = substitute_wrench(connection, moved, target);
    const Wrench F_V = substitute_wrench(connection, turned(moved), turned(target));
    ASSERT_LE((X_VW.R * F.f - F_V.f).norm(), 1e-9 * (1.0 + F.f.norm()));
    ASSERT_LE((X_VW.R * F.t - F_V.t).norm(), 1e-9 * (1.0 + F.t.norm()));
  }
}

TEST_F(SubstituteForceProperty, TheSpringPullsBackInEveryAxis) {
  for (int trial = 0; trial < 2000; ++trial) {
    const Vec3 cm = vector(0.1);
    BodyMotion base = body(random_pose(), cm), target = body(random_pose(), vector(0.1));
    base.V_WB = target.V_WB = {};
    Connection connection;
    connection.gains = gains();
    capture_offset(base, target, connection);
    BodyMotion moved = base;
    const Vec3 turn = vector(0.05);
    moved.X_WB.R = Eigen::AngleAxisd(turn.norm(), turn.normalized()).toRotationMatrix() * base.X_WB.R;
    moved.X_WB.p = base.p_WBcm - moved.X_WB.R * cm;  // turned about its centre of mass
    moved.p_WBcm = base.p_WBcm;
    const Wrench F = substitute_wrench(connection, moved, target);
    ASSERT_LT(F.t.dot(turn), 0.0);  // as printed, the third entry of (3.10) would push away
    // Linear in the angle for small angles, with the inertia's own axes.
    const Mat3 K_W = moved.X_WB.R * connection.gains.K_rot_B * moved.X_WB.R.transpose();
    ASSERT_LE((F.t + K_W * turn).norm(), 2e-3 * (K_W * turn).norm());
  }
}

}  // namespace
}  // namespace takt

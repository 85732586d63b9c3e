// Laws every pair wrench must obey, over random motions: force and moment balance, frame invariance, no
// torque at closing, no damping of a common rigid motion, power only taken out by the damper.
#include "server/contact/holding/substitute_force.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

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

TEST_F(SubstituteForceProperty, ForcesAndMomentsBalance) {
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

TEST_F(SubstituteForceProperty, TheForceAtClosingIsTheFeedForward) {
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

TEST_F(SubstituteForceProperty, ARotatedSceneHasTheRotatedWrench) {
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

TEST_F(SubstituteForceProperty, NoModeOfAFreeAssemblyIsFasterThanThatOfOnePart) {
  // The whole system's stiffness, column by column from the wrenches themselves, against its inertia.
  double softest = 1.0;
  for (int trial = 0; trial < 200; ++trial) {
    const auto component = [&] {
      Component c;
      c.mass_kg = std::exp(uniform(-3.0, 2.0));
      c.p_BBcm = vector(0.05);
      const Mat3 R = random_pose().R;
      const Vec3 half(uniform(0.01, 0.05), uniform(0.01, 0.05), uniform(0.01, 0.05));
      const Vec3 moments = Vec3::Constant(half.squaredNorm()) - half.cwiseAbs2();
      c.I_BBcm_B = R * (c.mass_kg / 3.0 * moments).asDiagonal() * R.transpose();
      c.substitute = substitute_parameters(c.mass_kg, c.I_BBcm_B, 9.80665, uniform(0.5e-4, 2e-4), 1.0);
      return c;
    };
    const std::size_t count = 1 + random_() % 12;
    std::vector<Component> components;
    std::vector<BodyMotion> rest;  // the last one is the Target
    for (std::size_t i = 0; i <= count; ++i) {
      components.push_back(component());
      rest.push_back(body({random_pose().R, vector(0.1)}, components.back().p_BBcm));
      rest.back().V_WB = {};
    }
    FreeTargetLoad load(components.back());
    std::vector<Connection> connections(count);
    double fastest = 0.0;
    for (std::size_t i = 0; i < count; ++i) {
      capture_offset(rest[i], rest.back(), connections[i]);
      load.add(components[i], connections[i]);
      fastest = std::max(fastest, components[i].substitute.k_tr_N_per_m / components[i].mass_kg);
    }
    const double scale = load.scale();
    ASSERT_GT(scale, 0.0);
    ASSERT_LT(scale, 1.0);
    softest = std::min(softest, scale);
    for (std::size_t i = 0; i < count; ++i) connections[i].gains = scaled(components[i].substitute, scale);

    const auto n = static_cast<Eigen::Index>(6 * (count + 1));
    Eigen::MatrixXd K(n, n), M = Eigen::MatrixXd::Zero(n, n);
    for (std::size_t b = 0; b <= count; ++b) {
      const auto at = static_cast<Eigen::Index>(6 * b);
      M.diagonal().segment<3>(at).setConstant(components[b].mass_kg);
      M.block<3, 3>(at + 3, at + 3) = rest[b].X_WB.R * components[b].I_BBcm_B * rest[b].X_WB.R.transpose();
      for (int axis = 0; axis < 6; ++axis) {
        constexpr double kSmall = 1e-6;
        std::vector<BodyMotion> moved = rest;
        if (axis < 3) {
          moved[b].X_WB.p[axis] += kSmall;
          moved[b].p_WBcm[axis] += kSmall;
        } else {  // about its centre of mass
          const Mat3 turn = Eigen::AngleAxisd(kSmall, Vec3::Unit(axis - 3)).toRotationMatrix();
          moved[b].X_WB = {turn * rest[b].X_WB.R,
                           moved[b].p_WBcm - turn * (moved[b].p_WBcm - rest[b].X_WB.p)};
        }
        Eigen::VectorXd force = Eigen::VectorXd::Zero(n);
        for (std::size_t i = 0; i < count; ++i) {
          const Wrench F = substitute_wrench(connections[i], moved[i], moved.back());
          const Wrench G = reaction_on_target(F, moved[i], moved.back());
          const auto row = static_cast<Eigen::Index>(6 * i);
          force.segment<3>(row) += F.f, force.segment<3>(row + 3) += F.t;
          force.segment<3>(n - 6) += G.f, force.segment<3>(n - 3) += G.t;
        }
        K.col(at + axis) = -force / kSmall;
      }
    }
    ASSERT_LE((K - K.transpose()).norm(), 1e-3 * K.norm());
    const Eigen::GeneralizedSelfAdjointEigenSolver<Eigen::MatrixXd> modes(0.5 * (K + K.transpose()), M);
    EXPECT_LE(modes.eigenvalues().maxCoeff(), fastest * 1.001);
    EXPECT_GE(modes.eigenvalues().maxCoeff(), 0.45 * fastest) << "softer than it need be";
  }
  EXPECT_LT(softest, 0.05);
}

}  // namespace
}  // namespace takt

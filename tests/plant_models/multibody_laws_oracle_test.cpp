// Laws of the dynamics of trees for any parameters: momentum, energy, couplings.
#include <gtest/gtest.h>

#include <Eigen/Cholesky>

#include "plant_models/mechanics/joint_coupling.h"
#include "plant_models/mechanics/sine_cosine.h"
#include "tests/support/random_trees.h"
#include "tests/support/robot_tables.h"

namespace takt {
namespace {

using test::TreeMaker;
using Vector6 = Eigen::Matrix<double, 6, 1>;

/// Momentum and moment of momentum about the origin of R of link `from` and all links beyond it.
Vector6 momentum(const MultibodyTree& tree, int from, const MultibodyTree::Workspace& w) {
  std::array<bool, kMaxJoints> beyond{};
  Vector6 sum = Vector6::Zero();
  for (int i = from; i < tree.joint_count(); ++i) {
    const TreeJoint& joint = tree.model().joints[static_cast<size_t>(i)];
    beyond[static_cast<size_t>(i)] =
        i == from || (joint.parent >= from && beyond[static_cast<size_t>(joint.parent)]);
    if (!beyond[static_cast<size_t>(i)]) continue;
    const Pose X = tree.link_pose(i, w);
    const Twist V = tree.link_twist(i, w);
    const Vec3 r = X.R * joint.inertia.p_BBcm_B;
    const Vec3 linear = joint.inertia.mass_kg * V.at(r);
    sum.head<3>() += linear;
    sum.tail<3>() += (X.p + r).cross(linear) + X.R * joint.inertia.I_BBcm_B * X.R.transpose() * V.w;
  }
  return sum;
}

/// Gravity and applied wrenches on the same links, about the origin of R.
Vector6 load(const MultibodyTree& tree, int from, const std::vector<Wrench>& wrenches,
             const MultibodyTree::Workspace& w) {
  std::array<bool, kMaxJoints> beyond{};
  Vector6 sum = Vector6::Zero();
  for (int i = from; i < tree.joint_count(); ++i) {
    const TreeJoint& joint = tree.model().joints[static_cast<size_t>(i)];
    beyond[static_cast<size_t>(i)] =
        i == from || (joint.parent >= from && beyond[static_cast<size_t>(joint.parent)]);
    if (!beyond[static_cast<size_t>(i)]) continue;
    const Pose X = tree.link_pose(i, w);
    const Vec3 weight = joint.inertia.mass_kg * tree.model().gravity_R;
    const Wrench& F = wrenches[static_cast<size_t>(i)];
    sum.head<3>() += weight + F.f;
    sum.tail<3>() += (X * joint.inertia.p_BBcm_B).cross(weight) + X.p.cross(F.f) + F.t;
  }
  return sum;
}

TEST(MultibodyLaws, ReactionsAreTheRateOfMomentum) {
  TreeMaker make(11);
  for (int k = 0; k < 200; ++k) {
    const MultibodyTree tree(make.tree(make.integer(1, 10)));
    const int n = tree.joint_count();
    const JointArray q = make.joints(3.0), qd = make.joints(1.0), qdd = make.joints(1.0);
    std::vector<Wrench> wrenches;
    MultibodyTree::Workspace w, moved;
    const auto momentum_at = [&](int from, double t) {
      JointArray q_t{}, qd_t{};
      for (size_t i = 0; i < static_cast<size_t>(n); ++i) {
        q_t[i] = q[i] + t * (qd[i] + 0.5 * t * qdd[i]);
        qd_t[i] = qd[i] + t * qdd[i];
      }
      tree.update(q_t.data(), qd_t.data(), moved);
      return momentum(tree, from, moved);
    };
    tree.update(q.data(), qd.data(), w);
    for (int i = 0; i < n; ++i) {
      wrenches.push_back(make.wrench());
      tree.add_wrench(i, wrenches.back(), w);
    }
    JointArray tau{};
    tree.inverse_dynamics(qdd.data(), tau.data(), w);
    Vector6 from_foundation = Vector6::Zero();
    for (int i = 0; i < n; ++i) {
      constexpr double h = 1e-3;  // fourth order: error of h^4
      const Vector6 rate = (8.0 * (momentum_at(i, h) - momentum_at(i, -h)) - momentum_at(i, 2.0 * h) +
                            momentum_at(i, -2.0 * h)) /
                           (12.0 * h);
      const Wrench F = tree.joint_wrench(i, w);
      Vector6 joint;
      joint << F.f, F.t + tree.link_pose(i, w).p.cross(F.f);
      const Vector6 expected = rate - load(tree, i, wrenches, w);
      ASSERT_LT((joint - expected).norm(), 1e-7 * (1.0 + expected.norm())) << "joint " << i;
      if (tree.model().joints[static_cast<size_t>(i)].parent < 0) from_foundation += expected;
    }
    const Wrench reaction = tree.base_reaction(w);
    ASSERT_LT((reaction.f + from_foundation.head<3>()).norm(), 1e-7 * (1.0 + from_foundation.norm()));
    ASSERT_LT((reaction.t + from_foundation.tail<3>()).norm(), 1e-7 * (1.0 + from_foundation.norm()));
  }
}

TEST(MultibodyLaws, TwistsAndAccelerationsAreDerivativesOfPoses) {
  TreeMaker make(12);
  for (int k = 0; k < 200; ++k) {
    const MultibodyTree tree(make.tree(make.integer(1, 10)));
    const int n = tree.joint_count(), last = n - 1;
    const JointArray q = make.joints(3.0), qd = make.joints(1.0), qdd = make.joints(1.0);
    MultibodyTree::Workspace w, moved;
    constexpr double h = 1e-4;
    const auto at = [&](double t) {
      JointArray q_t{}, qd_t{};
      for (size_t i = 0; i < static_cast<size_t>(n); ++i) {
        q_t[i] = q[i] + t * (qd[i] + 0.5 * t * qdd[i]);
        qd_t[i] = qd[i] + t * qdd[i];
      }
      tree.update(q_t.data(), qd_t.data(), moved);
      return std::pair{tree.link_pose(last, moved), tree.link_twist(last, moved)};
    };
    const auto [X_1, V_1] = at(h);
    const auto [X_0, V_0] = at(-h);
    tree.update(q.data(), qd.data(), w);
    JointArray tau{};
    tree.inverse_dynamics(qdd.data(), tau.data(), w);
    const Twist V = tree.link_twist(last, w), A = tree.link_acceleration(last, w);
    const Mat3 spin = (X_1.R - X_0.R) / (2.0 * h) * tree.link_pose(last, w).R.transpose();
    const double size = 1.0 + V.v.norm() + V.w.norm() + A.v.norm() + A.w.norm();
    ASSERT_LT((V.v - (X_1.p - X_0.p) / (2.0 * h)).norm(), 1e-5 * size);
    ASSERT_LT((V.w - Vec3(spin(2, 1), spin(0, 2), spin(1, 0))).norm(), 1e-5 * size);
    ASSERT_LT((A.v - (V_1.v - V_0.v) / (2.0 * h)).norm(), 1e-5 * size);
    ASSERT_LT((A.w - (V_1.w - V_0.w) / (2.0 * h)).norm(), 1e-5 * size);
  }
}

/// Largest change of energy of an arm that falls freely from rest, classical Runge-Kutta.
double energy_drift(const MultibodyTree& tree, JointArray q, double h, double end) {
  const auto n = static_cast<size_t>(tree.joint_count());
  MultibodyTree::Workspace w;
  const JointArray no_force{};
  JointArray qd{}, lock{};
  const auto energy = [&] {
    tree.update(q.data(), qd.data(), w);
    return tree.kinetic_energy(w) + tree.potential_energy(w);
  };
  const auto accelerate = [&](const JointArray& q_, const JointArray& qd_, JointArray& qdd_) {
    tree.update(q_.data(), qd_.data(), w);
    tree.forward_dynamics(no_force.data(), {}, qdd_.data(), lock.data(), w);
  };
  const double start = energy();
  double drift = 0.0;
  const long steps = std::lround(end / h);
  for (long step = 0; step < steps; ++step) {
    JointArray a1{}, a2{}, a3{}, a4{}, v2{}, v3{}, v4{}, x{};
    accelerate(q, qd, a1);
    for (size_t i = 0; i < n; ++i) x[i] = q[i] + 0.5 * h * qd[i], v2[i] = qd[i] + 0.5 * h * a1[i];
    accelerate(x, v2, a2);
    for (size_t i = 0; i < n; ++i) x[i] = q[i] + 0.5 * h * v2[i], v3[i] = qd[i] + 0.5 * h * a2[i];
    accelerate(x, v3, a3);
    for (size_t i = 0; i < n; ++i) x[i] = q[i] + h * v3[i], v4[i] = qd[i] + h * a3[i];
    accelerate(x, v4, a4);
    for (size_t i = 0; i < n; ++i) {
      q[i] += h / 6.0 * (qd[i] + 2.0 * v2[i] + 2.0 * v3[i] + v4[i]);
      qd[i] += h / 6.0 * (a1[i] + 2.0 * a2[i] + 2.0 * a3[i] + a4[i]);
    }
    drift = std::max(drift, std::abs(energy() - start));
  }
  return drift;
}

TEST(MultibodyLaws, AFreeSwingingArmKeepsItsEnergy) {
  for (double armature : {0.0, 0.3}) {
    TreeModel model = test::tree_of(test::ur10e_table());
    BodyInertia& last = model.joints.back().inertia;
    last = combined(last, {5.0, {0.02, 0.03, 0.1}, 0.02 * Mat3::Identity()}, Pose{});
    for (TreeJoint& joint : model.joints) joint.armature = armature;
    const MultibodyTree tree(model);
    const JointArray q{0.3, -0.4, 0.9, -0.2, 0.7, 0.1};
    const double coarse = energy_drift(tree, q, 2e-3, 1.0), fine = energy_drift(tree, q, 1e-3, 1.0);
    EXPECT_LT(fine * 10.0, coarse);  // the drift is the integrator's alone: fourth order or better
    EXPECT_LT(energy_drift(tree, q, 1e-4, 1.0), 1e-8);
  }
}

TEST(MultibodyLaws, CoupledJointsMoveAsTheConstraintForcesWouldMakeThem) {
  TreeMaker make(13);
  double worst = 0.0;
  for (int k = 0; k < 500; ++k) {
    const int n = make.integer(3, 10);
    TreeModel model = make.tree(n);
    for (TreeJoint& joint : model.joints) joint.armature = make.number(0.0, 0.5);
    const MultibodyTree tree(model);
    // The last follows the one before, which follows the first; one link of the chain stays still.
    std::vector<MimicJoint> mimics{{n - 1, n - 2, make.number(-2.0, 2.0), make.number(-1.0, 1.0)},
                                   {n - 2, 0, make.number(-2.0, 2.0), make.number(-1.0, 1.0)}};
    const JointCoupling coupling(n, mimics);
    ASSERT_EQ(coupling.independent_count(), n - 2);
    const JointArray y = make.joints(2.0), yd = make.joints(1.0), tau = make.joints(50.0);
    JointArray q{}, qd{}, tau_y{}, ydd{}, lock{}, qdd{};
    coupling.positions(y.data(), q.data());
    coupling.rates(yd.data(), qd.data());
    coupling.forces(tau.data(), tau_y.data());
    for (const MimicJoint& mimic : mimics) {
      const auto joint = static_cast<size_t>(mimic.joint), source = static_cast<size_t>(mimic.source);
      ASSERT_NEAR(q[joint], mimic.multiplier * q[source] + mimic.offset, 1e-13);
      ASSERT_NEAR(qd[joint], mimic.multiplier * qd[source], 1e-13);
    }
    MultibodyTree::Workspace w;
    tree.update(q.data(), qd.data(), w);
    tree.add_wrench(n - 1, make.wrench(), w);
    MultibodyTree::Mask locked{};
    const int held = n > 4 ? n - 3 : -1;  // an independent joint
    if (held >= 0) locked[static_cast<size_t>(held)] = true;
    coupling.forward_dynamics(tree, tau_y.data(), locked, ydd.data(), lock.data(), w);
    coupling.rates(ydd.data(), qdd.data());
    const Wrench reaction = tree.base_reaction(w);

    // Two constraint forces along the rows of the coupling, and one brake.
    const int constraints = held >= 0 ? 3 : 2, size = n + constraints;
    JointArray bias{};
    tree.inverse_dynamics(JointArray{}.data(), bias.data(), w);
    MultibodyTree::MassMatrix M;
    tree.mass_matrix(M, w);
    Eigen::MatrixXd A = Eigen::MatrixXd::Zero(size, size);
    A.topLeftCorner(n, n) = M;
    for (int c = 0; c < 2; ++c) {
      const MimicJoint& mimic = mimics[static_cast<size_t>(c)];
      A(n + c, mimic.joint) = A(mimic.joint, n + c) = 1.0;
      A(n + c, mimic.source) = A(mimic.source, n + c) = -mimic.multiplier;
    }
    if (held >= 0) A(n + 2, held) = A(held, n + 2) = 1.0;
    Eigen::VectorXd right = Eigen::VectorXd::Zero(size);
    for (int i = 0; i < n; ++i) right(i) = tau[static_cast<size_t>(i)] - bias[static_cast<size_t>(i)];
    const Eigen::VectorXd expected = A.fullPivLu().solve(right);
    for (int i = 0; i < n; ++i)
      worst = std::max(worst, std::abs(qdd[static_cast<size_t>(i)] - expected(i)) /
                                  expected.head(n).lpNorm<Eigen::Infinity>());
    if (held >= 0) {
      ASSERT_NEAR(lock[static_cast<size_t>(held)], -expected(n + 2), 1e-7);
    }

    JointArray back{}, tau_q{};
    tree.inverse_dynamics(qdd.data(), tau_q.data(), w);
    coupling.forces(tau_q.data(), back.data());
    for (size_t i = 0; i < static_cast<size_t>(n - 2); ++i) ASSERT_NEAR(back[i], tau_y[i] + lock[i], 1e-8);
    ASSERT_LT((tree.base_reaction(w).f - reaction.f).norm(), 1e-8 * (1.0 + reaction.f.norm()));
  }
  EXPECT_LT(worst, 1e-9);
}

TEST(MultibodyLaws, AFixedLoadIsPartOfItsLink) {
  TreeMaker make(14);
  for (int k = 0; k < 100; ++k) {
    TreeModel model = make.tree(6);
    TreeModel carrying = model;
    const BodyInertia load = make.body();
    const Pose X_LB = make.pose(0.3);
    carrying.joints[5].inertia = combined(model.joints[5].inertia, load, X_LB);
    // The same load behind a joint that stands still.
    TreeJoint joint;
    joint.joint.name = "load";
    joint.joint.X_PJ = X_LB;
    joint.parent = 5;
    joint.inertia = load;
    model.joints.push_back(joint);
    const MultibodyTree a(carrying), b(model);
    JointArray q = make.joints(3.0), qd = make.joints(1.0), qdd = make.joints(5.0), tau_a{}, tau_b{};
    q[6] = qd[6] = qdd[6] = 0.0;
    MultibodyTree::Workspace w;
    a.update(q.data(), qd.data(), w);
    a.inverse_dynamics(qdd.data(), tau_a.data(), w);
    const double energy = a.kinetic_energy(w), potential = a.potential_energy(w);
    b.update(q.data(), qd.data(), w);
    b.inverse_dynamics(qdd.data(), tau_b.data(), w);
    for (size_t i = 0; i < 6; ++i) ASSERT_NEAR(tau_a[i], tau_b[i], 1e-10 * (1.0 + std::abs(tau_b[i])));
    ASSERT_NEAR(energy, b.kinetic_energy(w), 1e-11 * (1.0 + energy));
    ASSERT_NEAR(potential, b.potential_energy(w), 1e-11 * (1.0 + std::abs(potential)));
  }
}

TEST(MultibodyLaws, SineAndCosineEqualThoseOfTheLibrary) {
  TreeMaker make(15);
  double worst = 0.0;
  for (int k = 0; k < 200000; ++k) {
    const double size = k % 3 == 0 ? 1.0 : k % 3 == 1 ? 10.0 : 2e5;
    const std::array<double, 3> x{make.number(-size, size), make.number(-size, size),
                                  0.25 * M_PI * make.integer(-40, 40)};
    std::array<double, 4> s{}, c{};
    mechanics::sine_cosine(x.data(), 3, s.data(), c.data());
    for (size_t i = 0; i < 3; ++i)
      worst = std::max({worst, std::abs(s[i] - std::sin(x[i])), std::abs(c[i] - std::cos(x[i]))});
  }
  EXPECT_LT(worst, 2.3e-16);
  const std::array<double, 2> bad{std::nan(""), std::numeric_limits<double>::infinity()};
  std::array<double, 2> s{}, c{};
  mechanics::sine_cosine(bad.data(), 2, s.data(), c.data());
  for (size_t i = 0; i < 2; ++i) EXPECT_TRUE(std::isnan(s[i]) && std::isnan(c[i]));
}

}  // namespace
}  // namespace takt

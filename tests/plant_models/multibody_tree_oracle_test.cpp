// Rigid-body dynamics of trees against Orocos KDL, whose models are built here from the same figures.
#include "plant_models/mechanics/multibody_tree.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>

#include "tests/support/kdl_tree.h"
#include "tests/support/random_trees.h"
#include "tests/support/robot_tables.h"

namespace takt {
namespace {

using test::TreeMaker;
using Vector = Eigen::VectorXd;

Vector vector_of(const JointArray& values, int n) {
  return Eigen::Map<const Vector>(values.data(), n);
}

double relative_error(const Vector& found, const Vector& expected) {
  return (found - expected).lpNorm<Eigen::Infinity>() / std::max(1e-3, expected.lpNorm<Eigen::Infinity>());
}

struct Motion {
  JointArray q, qd, qdd;
  std::vector<Wrench> wrenches;  // per link, about its origin, axes of R
};

Motion random_motion(TreeMaker& make, int n) {
  Motion motion{make.joints(3.0), make.joints(2.0), make.joints(10.0), {}};
  for (int i = 0; i < n; ++i) motion.wrenches.push_back(make.wrench());
  return motion;
}

void apply(const MultibodyTree& tree, const Motion& motion, MultibodyTree::Workspace& w) {
  tree.update(motion.q.data(), motion.qd.data(), w);
  tree.clear_wrenches(w);
  for (int i = 0; i < tree.joint_count(); ++i) tree.add_wrench(i, motion.wrenches[static_cast<size_t>(i)], w);
}

/// KDL takes wrenches in the axes of the link.
KDL::Wrench in_link(const MultibodyTree& tree, int i, const Motion& motion,
                    const MultibodyTree::Workspace& w) {
  const Mat3 R = tree.link_pose(i, w).R.transpose();
  const Wrench& F = motion.wrenches[static_cast<size_t>(i)];
  return test::kdl(Wrench{R * F.f, R * F.t});
}

struct Robot {
  const char* name;
  TreeModel model;
};

std::vector<Robot> robots() {
  std::vector<Robot> all{{"ur10e", test::tree_of(test::ur10e_table())},
                         {"kr16", test::tree_of(test::kr16_table())},
                         {"r3", test::r3_tree()}};
  const BodyInertia gripper{1.0, {0.0, 0.01, 0.05}, 2e-3 * Mat3::Identity()};
  BodyInertia& last = all[0].model.joints.back().inertia;
  last = combined(last, gripper, {rotation_from_rpy({0.1, 0.2, 0.3}), {0.0, 0.0, 0.02}});
  return all;
}

TEST(MultibodyTree, InverseDynamicsOfArmsEqualsThatOfKdl) {
  for (const Robot& robot : robots()) {
    TreeMaker make(1);
    const MultibodyTree tree(robot.model);
    const int n = tree.joint_count();
    MultibodyTree::Workspace w;
    const KDL::Chain chain = test::kdl_chain(robot.model);  // KDL refers to it
    KDL::ChainIdSolver_RNE solver(chain, test::kdl(robot.model.gravity_R));
    double worst = 0.0;
    for (int k = 0; k < 10000; ++k) {
      const Motion motion = random_motion(make, n);
      apply(tree, motion, w);
      JointArray tau{};
      tree.inverse_dynamics(motion.qdd.data(), tau.data(), w);
      KDL::Wrenches wrenches;
      for (int i = 0; i < n; ++i) wrenches.push_back(in_link(tree, i, motion, w));
      KDL::JntArray expected(static_cast<unsigned>(n));
      ASSERT_GE(solver.CartToJnt(test::kdl_joints(motion.q, n), test::kdl_joints(motion.qd, n),
                                 test::kdl_joints(motion.qdd, n), wrenches, expected),
                0);
      worst = std::max(worst, relative_error(vector_of(tau, n), expected.data));
    }
    EXPECT_LT(worst, 1e-12) << robot.name;
  }
}

/// The base as a link of KDL's chain that a sliding and a turning joint move; ours gets its motion.
TEST(MultibodyTree, AnArmOnAMovingBaseNeedsTheTorquesOfKdl) {
  for (const Robot& robot : robots()) {
    TreeMaker make(5);
    const Pose X_1R{rotation_from_rpy({0.3, -0.2, 0.5}), {0.4, 0.1, -0.2}};
    TreeModel whole;
    whole.gravity_R = {0.5, -1.0, -9.5};
    TreeJoint slide, turn;
    slide.joint = {"slide", JointType::prismatic, {}, Vec3(1.0, 2.0, -1.0).normalized()};
    turn.joint = {"turn",
                  JointType::revolute,
                  {rotation_from_rpy({0.1, 0.7, 0.2}), {0.1, 0.2, 0.3}},
                  Vec3(0.2, -0.5, 1.0).normalized()};
    slide.inertia = turn.inertia = {1.0, {0.1, 0.0, 0.1}, 0.1 * Mat3::Identity()};
    turn.parent = 0;
    whole.joints = {slide, turn};
    for (TreeJoint joint : robot.model.joints) {
      if (joint.parent < 0) joint.joint.X_PJ = X_1R * joint.joint.X_PJ;
      joint.parent += 2;
      if (joint.parent < 2) joint.parent = 1;
      whole.joints.push_back(joint);
    }
    const MultibodyTree mounts(whole), tree(robot.model);
    const int n = tree.joint_count(), all = n + 2;
    MultibodyTree::Workspace w_mounts, w;
    const KDL::Chain chain = test::kdl_chain(whole);
    KDL::ChainIdSolver_RNE solver(chain, test::kdl(whole.gravity_R));
    double worst = 0.0, worst_forward = 0.0, worst_twist = 0.0;
    for (int k = 0; k < 10000; ++k) {
      const JointArray q = make.joints(3.0), qd = make.joints(2.0), qdd = make.joints(10.0);
      JointArray unused{};
      mounts.update(q.data(), qd.data(), w_mounts);
      mounts.clear_wrenches(w_mounts);
      mounts.inverse_dynamics(qdd.data(), unused.data(), w_mounts);
      const Pose X_01 = mounts.link_pose(1, w_mounts), X_0R = X_01 * X_1R;
      const Twist V = mounts.link_twist(1, w_mounts), A = mounts.link_acceleration(1, w_mounts);
      const Vec3 r = X_0R.p - X_01.p;
      const Mat3 R = X_0R.R.transpose();
      tree.set_base({R * V.at(r), R * V.w}, {R * (A.at(r) + V.w.cross(V.w.cross(r))), R * A.w},
                    R * whole.gravity_R, w);
      tree.update(q.data() + 2, qd.data() + 2, w);
      tree.clear_wrenches(w);
      JointArray tau{}, found{}, lock{};
      tree.inverse_dynamics(qdd.data() + 2, tau.data(), w);
      KDL::JntArray expected(static_cast<unsigned>(all));
      ASSERT_GE(
          solver.CartToJnt(test::kdl_joints(q, all), test::kdl_joints(qd, all), test::kdl_joints(qdd, all),
                           KDL::Wrenches(static_cast<std::size_t>(all)), expected),
          0);
      worst = std::max(worst, relative_error(vector_of(tau, n), expected.data.tail(n)));
      const Twist there = mounts.link_twist(all - 1, w_mounts), here = tree.link_twist(n - 1, w);
      worst_twist =
          std::max(worst_twist, (there.v - X_0R.R * here.v).norm() + (there.w - X_0R.R * here.w).norm());
      tree.forward_dynamics(tau.data(), {}, found.data(), lock.data(), w);
      JointArray wanted{};
      std::copy_n(qdd.begin() + 2, n, wanted.begin());
      worst_forward = std::max(worst_forward, relative_error(vector_of(found, n), vector_of(wanted, n)));
    }
    EXPECT_LT(worst, 1e-11) << robot.name;
    EXPECT_LT(worst_forward, 1e-8) << robot.name;
    EXPECT_LT(worst_twist, 1e-11) << robot.name;
  }
}

TEST(MultibodyTree, MassMatrixAndForwardDynamicsOfArmsEqualThoseOfKdl) {
  for (const Robot& robot : robots()) {
    TreeMaker make(2);
    const MultibodyTree tree(robot.model);
    const int n = tree.joint_count();
    MultibodyTree::Workspace w;
    const KDL::Chain chain = test::kdl_chain(robot.model);
    KDL::ChainDynParam parameters(chain, test::kdl(robot.model.gravity_R));
    KDL::JntSpaceInertiaMatrix M_kdl(n);
    KDL::JntArray gravity(static_cast<unsigned>(n)), coriolis(static_cast<unsigned>(n));
    MultibodyTree::MassMatrix M;
    double worst_M = 0.0, worst_qdd = 0.0;
    for (int k = 0; k < 10000; ++k) {
      const JointArray q = make.joints(3.0), qd = make.joints(2.0), tau = make.joints(100.0);
      tree.update(q.data(), qd.data(), w);
      tree.mass_matrix(M, w);
      const KDL::JntArray q_kdl = test::kdl_joints(q, n);
      ASSERT_GE(parameters.JntToMass(q_kdl, M_kdl), 0);
      ASSERT_GE(parameters.JntToGravity(q_kdl, gravity), 0);
      ASSERT_GE(parameters.JntToCoriolis(q_kdl, test::kdl_joints(qd, n), coriolis), 0);
      worst_M = std::max(worst_M, (M - M_kdl.data).lpNorm<Eigen::Infinity>() / M.lpNorm<Eigen::Infinity>());
      JointArray qdd{}, tau_lock{};
      tree.forward_dynamics(tau.data(), {}, qdd.data(), tau_lock.data(), w);
      const Vector expected = M_kdl.data.ldlt().solve(vector_of(tau, n) - gravity.data - coriolis.data);
      worst_qdd = std::max(worst_qdd, relative_error(vector_of(qdd, n), expected));
    }
    EXPECT_LT(worst_M, 1e-13) << robot.name;
    EXPECT_LT(worst_qdd, 1e-10) << robot.name;
  }
}

TEST(MultibodyTree, TreesWithBranchesAndSlidersEqualThoseOfKdl) {
  TreeMaker make(3);
  double worst = 0.0;
  for (int k = 0; k < 300; ++k) {
    const TreeModel model = make.tree(make.integer(1, kMaxJoints));
    const MultibodyTree tree(model);
    const int n = tree.joint_count();
    MultibodyTree::Workspace w;
    const KDL::Tree kdl_tree = test::kdl_tree(model);
    KDL::TreeIdSolver_RNE solver(kdl_tree, test::kdl(model.gravity_R));
    const std::vector<unsigned> number = test::kdl_numbers(model, kdl_tree);
    for (int m = 0; m < 20; ++m) {
      const Motion motion = random_motion(make, n);
      apply(tree, motion, w);
      JointArray tau{};
      tree.inverse_dynamics(motion.qdd.data(), tau.data(), w);
      KDL::JntArray q(static_cast<unsigned>(n)), qd = q, qdd = q, tau_kdl = q;
      KDL::WrenchMap wrenches;
      for (int i = 0; i < n; ++i) {
        const auto at = static_cast<size_t>(i);
        q(number[at]) = motion.q[at], qd(number[at]) = motion.qd[at], qdd(number[at]) = motion.qdd[at];
        wrenches[model.joints[at].joint.name] = in_link(tree, i, motion, w);
      }
      ASSERT_GE(solver.CartToJnt(q, qd, qdd, wrenches, tau_kdl), 0);
      Vector expected(n);
      for (int i = 0; i < n; ++i) expected(i) = tau_kdl(number[static_cast<size_t>(i)]);
      worst = std::max(worst, relative_error(vector_of(tau, n), expected));
    }
  }
  EXPECT_LT(worst, 1e-12);
}

TEST(MultibodyTree, BaseReactionEqualsThatOfKdlWithAFloatingBase) {
  TreeMaker make(4);
  for (int k = 0; k < 500; ++k) {
    const TreeModel model = make.tree(make.integer(1, 10));
    const MultibodyTree tree(model);
    const int n = tree.joint_count();
    MultibodyTree::Workspace w;
    const Motion motion = random_motion(make, n);
    apply(tree, motion, w);
    JointArray tau{};
    tree.inverse_dynamics(motion.qdd.data(), tau.data(), w);
    const Wrench reaction = tree.base_reaction(w);

    const KDL::Tree kdl_tree = test::kdl_tree(model, true);
    KDL::TreeIdSolver_RNE solver(kdl_tree, test::kdl(model.gravity_R));
    const std::vector<unsigned> number = test::kdl_numbers(model, kdl_tree);
    KDL::JntArray q(static_cast<unsigned>(n + 6)), qd = q, qdd = q, tau_kdl = q;
    KDL::WrenchMap wrenches;
    for (int i = 0; i < n; ++i) {
      const auto at = static_cast<size_t>(i);
      q(number[at]) = motion.q[at], qd(number[at]) = motion.qd[at], qdd(number[at]) = motion.qdd[at];
      wrenches[model.joints[at].joint.name] = in_link(tree, i, motion, w);
    }
    ASSERT_GE(solver.CartToJnt(q, qd, qdd, wrenches, tau_kdl), 0);
    Vector expected(6), found(6);
    int row = 0;
    for (const auto type : {KDL::Joint::TransX, KDL::Joint::TransY, KDL::Joint::TransZ, KDL::Joint::RotX,
                            KDL::Joint::RotY, KDL::Joint::RotZ}) {
      const auto segment = kdl_tree.getSegment("base" + std::to_string(static_cast<int>(type)));
      expected(row++) = -tau_kdl(GetTreeElementQNr(segment->second));
    }
    found << reaction.f, reaction.t;
    ASSERT_LT(relative_error(found, expected), 1e-11);
  }
}

TEST(MultibodyTree, ForwardDynamicsInvertsInverseDynamics) {
  TreeMaker make(5);
  double worst = 0.0;
  for (int k = 0; k < 2000; ++k) {
    TreeModel model = make.tree(make.integer(1, kMaxJoints));
    for (TreeJoint& joint : model.joints) joint.armature = make.integer(0, 1) * make.number(0.0, 5.0);
    const MultibodyTree tree(model);
    const int n = tree.joint_count();
    MultibodyTree::Workspace w;
    const Motion motion = random_motion(make, n);
    apply(tree, motion, w);
    JointArray tau{}, qdd{}, tau_lock{};
    tree.inverse_dynamics(motion.qdd.data(), tau.data(), w);
    const Wrench reaction = tree.base_reaction(w);
    const Wrench joint_wrench = tree.joint_wrench(n - 1, w);
    const Twist acceleration = tree.link_acceleration(n - 1, w);
    tree.forward_dynamics(tau.data(), {}, qdd.data(), tau_lock.data(), w);
    worst = std::max(worst, relative_error(vector_of(qdd, n), vector_of(motion.qdd, n)));
    for (double lock : tau_lock) ASSERT_EQ(lock, 0.0);
    const double size = 1.0 + reaction.f.norm() + reaction.t.norm();
    ASSERT_LT((tree.base_reaction(w).f - reaction.f).norm(), 1e-9 * size);
    ASSERT_LT((tree.base_reaction(w).t - reaction.t).norm(), 1e-9 * size);
    ASSERT_LT((tree.joint_wrench(n - 1, w).f - joint_wrench.f).norm(), 1e-9 * size);
    ASSERT_LT((tree.joint_wrench(n - 1, w).t - joint_wrench.t).norm(), 1e-9 * size);
    ASSERT_LT((tree.link_acceleration(n - 1, w).v - acceleration.v).norm(), 1e-8);
    ASSERT_LT((tree.link_acceleration(n - 1, w).w - acceleration.w).norm(), 1e-8);
  }
  EXPECT_LT(worst, 1e-10);
}

TEST(MultibodyTree, TheMassMatrixEqualsTheColumnsOfInverseDynamics) {
  TreeMaker make(6);
  for (int k = 0; k < 500; ++k) {
    TreeModel model = make.tree(make.integer(1, kMaxJoints));
    for (TreeJoint& joint : model.joints) joint.armature = make.number(0.0, 5.0);
    const MultibodyTree tree(model);
    const int n = tree.joint_count();
    MultibodyTree::Workspace w;
    const JointArray q = make.joints(3.0), qd = make.joints(2.0), qdd = make.joints(5.0);
    tree.update(q.data(), qd.data(), w);
    MultibodyTree::MassMatrix M;
    tree.mass_matrix(M, w);
    JointArray rest{}, tau{};
    tree.inverse_dynamics(JointArray{}.data(), rest.data(), w);
    tree.inverse_dynamics(qdd.data(), tau.data(), w);
    ASSERT_LT(relative_error(vector_of(tau, n) - vector_of(rest, n), M * vector_of(qdd, n)), 1e-11);
    ASSERT_NEAR(tree.kinetic_energy(w), 0.5 * vector_of(qd, n).dot(M * vector_of(qd, n)),
                1e-11 * (1.0 + tree.kinetic_energy(w)));
  }
}

TEST(MultibodyTree, LockedJointsCarryTheConstraintForce) {
  TreeMaker make(7);
  double worst = 0.0;
  for (int k = 0; k < 2000; ++k) {
    TreeModel model = make.tree(make.integer(1, kMaxJoints));
    for (TreeJoint& joint : model.joints) joint.armature = make.integer(0, 1) * make.number(0.0, 5.0);
    const MultibodyTree tree(model);
    const int n = tree.joint_count();
    MultibodyTree::Workspace w;
    const Motion motion = random_motion(make, n);
    apply(tree, motion, w);
    MultibodyTree::Mask locked{};
    for (int i = 0; i < n; ++i) locked[static_cast<size_t>(i)] = make.integer(0, 1) == 1;
    const JointArray tau = make.joints(100.0);

    // [M S; S^T 0] [qdd; -lock] = [tau - bias; 0], all joints and one row per brake.
    JointArray bias{};
    tree.inverse_dynamics(JointArray{}.data(), bias.data(), w);
    MultibodyTree::MassMatrix M;
    tree.mass_matrix(M, w);
    std::vector<int> brakes;
    for (int i = 0; i < n; ++i)
      if (locked[static_cast<size_t>(i)]) brakes.push_back(i);
    const int size = n + static_cast<int>(brakes.size());
    Eigen::MatrixXd A = Eigen::MatrixXd::Zero(size, size);
    A.topLeftCorner(n, n) = M;
    for (int b = n; b < size; ++b)
      A(b, brakes[static_cast<size_t>(b - n)]) = A(brakes[static_cast<size_t>(b - n)], b) = 1.0;
    Vector right = Vector::Zero(size);
    right.head(n) = vector_of(tau, n) - vector_of(bias, n);
    const Vector solution = A.fullPivLu().solve(right);
    Vector expected_lock = Vector::Zero(n);
    for (int b = n; b < size; ++b) expected_lock(brakes[static_cast<size_t>(b - n)]) = -solution(b);

    JointArray qdd{}, tau_lock{};
    tree.forward_dynamics(tau.data(), locked, qdd.data(), tau_lock.data(), w);
    for (int i : brakes) ASSERT_EQ(qdd[static_cast<size_t>(i)], 0.0);
    worst = std::max(worst, relative_error(vector_of(qdd, n), solution.head(n)));
    worst = std::max(worst, relative_error(vector_of(tau_lock, n), expected_lock));
  }
  EXPECT_LT(worst, 1e-9);
}

}  // namespace
}  // namespace takt

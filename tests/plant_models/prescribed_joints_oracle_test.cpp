// Rigidly held joints: prescribed accelerations in the tree, sticking friction in a robot.
#include <gtest/gtest.h>

#include <random>

#include "tests/support/r3_robot.h"
#include "tests/support/random_trees.h"
#include "tests/support/robot_bench.h"

namespace takt {
namespace {

TEST(MultibodyTree, PrescribedAccelerationsTakeTheForcesOfInverseDynamics) {
  test::TreeMaker make(11);
  for (int k = 0; k < 500; ++k) {
    TreeModel model = make.tree(make.integer(1, kMaxJoints));
    for (TreeJoint& joint : model.joints) joint.armature = make.integer(0, 1) * make.number(0.0, 5.0);
    const MultibodyTree tree(model);
    const auto n = static_cast<size_t>(tree.joint_count());
    MultibodyTree::Workspace w;
    const JointArray q = make.joints(3.0), qd = make.joints(2.0), tau = make.joints(50.0);
    tree.update(q.data(), qd.data(), w);
    MultibodyTree::Mask held{};
    for (size_t i = 0; i < n; ++i) held[i] = make.integer(0, 1) == 1;
    const JointArray prescribed = make.joints(10.0);
    JointArray qdd = prescribed, holding{}, needed{};
    tree.forward_dynamics(tau.data(), held, qdd.data(), holding.data(), w);
    const Wrench base = tree.base_reaction(w);
    tree.inverse_dynamics(qdd.data(), needed.data(), w);
    double scale = 1.0;
    for (size_t i = 0; i < n; ++i) scale = std::max({scale, std::abs(needed[i]), std::abs(holding[i])});
    for (size_t i = 0; i < n; ++i) {
      EXPECT_NEAR(tau[i] + holding[i], needed[i], 1e-9 * scale);
      if (held[i]) {
        EXPECT_EQ(qdd[i], prescribed[i]);
      } else {
        EXPECT_EQ(holding[i], 0.0);
      }
    }
    EXPECT_LT((base.f - tree.base_reaction(w).f).norm(), 1e-8 * scale);
    EXPECT_LT((base.t - tree.base_reaction(w).t).norm(), 1e-8 * scale);
  }
}

// For any torques of the motors on an arm at rest, the set of sticking joints is consistent: no sticking
// joint needs more than break-away, no sliding joint would move the other way.
TEST(DynamicRobot, JointsThatStickCarryConsistentForces) {
  KinematicRobotParameters k;
  k.robot = 0;
  k.arm = r3::arm();
  const KinematicRobot reference(k);
  DynamicRobotParameters p = r3::robot_parameters();
  // Light rotors: the joints are then coupled strongly through the arm.
  std::vector<std::unique_ptr<Drive>> drives;
  for (size_t i = 0; i < 6; ++i) {
    DetailedDriveParameters d = r3::drive_parameters(r3::kAxes[i]);
    if (!d.elastic_gear) d.motor_inertia_kg_m2 = 0.0;
    drives.push_back(std::make_unique<DetailedDrive>(d));
  }
  DynamicRobot robot(p, std::move(drives), reference, {});
  std::mt19937 random(3);
  std::uniform_real_distribution<double> number(-1.0, 1.0);
  int sticking = 0, sliding = 0;
  for (int trial = 0; trial < 2000; ++trial) {
    RobotBench bench(robot, 0);
    JointArray q{};
    for (size_t i = 0; i < 6; ++i) q[i] = 3.0 * number(random);
    const JointArray qd{};
    robot.state_from_motion(q.data(), qd.data(), bench.x.data());
    for (int j = 0; j < 6; ++j) {
      const r3::Axis& axis = r3::kAxes[j];
      const double per_ampere = axis.elastic ? axis.k : axis.n * axis.k;
      double* z = bench.x.data() + robot.drive_state(j);
      z[DetailedDrive::current] += 2.0 * number(random) * axis.peak * axis.Rv0 / per_ampere;
      // Some were sliding and just come to rest.
      if (random() % 2 == 0)
        robot.drive(j).set_mode(FrictionMode::forward, bench.x[static_cast<size_t>(6 + j)], z);
    }
    bench.switch_modes();
    const auto output = bench.output();
    for (int j = 0; j < 6; ++j) {
      const auto i = static_cast<size_t>(j);
      const Drive& drive = robot.drive(j);
      const double* z = bench.x.data() + robot.drive_state(j);
      const auto mode = static_cast<double>(drive.mode(z));
      if (mode == 0.0) {
        ++sticking;
        EXPECT_LE(std::abs(output.drives[i].friction_torque_N_m), drive.break_away_torque() + 1e-9) << trial;
        if (!r3::kAxes[j].elastic) {
          EXPECT_EQ(output.acceleration[i], 0.0);
        }
      } else {
        ++sliding;
        EXPECT_GT(mode * drive.friction_acceleration(q[i], 0.0, output.acceleration[i], z), 0.0) << trial;
      }
      EXPECT_EQ(drive.friction_speed(bench.x[6 + i], z), 0.0);
    }
    EXPECT_FALSE(bench.switch_modes()) << "once is enough, trial " << trial;
  }
  EXPECT_GT(sticking, 2000);
  EXPECT_GT(sliding, 2000);
}

}  // namespace
}  // namespace takt

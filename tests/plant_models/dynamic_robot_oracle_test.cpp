// A UR10e with its gripper as a dynamic robot: motion as at LoD 1, forces against statics and energy balance,
// jaws with stroke and force limit.
#include "plant_models/robot/dynamic_robot.h"

#include <gtest/gtest.h>

#include "plant_models/robot/detailed_drive.h"
#include "tests/support/r3_robot.h"
#include "tests/support/ur10e_cell.h"

namespace takt {
namespace {

using test::kGravity_m_s2;
using test::Ur10eCell;

double total_mass() {
  double mass = 3.0;
  for (const test::TableLink& link : test::ur10e_table()) mass += link.mass;
  return mass;
}

std::vector<TrajectoryKnot> swing(const JointArray& from) {
  JointArray to = from;
  const double way[6] = {0.9, 0.4, -0.6, 0.5, 0.7, -1.2};
  for (size_t i = 0; i < 6; ++i) to[i] += way[i];
  const std::vector<MotionLimits> limits(6, {1.5, 6.0});
  return point_to_point(0.1, {from.data(), 6}, {to.data(), 6}, limits);
}

TEST(DynamicRobot, TheReferenceMotionEqualsThatOfLevelOne) {
  Ur10eCell cell(test::ideal_servo);
  cell.reference.set_trajectory(swing(test::ready_position()));
  cell.gripper.move_to(0.0, 0.01);
  for (const double t : {0.0, 0.15, 0.3, 0.6}) {
    JointArray q{}, qd{};
    cell.reference.joint_state(t, q.data(), qd.data());
    for (const auto side : {ParallelGripper::left, ParallelGripper::right}) {
      q[6 + static_cast<size_t>(side)] = cell.gripper.coordinate(t, side);
      qd[6 + static_cast<size_t>(side)] = cell.gripper.speed(t, side);
    }
    cell.robot->state_from_motion(q.data(), qd.data(), cell.bench->x.data());
    for (size_t i = 0; i < 8; ++i) {
      EXPECT_EQ(cell.bench->x[i], q[i]);
      EXPECT_EQ(cell.bench->x[8 + i], qd[i]);
    }
    CellMotion expected = cell.bench->motion, found = expected;
    cell.reference.write_motion(t, nullptr, expected);
    cell.gripper.write_motion(t, nullptr, expected);
    cell.robot->write_motion(t, cell.bench->x.data(), found);
    for (size_t b = 0; b < 3; ++b) {
      const BodyMotion &e = expected.bodies[b], &f = found.bodies[b];
      EXPECT_LT((e.X_WB.p - f.X_WB.p).norm(), 1e-14);
      EXPECT_LT((e.X_WB.R - f.X_WB.R).norm(), 1e-14);
      EXPECT_LT((e.p_WBcm - f.p_WBcm).norm(), 1e-14);
      EXPECT_LT((e.V_WB.v - f.V_WB.v).norm(), 1e-13);
      EXPECT_LT((e.V_WB.w - f.V_WB.w).norm(), 1e-13);
    }
    EXPECT_LT((expected.arms[0].V_WF.v - found.arms[0].V_WF.v).norm(), 1e-13);
    EXPECT_LT((expected.arms[0].poses.link[3].R - found.arms[0].poses.link[3].R).norm(), 1e-14);
    EXPECT_LT((expected.arms[0].poses.X_RF.p - found.arms[0].poses.X_RF.p).norm(), 1e-14);
  }
}

// Thesis (5.20), (5.21): at rest the flange carries gripper and Part, the foundation everything.
TEST(DynamicRobot, AtRestFlangeAndBaseCarryTheWeight) {
  for (const auto make : {test::ideal_servo, test::simplified_drive}) {
    Ur10eCell cell(make);
    const Vec3 p_WP =
        cell.bench->motion.bodies[1].p_WBcm + Vec3(0.01, -0.02, 0.03);  // a Part held off-centre
    const Vec3 weight(0.0, 0.0, -0.5 * kGravity_m_s2);
    cell.bench->wrenches[1] = {0.6 * weight,
                               (p_WP - cell.bench->motion.bodies[1].p_WBcm).cross(0.6 * weight)};
    cell.bench->wrenches[0] = {0.4 * weight,
                               (p_WP - cell.bench->motion.bodies[0].p_WBcm).cross(0.4 * weight)};
    for (int i = 0; i < 2000; ++i) cell.bench->rk2(0.001);  // the load came at once: let it settle
    const auto output = cell.bench->output();
    EXPECT_NEAR(output.flange_load_W.f.z(), -34.323275, 1e-5);
    EXPECT_NEAR(output.flange_load_W.f.head<2>().norm(), 0.0, 1e-5);
    EXPECT_NEAR(output.base_reaction_W.f.z(), -(total_mass() + 0.5) * kGravity_m_s2, 1e-4);
    EXPECT_NEAR(output.power.mechanical_total_W, 0.0, 1e-6);

    // Moments: of all weights about the flange.
    const CellMotion& motion = cell.bench->motion;
    const Vec3 p_WF = motion.arms[0].X_WF.p;
    const MountedGripper masses = test::gripper_masses();
    Vec3 moment = (p_WP - p_WF).cross(weight);
    for (size_t b = 0; b < 3; ++b) {
      const BodyInertia& body = b == 0 ? masses.palm : masses.jaw;
      moment +=
          (motion.bodies[b].X_WB * body.p_BBcm_B - p_WF).cross(Vec3(0, 0, -body.mass_kg * kGravity_m_s2));
    }
    EXPECT_LT((output.flange_load_W.t - moment).norm(), 2e-3);  // p_WP moved with the arm by some 1e-5 m
  }
}

// In motion: Newton's law for gripper and Part, with accelerations from finite differences of momentum.
TEST(DynamicRobot, TheLoadOfAMovingFlangeIsTheRateOfMomentum) {
  Ur10eCell cell(test::ideal_servo);
  cell.reference.set_trajectory(swing(test::ready_position()));
  cell.gripper.move_to(0.0, 0.01);
  const MountedGripper masses = test::gripper_masses();
  const auto momentum = [&](Vec3& linear, Vec3& angular) {
    linear = angular = Vec3::Zero();
    for (size_t b = 0; b < 3; ++b) {
      const BodyInertia& body = b == 0 ? masses.palm : masses.jaw;
      const BodyMotion& m = cell.bench->motion.bodies[b];
      const Vec3 r = m.X_WB.R * body.p_BBcm_B;
      const Vec3 p = body.mass_kg * m.V_WB.at(r);
      linear += p;
      angular += (m.X_WB.p + r).cross(p) + m.X_WB.R * body.I_BBcm_B * m.X_WB.R.transpose() * m.V_WB.w;
    }
  };
  constexpr double h = 1e-4;
  while (cell.bench->t < 0.25) cell.bench->rk4(h);
  Vec3 before, angular_before, after, angular_after;
  cell.bench->output();
  momentum(before, angular_before);
  cell.bench->rk4(h);
  const auto output = cell.bench->output();
  const CellMotion now = cell.bench->motion;
  cell.bench->rk4(h);
  cell.bench->output();
  momentum(after, angular_after);
  Vec3 weights = Vec3::Zero(), moments = Vec3::Zero();
  for (size_t b = 0; b < 3; ++b) {
    const BodyInertia& body = b == 0 ? masses.palm : masses.jaw;
    const Vec3 weight(0.0, 0.0, -body.mass_kg * kGravity_m_s2);
    weights += weight;
    moments += (now.bodies[b].X_WB * body.p_BBcm_B).cross(weight);
  }
  const Vec3 force = (after - before) / (2.0 * h) - weights;
  const Vec3 torque = (angular_after - angular_before) / (2.0 * h) - moments;
  EXPECT_GT((force + weights).norm(), 5.0);  // it does accelerate
  EXPECT_LT((output.flange_load_W.f + force).norm(), 1e-4);
  EXPECT_LT((output.flange_load_W.t + torque - now.arms[0].X_WF.p.cross(force)).norm(), 1e-4);
}

TEST(DynamicRobot, IdealServosFollowExactlyWhateverTheLoad) {
  Ur10eCell cell(test::ideal_servo);
  cell.reference.set_trajectory(swing(test::ready_position()));
  cell.bench->x[2] += 0.01;  // an error to start with
  for (int i = 0; i < 800; ++i) {
    cell.bench->wrenches[0].f = Vec3(40.0, -30.0 * std::sin(0.01 * i), 20.0);
    cell.bench->wrenches[2].t = Vec3(0.0, 3.0, 1.0);
    cell.bench->rk4(0.001);
    JointArray q{}, qd{};
    cell.reference.joint_state(cell.bench->t, q.data(), qd.data());
    const double wt = 100.0 * cell.bench->t;
    for (size_t j = 0; j < 6; ++j) {
      const double error = j == 2 ? 0.01 * (1.0 + wt) * std::exp(-wt) : 0.0;
      // The steps do not stop at the corners of the reference: 6 rad/s^2 times half a step squared.
      ASSERT_NEAR(cell.bench->x[j], q[j] + error, 5e-6) << j << " at " << cell.bench->t;
    }
  }
}

// Work of the drives less work of the wrenches is the change of the arm's energy.
TEST(DynamicRobot, TheEnergyOfAMotionBalances) {
  RobotPowerParameters power;
  power.idle_W = 200.0, power.loss_factor = 1.3;
  Ur10eCell cell(test::simplified_drive, test::base_pose(), 60.0, power);
  cell.reference.set_trajectory(swing(test::ready_position()));
  cell.gripper.move_to(0.0, 0.01);
  cell.bench->wrenches[0].f = Vec3(15.0, -10.0, 5.0);  // constant force on the palm
  MultibodyTree::Workspace w;
  const auto energy = [&] {
    const MultibodyTree& tree = cell.robot->tree();
    tree.update(cell.bench->x.data(), cell.bench->x.data() + 8, w);
    double e = tree.kinetic_energy(w) + tree.potential_energy(w);
    for (size_t j = 0; j < 6; ++j) {
      const double armature = cell.robot->drive(static_cast<int>(j)).armature();
      e -= 0.5 * armature * cell.bench->x[8 + j] * cell.bench->x[8 + j];
    }
    cell.bench->output();
    return e - cell.bench->wrenches[0].f.dot(cell.bench->motion.bodies[0].p_WBcm);
  };
  const double start = energy();
  const auto work = static_cast<size_t>(cell.robot->energy_state());
  double electrical = 0.0, counted = 0.0, largest = 0.0;
  constexpr double h = 0.0005;
  while (cell.bench->t < 1.0) {
    const auto a = cell.bench->output();
    const std::vector<double> before(cell.bench->x.begin(), cell.bench->x.end());
    cell.bench->rk4(h);
    const auto b = cell.bench->output();
    counted += cell.robot->electrical_energy_J(h, before.data(), cell.bench->x.data());
    double sum = 0.0, supply = 200.0;
    for (size_t j = 0; j < 8; ++j) {
      EXPECT_EQ(b.power.mechanical_W[j], b.torque[j] * cell.bench->x[8 + j]);
      sum += b.power.mechanical_W[j];
      supply += 1.3 * std::max(0.0, b.power.mechanical_W[j]);  // (5.24), (5.25), no recuperation
    }
    ASSERT_NEAR(b.power.mechanical_total_W, sum, 1e-9);
    ASSERT_NEAR(b.power.electrical_W, supply, 1e-9);
    electrical += 0.5 * h * (a.power.electrical_W + b.power.electrical_W);
    largest = std::max(largest, std::abs(cell.bench->x[work]));
    ASSERT_NEAR(energy() - start, cell.bench->x[work], 0.01);
  }
  EXPECT_GT(largest, 10.0);
  EXPECT_NEAR(counted, electrical, 1e-3 * electrical);
}

TEST(DynamicRobot, SimplifiedDrivesFollowWithHeunStepsOfOneMillisecond) {
  Ur10eCell cell(test::simplified_drive);
  cell.reference.set_trajectory(swing(test::ready_position()));
  double worst = 0.0;
  JointArray q{}, qd{};
  while (cell.bench->t < 3.0) {
    cell.bench->rk2(0.001);
    cell.reference.joint_state(cell.bench->t, q.data(), qd.data());
    for (size_t j = 0; j < 6; ++j) worst = std::max(worst, std::abs(cell.bench->x[j] - q[j]));
  }
  EXPECT_LT(worst, 0.02);
  EXPECT_GT(worst, 1e-4);  // they are no ideal servos
  for (size_t j = 0; j < 6; ++j) EXPECT_NEAR(cell.bench->x[j], q[j], 1e-5);
}

TEST(Jaws, JawsTravelToTheCommandedWidthAndStopAtTheirStroke) {
  Ur10eCell cell(test::ideal_servo);
  const auto run = [&](double until) {
    while (cell.bench->t < until) cell.bench->rk2(0.001);
  };
  cell.gripper.move_to(0.0, 0.02);
  EXPECT_NEAR(cell.robot->next_time_event(0.0), 0.02 / 0.075, 1e-12);
  run(0.2);
  // 0.03 m to 0.01 m take 0.267 s; the servo of 100 rad/s follows 2/w late.
  EXPECT_NEAR(cell.bench->x[6], 0.03 - 0.075 * (0.2 - 2.0 / 100.0), 1e-6);
  run(0.6);
  EXPECT_NEAR(cell.bench->x[6], 0.01, 1e-9);
  EXPECT_NEAR(cell.bench->x[7], 0.01, 1e-9);
  cell.gripper.move_to(cell.bench->t, 0.085);
  run(1.5);
  EXPECT_NEAR(cell.bench->x[6], 0.0425, 1e-9);
  // More than the servo holds pushes the jaw into its end stop, and no further.
  const Vec3 outwards = cell.bench->motion.bodies[1].X_WB.R.col(1);
  cell.bench->wrenches[1].f = 100.0 * outwards;
  run(2.0);
  const double stiffness = 0.1 * 500.0 * 500.0;
  const double weight = -0.1 * kGravity_m_s2 * outwards.z();
  EXPECT_NEAR(cell.bench->x[6], 0.0425 + (100.0 - 60.0 + weight) / stiffness, 1e-5);
  EXPECT_NEAR(cell.bench->output().torque[6], -60.0, 1e-9);
}

TEST(Jaws, JawsPressWithNoMoreThanTheirForce) {
  Ur10eCell cell(test::ideal_servo);
  cell.gripper.move_to(0.0, 0.0);
  // Between the jaws lies a springy block of 40 mm.
  constexpr double kStiffness = 2e4, kDamping = 50.0;
  while (cell.bench->t < 1.0) {
    cell.bench->output();
    for (const size_t jaw : {size_t{1}, size_t{2}}) {
      const double depth = 0.02 - cell.bench->x[5 + jaw];
      const double force = depth > 0.0 ? kStiffness * depth - kDamping * cell.bench->x[13 + jaw] : 0.0;
      cell.bench->wrenches[jaw].f = force * cell.bench->motion.bodies[jaw].X_WB.R.col(1);
    }
    cell.bench->rk2(0.0005);
  }
  const auto output = cell.bench->output();
  for (const size_t jaw : {size_t{1}, size_t{2}}) {
    EXPECT_NEAR(output.torque[5 + jaw], -60.0, 1e-9);
    const double weight = -0.1 * kGravity_m_s2 * cell.bench->motion.bodies[jaw].X_WB.R.col(1).z();
    EXPECT_NEAR(cell.bench->x[5 + jaw], 0.02 - (60.0 - weight) / kStiffness, 1e-7);
    EXPECT_NEAR(cell.bench->x[13 + jaw], 0.0, 1e-6);
  }
}

std::unique_ptr<Drive> detailed_drive(int joint) {
  DetailedDriveParameters p = r3::drive_parameters(r3::kAxes[joint]);
  p.position_at_joint = true;
  p.friction = {};
  return std::make_unique<DetailedDrive>(p);
}

/// How far the joints leave their reference (rad) within `window_s` after a start in the motion at `from_s`,
/// with 5 kg on the palm: the drives know of load and acceleration, or they do not.
double largest_lag(test::DriveMaker make, bool moving, double from_s, double window_s, bool knows) {
  Ur10eCell cell(make);
  if (moving) cell.reference.set_trajectory(swing(test::ready_position()));
  RobotBench& bench = *cell.bench;
  JointArray q{}, qd{};
  cell.reference.joint_state(from_s, q.data(), qd.data());
  for (const size_t side : {size_t{0}, size_t{1}}) q[6 + side] = bench.x[6 + side];
  // Of a robot at LoD 1, as the cell has it at a switch.
  cell.reference.write_motion(from_s, nullptr, bench.motion);
  cell.gripper.write_motion(from_s, nullptr, bench.motion);
  bench.wrenches[0] = {{0.0, 0.0, -5.0 * kGravity_m_s2}, {0.4, -0.3, 0.0}};
  bench.t = from_s;
  if (knows)
    cell.robot->state_from_motion(from_s, q.data(), qd.data(), bench.motion, bench.wrenches, bench.x.data());
  else
    cell.robot->state_from_motion(q.data(), qd.data(), bench.x.data());
  double lag = 0.0;
  while (bench.t < from_s + window_s) {
    bench.rk4(2e-5);
    cell.reference.joint_state(bench.t, q.data(), qd.data());
    for (size_t i = 0; i < 6; ++i) lag = std::max(lag, std::abs(bench.x[i] - q[i]));
  }
  return lag;
}

// A change of the level of detail with a Part in the gripper.
TEST(DynamicRobot, DrivesStartInEquilibriumWithTheLoad) {
  for (const auto make : {test::simplified_drive, &detailed_drive}) {
    EXPECT_LT(largest_lag(make, false, 0.0, 0.5, true), 1e-9);
    EXPECT_GT(largest_lag(make, false, 0.0, 0.5, false), 1e-5);
  }
}

TEST(DynamicRobot, DrivesStartInEquilibriumWithLoadAndAcceleration) {
  for (const auto make : {test::simplified_drive, &detailed_drive}) {
    for (const double from_s : {0.2, 0.5}) {  // accelerating, at constant speed
      EXPECT_LT(largest_lag(make, true, from_s, 0.05, true),
                0.2 * largest_lag(make, true, from_s, 0.05, false));
    }
  }
}

TEST(DynamicRobot, MismatchedParametersAreRefused) {
  const KinematicRobot reference(test::ur10e_reference({}));
  DynamicRobotParameters p;
  p.arm = test::ur10e_arm();
  p.links.resize(5);
  const auto expect_refused = [&](const char* text) {
    try {
      std::vector<std::unique_ptr<Drive>> drives;
      for (int i = 0; i < 6; ++i) drives.push_back(test::ideal_servo(i));
      DynamicRobot(p, std::move(drives), reference, {});
      ADD_FAILURE() << "no error, expected " << text;
    } catch (const std::invalid_argument& e) {
      EXPECT_NE(std::string(e.what()).find(text), std::string::npos) << e.what();
    }
  };
  expect_refused("5 link inertias for 6 joints");
  p.links.resize(6);
  expect_refused("nothing resists its motion");
}

}  // namespace
}  // namespace takt

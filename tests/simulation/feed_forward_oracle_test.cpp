// Torques sent as feed-forward: closed forms of one axis, weights by a second implementation, the motor's
// current.
#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "plant_models/robot/detailed_drive.h"
#include "tests/support/kdl_tree.h"
#include "tests/support/r3_robot.h"
#include "tests/support/ur10e_cell.h"

namespace takt {
namespace {

using test::Ur10eCell;

constexpr std::size_t kArmJoints = 6;

/// Torques of the arm's joints at rest, by KDL; gripper and jaws are part of the tree.
JointArray weights_by_kdl(const Ur10eCell& cell) {
  const MultibodyTree& tree = cell.robot->tree();
  const TreeModel& model = tree.model();
  const KDL::Tree other = test::kdl_tree(model);
  KDL::TreeIdSolver_RNE solver(other, test::kdl(model.gravity_R));
  const std::vector<unsigned> number = test::kdl_numbers(model, other);
  const auto n = static_cast<unsigned>(tree.joint_count());
  KDL::JntArray q(n), zero(n), tau(n);
  for (unsigned i = 0; i < n; ++i) q(number[i]) = cell.bench->x[i];
  EXPECT_GE(solver.CartToJnt(q, zero, zero, {}, tau), 0);
  JointArray result{};
  for (std::size_t i = 0; i < kArmJoints; ++i) result[i] = tau(number[i]);
  return result;
}

/// Largest distance of a joint from its initial position, over this number of steps of 1 ms.
double largest_way(Ur10eCell& cell, int steps) {
  const std::vector<double> begin = cell.bench->x;
  double largest = 0.0;
  for (int k = 0; k < steps; ++k) {
    cell.bench->rk2(0.001);
    for (std::size_t i = 0; i < kArmJoints; ++i)
      largest = std::max(largest, std::abs(cell.bench->x[i] - begin[i]));
  }
  return largest;
}

// The weight acts as a step: integrators at zero carry no part of it.
TEST(FeedForward, TheWeightAsFeedForwardRemovesTheSagAfterAStepOfLoad) {
  for (const bool sent : {false, true}) {
    Ur10eCell cell(test::simplified_drive);
    const JointArray weights = weights_by_kdl(cell);
    EXPECT_GT(std::abs(weights[1]), 20.0);
    for (int i = 0; i < static_cast<int>(kArmJoints); ++i)
      cell.bench->x[static_cast<std::size_t>(cell.robot->drive_state(i))] = 0.0;
    if (sent) cell.reference.set_feed_forward(weights.data());
    const double sag_rad = largest_way(cell, 500);
    if (sent) {
      EXPECT_LT(sag_rad, 1e-12);
    } else {
      EXPECT_GT(sag_rad, 1e-3);
    }
  }
}

// The integrators compensate the whole error of a feed-forward: x = -tau_ff Ti / (I kv) beside the weight.
TEST(FeedForward, WrongFeedForwardEndsInTheSamePlace) {
  Ur10eCell cell(test::simplified_drive);
  const std::vector<double> begin = cell.bench->x;
  const JointArray wrong{30.0, -50.0, 20.0, 5.0, -4.0, 2.0};
  cell.reference.set_feed_forward(wrong.data());
  EXPECT_GT(largest_way(cell, 300), 1e-3);
  largest_way(cell, 5000);
  for (int i = 0; i < static_cast<int>(kArmJoints); ++i) {
    const auto k = static_cast<std::size_t>(i);
    EXPECT_NEAR(cell.bench->x[k], begin[k], 1e-9) << i;
    const auto& p = dynamic_cast<const SimplifiedDrive&>(cell.robot->drive(i)).parameters();
    const auto z = static_cast<std::size_t>(cell.robot->drive_state(i));
    const double expected = -wrong[k] * p.integral_time_s / (p.inertia() * p.speed_gain_per_s);
    EXPECT_NEAR(cell.bench->x[z] - begin[z], expected, 1e-8) << i;
    EXPECT_NEAR(cell.bench->output().torque[k], weights_by_kdl(cell)[k], 1e-5) << i;
  }
}

// One axis on its own inertia: q / tau_ff = s / (I (s + a) (s + b) (s + c)), the gains made for these poles.
TEST(FeedForward, TheResponseOfOneAxisIsThatOfItsTransferFunction) {
  constexpr double a = 10.0, b = 40.0, c = 100.0, inertia = 3.0, torque = 7.0;
  SimplifiedDriveParameters p;
  p.load_inertia_kg_m2 = inertia;
  p.speed_gain_per_s = a + b + c;
  const double sum = (a * b + b * c + c * a) / p.speed_gain_per_s, product = a * b * c / p.speed_gain_per_s;
  p.position_gain_per_s = 0.5 * sum + std::sqrt(0.25 * sum * sum - product);
  p.integral_time_s = 1.0 / (sum - p.position_gain_per_s);
  const SimplifiedDrive drive(p);
  const JointReference wanted{0.0, 0.0, 0.0, torque};
  using State = std::array<double, 3>;  // q, qd, x
  const auto rate = [&](const State& s) {
    State d{s[1], drive.output(wanted, s[0], s[1], &s[2]).torque / inertia, 0.0};
    drive.derivatives(wanted, s[0], s[1], &s[2], &d[2]);
    return d;
  };
  const auto plus = [](const State& s, double h, const State& d) {
    return State{s[0] + h * d[0], s[1] + h * d[1], s[2] + h * d[2]};
  };
  State s{};
  constexpr double h = 1e-4;
  double highest = 0.0;
  for (int step = 1; step <= 20000; ++step) {
    const State k1 = rate(s), k2 = rate(plus(s, 0.5 * h, k1)), k3 = rate(plus(s, 0.5 * h, k2)),
                k4 = rate(plus(s, h, k3));
    s = plus(plus(plus(plus(s, h / 6.0, k1), h / 3.0, k2), h / 3.0, k3), h / 6.0, k4);
    const double t = step * h;
    const double exact = torque / inertia *
                         (std::exp(-a * t) / ((b - a) * (c - a)) + std::exp(-b * t) / ((a - b) * (c - b)) +
                          std::exp(-c * t) / ((a - c) * (b - c)));
    ASSERT_NEAR(s[0], exact, 1e-10) << t;
    highest = std::max(highest, s[0]);
  }
  EXPECT_GT(highest, 1e-4);
  EXPECT_NEAR(s[0], 0.0, 1e-9);
}

// The limit is that of the whole torque, and the integrator does not wind up against it.
TEST(FeedForward, TorqueIsAddedBeforeTheLimit) {
  SimplifiedDriveParameters p;
  p.load_inertia_kg_m2 = 2.0, p.max_torque = 5.0;
  p.set_bandwidth(40.0);
  const SimplifiedDrive drive(p);
  const double x = 0.0;
  double rate = 0.0;
  for (const double torque : {-80.0, -3.0, 4.5, 11.0}) {
    const JointReference wanted{0.1, 0.0, 0.0, torque};
    const double limited = std::max(-5.0, std::min(5.0, torque));
    EXPECT_EQ(drive.output(wanted, 0.1, 0.0, &x).torque, limited);
    drive.derivatives(wanted, 0.1, 0.0, &x, &rate);
    EXPECT_NEAR(rate, (limited - torque) / (2.0 * p.speed_gain_per_s), 1e-15);
    EXPECT_EQ(drive.sample(wanted, 0.1, 0.0, 0.0, &x).motor_torque_N_m, limited);
  }
}

// With the mechanics held at their reference only the current can move: to tau_ff / (n k), with the sign of
// the gear. This gives the joint torque n k i = tau_ff.
TEST(FeedForward, TheMotorCurrentChangesByTorqueOverRatioAndConstant) {
  constexpr double torque = 12.0, h = 1e-6;
  int backward = 0;
  for (const r3::Axis& axis : r3::kAxes) {
    const DetailedDriveParameters p = r3::drive_parameters(axis);
    const DetailedDrive drive(p);
    const JointReference still{0.3, 0.0, 0.0}, pushed{0.3, 0.0, 0.0, torque};
    std::array<double, DriveJacobian::kMaxStates> z{}, before{}, after{};
    drive.initial_state(still, 0.0, z.data());
    EXPECT_EQ(z[DetailedDrive::current], 0.0);
    const double ratio = p.gear_ratio * p.motor_constant_N_m_per_A;
    // The set-point jumps at once: i_ref enters the current controller with w R / (2 g D).
    drive.derivatives(still, 0.3, 0.0, z.data(), before.data());
    drive.derivatives(pushed, 0.3, 0.0, z.data(), after.data());
    const double loop =
        p.current_loop_rad_per_s * p.resistance_ohm / (2.0 * p.power_stage_gain * p.current_loop_damping);
    const double jump =
        (before[DetailedDrive::current_controller] - after[DetailedDrive::current_controller]) / loop;
    EXPECT_NEAR(jump, torque / ratio, 1e-12);
    EXPECT_EQ(before[DetailedDrive::integrator], after[DetailedDrive::integrator]);
    for (int step = 0; step < 20000; ++step) {  // the electrical states only
      drive.derivatives(pushed, 0.3, 0.0, z.data(), after.data());
      for (const int i :
           {DetailedDrive::integrator, DetailedDrive::current_controller, DetailedDrive::current})
        z[static_cast<std::size_t>(i)] += h * after[static_cast<std::size_t>(i)];
    }
    EXPECT_NEAR(z[DetailedDrive::current], torque / ratio, 1e-9);
    EXPECT_NEAR(drive.sample(pushed, 0.3, 0.0, 0.0, z.data()).motor_torque_N_m * p.gear_ratio, torque, 1e-6);
    backward += p.gear_ratio < 0.0 ? 1 : 0;
  }
  EXPECT_GT(backward, 0);
}

TEST(FeedForward, AnIdealServoIsNotAffected) {
  const IdealServo servo(IdealServoParameters{});
  const JointReference still{0.3, 0.1, 0.2}, pushed{0.3, 0.1, 0.2, 50.0};
  EXPECT_EQ(servo.output(still, 0.0, 0.0, nullptr).acceleration,
            servo.output(pushed, 0.0, 0.0, nullptr).acceleration);
}

}  // namespace
}  // namespace takt

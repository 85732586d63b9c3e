// The structured Jacobian of a dynamic robot against finite differences. Without gravity and at rest its
// omissions (gravity, velocity-dependent forces, change of the mass matrix) do not matter, so all its entries
// must be exact. entries must be exact.
#include <gtest/gtest.h>

#include "tests/support/r3_robot.h"
#include "tests/support/ur10e_cell.h"

namespace takt {
namespace {

std::unique_ptr<Drive> r3_drive(int joint) {
  return std::make_unique<DetailedDrive>(r3::drive_parameters(r3::kAxes[joint]));
}

class Comparison {
 public:
  Comparison(const DynamicRobot& robot, RobotBench& bench) : robot_(robot), bench_(bench) {
    robot.jacobian_pattern(pattern_);
    values_.resize(pattern_.size());
    bench_.output();
    robot.jacobian(bench.t, bench.x.data(), bench.motion, values_.data());
  }
  /// Compares the columns given, all rows but those of the energies and those of `rows_left_out`.
  void expect_columns(const std::vector<int>& columns, const std::vector<int>& rows_left_out = {}) const {
    const int n = robot_.state_count();
    for (const int c : columns) {
      const double h = 1e-6;
      std::vector<double> plus = bench_.x, minus = bench_.x;
      plus[static_cast<size_t>(c)] += h, minus[static_cast<size_t>(c)] -= h;
      const auto a = bench_.derivatives(bench_.t, plus), b = bench_.derivatives(bench_.t, minus);
      std::vector<double> column(static_cast<size_t>(n));
      for (size_t e = 0; e < pattern_.size(); ++e) {
        if (pattern_[e].second == c) column[static_cast<size_t>(pattern_[e].first)] = values_[e];
      }
      for (int r = 0; r < robot_.energy_state(); ++r) {
        if (std::find(rows_left_out.begin(), rows_left_out.end(), r) != rows_left_out.end()) continue;
        const auto k = static_cast<size_t>(r);
        const double difference = (a[k] - b[k]) / (2.0 * h);
        ASSERT_NEAR(column[k], difference, 1e-5 * (1.0 + std::abs(difference)))
            << "row " << r << " column " << c;
      }
    }
  }
  const std::vector<std::pair<int, int>>& pattern() const { return pattern_; }

 private:
  const DynamicRobot& robot_;
  RobotBench& bench_;
  std::vector<std::pair<int, int>> pattern_;
  std::vector<double> values_;
};

TEST(DynamicRobotJacobian, DetailedDrivesInAnyModeHaveTheExactJacobianAtRest) {
  KinematicRobotParameters k;
  k.robot = 0;
  k.arm = r3::arm();
  for (size_t i = 0; i < 6; ++i) k.q_initial[i] = r3::kAxes[i].start_deg * M_PI / 180.0;
  const KinematicRobot reference(k);
  DynamicRobotParameters p = r3::robot_parameters();
  p.gravity_W.setZero();
  for (int modes = 0; modes < 64; modes += 7) {
    SCOPED_TRACE(modes);
    // Joint 6 alternates between its drive and a servo, so that free, locked and prescribed joints meet.
    auto drives = r3::drives();
    if (modes % 2 == 1) drives[5] = std::make_unique<IdealServo>(IdealServoParameters{});
    DynamicRobot robot(p, std::move(drives), reference, {});
    RobotBench bench(robot, 0);
    std::vector<int> q, others, mode_rows;
    for (int j = 0; j < 6; ++j) {
      const Drive& drive = robot.drive(j);
      double* z = bench.x.data() + robot.drive_state(j);
      if (modes >> j & 1) drive.set_mode(FrictionMode::forward, bench.x[static_cast<size_t>(6 + j)], z);
      q.push_back(j);
      others.push_back(6 + j);
      const int real_states = drive.has_modes() ? drive.state_count() - 1 : drive.state_count();
      for (int c = 0; c < real_states; ++c) others.push_back(robot.drive_state(j) + c);
    }
    const Comparison comparison(robot, bench);
    comparison.expect_columns(others);
    // Sliding friction accelerates the arm, and then M(q) matters.
    if (modes == 0) comparison.expect_columns(q);
  }
}

TEST(DynamicRobotJacobian, ServosAndJawsHaveTheExactJacobianAtRest) {
  for (const auto make : {test::ideal_servo, test::simplified_drive}) {
    test::Ur10eCell cell(make);
    DynamicRobotParameters p = cell.robot->parameters();
    p.gravity_W.setZero();
    std::vector<std::unique_ptr<Drive>> drives;
    for (int i = 0; i < 6; ++i) drives.push_back(i == 2 ? test::ideal_servo(i) : make(i));
    DynamicRobot robot(p, std::move(drives), cell.reference, {&cell.gripper});
    RobotBench bench(robot, 3);
    std::vector<int> columns;
    for (int c = 0; c < robot.energy_state(); ++c) {
      const bool of_jaw = c == 6 || c == 7 || c == 14 || c == 15;
      if (!of_jaw) columns.push_back(c);
    }
    const Comparison comparison(robot, bench);
    comparison.expect_columns(columns);
    // A jaw pushes back on the arm: left to the explicit part.
    comparison.expect_columns({6, 7, 14, 15}, {8, 9, 10, 11, 12, 13});
  }
}

// How the reference alone changes the derivatives: exact in positions and speeds, at any state.
TEST(DynamicRobotJacobian, TheTimeDerivativeFollowsTheMovingReference) {
  for (const auto make : {test::ideal_servo, test::simplified_drive, r3_drive}) {
    KinematicRobotParameters k;
    k.robot = 0;
    k.arm = r3::arm();
    KinematicRobot reference(k);
    reference.set_trajectory(r3::motion());
    std::vector<std::unique_ptr<Drive>> drives;
    for (int i = 0; i < 6; ++i) drives.push_back(make(i));
    DynamicRobot robot(r3::robot_parameters(), std::move(drives), reference, {});
    RobotBench bench(robot, 0);
    bench.switch_modes();
    for (const double t : {0.05, 0.7, 1.3}) {
      while (bench.t < t) bench.rk4(2e-5);
      std::vector<double> rate(bench.x.size());
      bench.output();
      robot.time_derivative(bench.t, bench.x.data(), bench.motion, rate.data());
      constexpr double h = 1e-4;
      const auto before = bench.derivatives(bench.t - h, bench.x),
                 after = bench.derivatives(bench.t + h, bench.x);
      double largest = 0.0;
      for (size_t i = 0; i < static_cast<size_t>(robot.energy_state()); ++i) {
        const double expected = (after[i] - before[i]) / (2.0 * h);
        EXPECT_NEAR(rate[i], expected, 1e-5 * (1.0 + std::abs(expected))) << "state " << i << " at " << t;
        largest = std::max(largest, std::abs(expected));
      }
      EXPECT_GT(largest, 0.1);
    }
  }
}

TEST(DynamicRobotJacobian, ErrorWeightsArePositive) {
  test::Ur10eCell cell(test::simplified_drive);
  std::vector<double> scales(static_cast<size_t>(cell.robot->state_count()));
  cell.robot->state_scales(scales.data());
  for (const double scale : scales) EXPECT_GT(scale, 0.0);
}

TEST(DynamicRobotJacobian, ThePatternHasEveryPlaceOnceAndInsideTheSegment) {
  test::Ur10eCell cell(test::simplified_drive);
  std::vector<std::pair<int, int>> pattern;
  cell.robot->jacobian_pattern(pattern);
  for (const auto& [row, column] : pattern) {
    EXPECT_GE(row, 0);
    EXPECT_LT(row, cell.robot->energy_state());
    EXPECT_GE(column, 0);
    EXPECT_LT(column, cell.robot->energy_state());
  }
  std::sort(pattern.begin(), pattern.end());
  EXPECT_EQ(std::adjacent_find(pattern.begin(), pattern.end()), pattern.end());
}

}  // namespace
}  // namespace takt

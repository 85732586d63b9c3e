// The r3 robot by configuration: DetailedDrive and DynamicRobot against the published initial state and
// against a second implementation (scalar drive equations, mechanics by Orocos KDL), both with classical
// Runge-Kutta steps of 2e-5 s, over the whole motion with all its sticking and sliding.
#include "tests/support/r3_robot.h"

#include <gtest/gtest.h>

#include "tests/support/r3_oracle.h"
#include "tests/support/robot_bench.h"

namespace takt {
namespace {

using State = DetailedDrive::State;

class R3 : public testing::Test {
 protected:
  R3() : reference_(reference_parameters()) {
    reference_.set_trajectory(r3::motion());
    robot_ = std::make_unique<DynamicRobot>(r3::robot_parameters(), r3::drives(), reference_,
                                            std::vector<const ParallelGripper*>{});
    bench_ = std::make_unique<RobotBench>(*robot_, 0);
  }
  static KinematicRobotParameters reference_parameters() {
    KinematicRobotParameters p;
    p.robot = 0;
    p.arm = r3::arm();
    return p;
  }
  const double* z(int joint) const { return bench_->x.data() + robot_->drive_state(joint); }
  int mode(int joint) const { return static_cast<int>(robot_->drive(joint).mode(z(joint))); }

  KinematicRobot reference_;
  std::unique_ptr<DynamicRobot> robot_;
  std::unique_ptr<RobotBench> bench_;
};

void expect_relative(double value, double expected, double relative) {
  EXPECT_NEAR(value, expected, relative * std::max(1.0, std::abs(expected)));
}

TEST_F(R3, TheRobotStartsInThePublishedState) {
  const double psi[3] = {0.0, 0.274150862, 0.073678181};
  const double i[6] = {0.0, -1.888091334, -3.678834772, -0.600424393, -0.724279315, 0.0};
  const double vC[6] = {0.0, 94.40456670, 183.94173862, 30.02121966, 36.21396577, 0.0};
  const double x[6] = {0.0, -5.146936977, -7.726060448, -1.200848786, -1.448558631, 0.0};
  for (int j = 0; j < 6; ++j) {
    SCOPED_TRACE(j);
    if (j < 3) {
      expect_relative(z(j)[State::deflection], psi[j], 1e-9);
      EXPECT_EQ(z(j)[State::motor_speed], 0.0);
    }
    expect_relative(z(j)[State::current], i[j], 1e-9);
    expect_relative(z(j)[State::current_controller], vC[j], 1e-9);
    expect_relative(z(j)[State::integrator], x[j], 1e-9);
    EXPECT_EQ(mode(j), 0);
  }
  const auto output = bench_->output();
  const auto xdot = bench_->derivatives(0.0, bench_->x);
  for (int j = 0; j < 6; ++j) {
    EXPECT_NEAR(output.drives[static_cast<size_t>(j)].friction_torque_N_m, 0.0, 1e-10) << j;
    EXPECT_NEAR(xdot[static_cast<size_t>(6 + j)], 0.0, 1e-10) << j;  // qdd
    const double* zdot = xdot.data() + robot_->drive_state(j);
    EXPECT_NEAR(zdot[State::current_controller], 0.0, 1e-7) << j;
    EXPECT_NEAR(zdot[State::current], 0.0, 1e-7) << j;
  }
}

TEST_F(R3, TheReferenceHasThePublishedCorners) {
  const double corners[] = {0.11742424, 1.23862076, 1.35604500};
  double t = 0.0;
  for (const double corner : corners) EXPECT_NEAR(t = robot_->next_time_event(t), corner, 5e-9);
  EXPECT_EQ(robot_->next_time_event(t), std::numeric_limits<double>::infinity());
  for (double at = -0.01; at < 1.5; at += 0.00317) {
    double s, sd;
    r3::path(std::max(0.0, at), s, sd);
    JointArray q, qd;
    reference_.joint_state(at, q.data(), qd.data());
    for (size_t j = 0; j < 6; ++j) {
      const double way = (r3::kAxes[j].end_deg - r3::kAxes[j].start_deg) * M_PI / 180.0;
      EXPECT_NEAR(q[j], r3::kAxes[j].start_deg * M_PI / 180.0 + s * way, 1e-13);
      EXPECT_NEAR(qd[j], sd * way, 1e-12);
    }
  }
}

TEST_F(R3, TheMotionFollowsTheSecondImplementation) {
  r3::Oracle oracle;
  oracle.switch_modes();
  bench_->switch_modes();
  constexpr double h = 2e-5;
  std::array<int, 6> switches{};
  std::array<int, 6> before{};
  for (int step = 0; step < 92802; ++step) {
    oracle.step(h);
    bench_->rk4(h);
    for (int j = 0; j < 6; ++j) {
      const auto k = static_cast<size_t>(j);
      const auto& other = oracle.state[k];
      ASSERT_EQ(mode(j), oracle.mode[k]) << "axis " << j + 1 << " at " << bench_->t;
      ASSERT_NEAR(bench_->x[k], other.q, 1e-9) << "axis " << j + 1 << " at " << bench_->t;
      ASSERT_NEAR(bench_->x[6 + k], other.qd, 1e-7) << "axis " << j + 1 << " at " << bench_->t;
      ASSERT_NEAR(z(j)[State::current], other.i, 1e-6) << "axis " << j + 1 << " at " << bench_->t;
      if (r3::kAxes[j].elastic) {
        ASSERT_NEAR(z(j)[State::deflection], other.psi, 1e-8) << "axis " << j + 1 << " at " << bench_->t;
      }
      if (mode(j) != before[k]) ++switches[k], before[k] = mode(j);
    }
  }
  for (const int count : switches) EXPECT_GT(count, 0);  // all of them broke away
}

// Sections "expected behaviour": deviations, currents, and the power balance of the whole motion, from the
// work of the drives to the energy of the arm.
TEST_F(R3, TheWholeMotionStaysWithinThePublishedBounds) {
  bench_->switch_modes();
  constexpr double h = 2e-5;
  std::array<double, 6> deviation{};
  double current = 0.0, energy_error = 0.0;
  MultibodyTree::Workspace w;
  const auto energy = [&] {
    const MultibodyTree& tree = robot_->tree();
    tree.update(bench_->x.data(), bench_->x.data() + 6, w);
    double kinetic = tree.kinetic_energy(w);  // less the rotors, which belong to the drives
    for (size_t j = 0; j < 6; ++j)
      kinetic -= 0.5 * robot_->drive(static_cast<int>(j)).armature() * bench_->x[6 + j] * bench_->x[6 + j];
    return kinetic + tree.potential_energy(w);
  };
  const double start = energy();
  const auto work = static_cast<size_t>(robot_->energy_state());
  while (bench_->t < 1.856) {
    bench_->rk4(h);
    JointArray q, qd;
    reference_.joint_state(bench_->t, q.data(), qd.data());
    for (size_t j = 0; j < 6; ++j) {
      deviation[j] = std::max(deviation[j], std::abs(bench_->x[j] - q[j]));
      current = std::max(current, std::abs(z(static_cast<int>(j))[State::current]));
    }
    energy_error = std::max(energy_error, std::abs(energy() - start - bench_->x[work]));
  }
  for (const double d : deviation) {
    EXPECT_GT(d, 0.0005);
    EXPECT_LT(d, 0.0175);
  }
  EXPECT_GT(deviation[2], 0.015);
  EXPECT_GT(current, 10.0);
  EXPECT_LT(current, 20.0);
  EXPECT_LT(energy_error, 1e-3);  // of some 1e3 J that are exchanged
  for (size_t j = 0; j < 6; ++j) EXPECT_NEAR(bench_->x[j], r3::kAxes[j].end_deg * M_PI / 180.0, 0.002);
  EXPECT_GT(bench_->x[work + 1], 0.0);
}

}  // namespace
}  // namespace takt

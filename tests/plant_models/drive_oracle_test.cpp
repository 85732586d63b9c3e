// Drives one by one: exact Jacobians, step response, the single-axis example of the r3 robot, refusals.
#include "plant_models/robot/drive.h"

#include <gtest/gtest.h>

#include <complex>
#include <random>

#include "plant_models/robot/ideal_servo.h"
#include "plant_models/robot/simplified_drive.h"
#include "tests/support/r3_robot.h"
#include "tests/support/robot_bench.h"

namespace takt {
namespace {

constexpr int kMax = DriveJacobian::kMaxStates;

DetailedDriveParameters axis(size_t i, bool regularised) {
  DetailedDriveParameters p = r3::drive_parameters(r3::kAxes[i]);
  p.friction.regularised = regularised;
  p.friction.regularisation_speed_rad_per_s = 0.5;
  return p;
}

std::vector<std::unique_ptr<Drive>> all_drives() {
  std::vector<std::unique_ptr<Drive>> drives;
  drives.push_back(std::make_unique<IdealServo>(IdealServoParameters{}));
  for (const double limit : {1e9, 5.0}) {  // the second is always at its limit
    SimplifiedDriveParameters p;
    p.gear_ratio = -80.0, p.rotor_inertia_kg_m2 = 1e-4, p.load_inertia_kg_m2 = 2.0, p.max_torque = limit;
    p.set_bandwidth(30.0);
    drives.push_back(std::make_unique<SimplifiedDrive>(p));
  }
  for (size_t i = 0; i < 6; ++i) {
    for (const bool regularised : {false, true})
      drives.push_back(std::make_unique<DetailedDrive>(axis(i, regularised)));
  }
  return drives;
}

struct Values {
  double zdot[kMax] = {};
  double torque = 0.0;  ///< or the acceleration it prescribes
};

Values values(const Drive& drive, const JointReference& r, double q, double qd, const double* z) {
  Values v;
  drive.derivatives(r, q, qd, z, v.zdot);
  const DriveOutput output = drive.output(r, q, qd, z);
  v.torque = output.prescribes_acceleration ? output.acceleration : output.torque;
  return v;
}

// Central differences in every argument, in every mode; derivatives outside the pattern must be zero.
TEST(Drive, JacobiansEqualFiniteDifferences) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> number(-1.0, 1.0);
  int compared = 0;
  for (const auto& drive : all_drives()) {
    const int n = drive->state_count();
    const DrivePattern pattern = drive->pattern();
    for (int k = 0; k < 30; ++k) {
      const JointReference r{number(random), number(random), number(random), number(random)};
      double q = number(random), qd = number(random), z[kMax] = {};
      for (int c = 0; c < n; ++c) z[c] = number(random);
      const int real_states = drive->has_modes() ? n - 1 : n;
      if (drive->has_modes()) drive->set_mode(static_cast<FrictionMode>(k % 3 - 1), qd, z);
      DriveJacobian J;
      drive->jacobian(r, q, qd, z, J);
      const auto expect = [&](double& argument, double analytic_torque, const auto& analytic_row) {
        const double h = 1e-5, at = argument;
        argument = at + h;
        const Values plus = values(*drive, r, q, qd, z);
        argument = at - h;
        const Values minus = values(*drive, r, q, qd, z);
        argument = at;
        const auto near = [&](double analytic, double a, double b) {
          const double difference = (a - b) / (2.0 * h);
          const double scale = 1.0 + std::abs(analytic) + 1e-3 * (std::abs(a) + std::abs(b));
          ASSERT_NEAR(analytic, difference, 1e-7 * scale);
          ++compared;
        };
        near(analytic_torque, plus.torque, minus.torque);
        for (int row = 0; row < n; ++row) near(analytic_row(row), plus.zdot[row], minus.zdot[row]);
      };
      // A stuck shaft or joint has the speed zero by definition; its derivative by that speed matters only
      // for the other rows, and is compared like any other.
      expect(q, J.torque_dq, [&](int row) { return J.dz_dq[row]; });
      expect(qd, J.torque_dqd, [&](int row) { return J.dz_dqd[row]; });
      for (int c = 0; c < real_states; ++c)
        expect(z[c], J.torque_dz[c], [&](int row) { return J.dz_dz[row][c]; });
      for (int row = 0; row < n; ++row) {
        EXPECT_TRUE(pattern.dz_dq[row] || J.dz_dq[row] == 0.0);
        EXPECT_TRUE(pattern.dz_dqd[row] || J.dz_dqd[row] == 0.0);
        EXPECT_TRUE(pattern.torque_dz[row] || J.torque_dz[row] == 0.0);
        for (int c = 0; c < n; ++c) EXPECT_TRUE(pattern.dz_dz[row][c] || J.dz_dz[row][c] == 0.0);
      }
    }
  }
  EXPECT_GT(compared, 5000);
}

// At constant speed everything is in equilibrium, friction included.
TEST(Drive, InitialStatesAreEquilibria) {
  for (const auto& drive : all_drives()) {
    for (const auto& [qd, feed_forward] :
         {std::pair{0.0, 0.0}, {0.3, 0.0}, {-0.3, 0.0}, {0.0, 2.5}, {0.3, -2.5}, {-0.3, 7.5}}) {
      const JointReference r{0.4, qd, 0.0, feed_forward};
      double z[kMax] = {}, zdot[kMax] = {};
      const double tau = 4.0;
      drive->initial_state(r, tau, z);
      drive->derivatives(r, r.q, r.qd, z, zdot);
      const DriveOutput output = drive->output(r, r.q, r.qd, z);
      if (!output.prescribes_acceleration) {
        EXPECT_NEAR(output.torque, tau, 1e-9);
      }
      // The integrator keeps the remainder from the wind-up of the gear; all else is at rest.
      for (int i = 1; i < drive->state_count(); ++i) EXPECT_NEAR(zdot[i], 0.0, 1e-6) << i;
      if (!drive->has_modes()) continue;
      const int expected = qd > 0.0 ? 1 : (qd < 0.0 ? -1 : 0);
      const int shaft = static_cast<int>(std::copysign(1.0, drive->friction_speed(r.qd, z)));
      EXPECT_EQ(static_cast<int>(drive->mode(z)), expected == 0 ? 0 : shaft);
      if (expected == 0) {
        EXPECT_NEAR(drive->stuck_torque(r.q, r.qd, 0.0, z), 0.0, 1e-12);
      }
    }
  }
}

// A step of the reference on a free inertia, as designed and three times as large, against the partial
// fractions of q / q_ref = kv (kp s + kp / Ti) / (s (s^3 + kv s^2 + kv (kp + 1 / Ti) s + kv kp / Ti)).
TEST(SimplifiedDrive, TheStepResponseIsThatOfTheTransferFunction) {
  SimplifiedDriveParameters p;
  p.gear_ratio = 100.0, p.rotor_inertia_kg_m2 = 1e-4, p.load_inertia_kg_m2 = 1.0;
  p.set_bandwidth(40.0);
  const SimplifiedDrive drive(p);
  for (const double ratio : {1.0, 3.0}) {
    const double kv = p.speed_gain_per_s / ratio, kp = p.position_gain_per_s, ki = 1.0 / p.integral_time_s;
    using Complex = std::complex<double>;
    const auto polynomial = [&](Complex s) { return ((s + kv) * s + kv * (kp + ki)) * s + kv * kp * ki; };
    Complex roots[3] = {40.0, Complex(0.4, 0.9) * 40.0, Complex(-0.65, 0.72) * 40.0};
    for (int k = 0; k < 200; ++k) {  // Durand and Kerner
      for (int i = 0; i < 3; ++i)
        roots[i] -=
            polynomial(roots[i]) / ((roots[i] - roots[(i + 1) % 3]) * (roots[i] - roots[(i + 2) % 3]));
    }
    double damping = 1.0;
    for (const Complex& root : roots) damping = std::min(damping, -root.real() / std::abs(root));
    EXPECT_GT(damping, 0.57);
    const auto exact = [&](double t) {
      Complex q = 1.0;
      for (int i = 0; i < 3; ++i) {
        const Complex s = roots[i];
        q += kv * kp * (s + ki) / (s * (s - roots[(i + 1) % 3]) * (s - roots[(i + 2) % 3])) * std::exp(s * t);
      }
      return q.real();
    };
    const double inertia = ratio * p.inertia();  // armature included
    double q = 0.0, qd = 0.0, z = 0.0, highest = 0.0;
    const JointReference r{1.0, 0.0, 0.0};
    constexpr double h = 0.001;  // Heun
    for (int step = 1; step <= 1000; ++step) {
      double zd1, zd2;
      drive.derivatives(r, q, qd, &z, &zd1);
      const double a1 = drive.output(r, q, qd, &z).torque / inertia;
      const double q2 = q + h * qd, qd2 = qd + h * a1, z2 = z + h * zd1;
      drive.derivatives(r, q2, qd2, &z2, &zd2);
      const double a2 = drive.output(r, q2, qd2, &z2).torque / inertia;
      q += 0.5 * h * (qd + qd2), qd += 0.5 * h * (a1 + a2), z += 0.5 * h * (zd1 + zd2);
      ASSERT_NEAR(q, exact(step * h), 0.005) << step;
      highest = std::max(highest, q);
    }
    EXPECT_LT(highest, ratio == 1.0 ? 1.15 : 1.35);
    EXPECT_NEAR(q, 1.0, 1e-4);
  }
}

// Section "single axis example": one elastic drive on 19.5 kg m^2 without gravity, 0 to 120 degrees; beside
// it the same equations as plain scalars, both with Runge-Kutta steps of 1e-5 s.
TEST(DetailedDrive, ASingleAxisFollowsItsEquations) {
  KinematicRobotParameters k;
  k.robot = 0;
  k.arm.joints.resize(1);
  k.arm.joints[0].name = "axis";
  KinematicRobot reference(k);
  const double from[] = {0.0}, to[] = {120.0 * M_PI / 180.0};
  const MotionLimits limits[] = {{3.0, 10.0}};
  reference.set_trajectory(point_to_point(0.0, from, to, limits));
  const double corners[] = {0.3, 0.6981317, 0.9981317};
  double corner = 0.0;
  for (const double t : corners) EXPECT_NEAR(corner = reference.next_time_event(corner), t, 1e-7);

  DynamicRobotParameters p;
  p.robot = 0;
  p.arm = k.arm;
  p.links.push_back({1.0, Vec3::Zero(), 19.5 * Mat3::Identity()});
  p.gravity_W.setZero();
  std::vector<std::unique_ptr<Drive>> drives;
  drives.push_back(std::make_unique<DetailedDrive>(r3::drive_parameters(r3::kAxes[1])));
  DynamicRobot robot(p, std::move(drives), reference, {});
  RobotBench bench(robot, 0);
  for (const double x : bench.x) EXPECT_EQ(x, 0.0);

  struct S {
    double q = 0, qd = 0, x = 0, vC = 0, i = 0, psi = 0, om_s = 0;
  } s;
  int mode = 0;
  double stuck_torque = 0.0;
  const double n = 210, J = 0.0013, kt = 1.1616, w = 5500, D = 0.6, R = 250, c = 8, d = 0.01;
  const double Rv0 = 0.5, Rv1 = 0.1 / 130.0, L = 0.0378787878787878788;
  const auto f = [&](double t, const S& y) {
    double q_r = to[0], qd_r = 0.0;
    const double Ta = 0.3, Tv = to[0] / 3.0, Te = Ta + Tv;
    if (t < Ta) {
      q_r = 5.0 * t * t, qd_r = 10.0 * t;
    } else if (t < Tv) {
      q_r = 0.45 + 3.0 * (t - Ta), qd_r = 3.0;
    } else if (t < Te) {
      q_r = to[0] - 5.0 * (Te - t) * (Te - t), qd_r = 10.0 * (Te - t);
    }
    const double om = mode == 0 ? 0.0 : n * y.qd - y.om_s;
    const double u = n * qd_r + 5.0 * (n * q_r - (n * y.q - y.psi)) - om;
    const double i_ref = 0.5 * (y.x + u);
    const double spring = c * y.psi + d * (n * y.qd - om);
    stuck_torque = kt * y.i + spring;
    const double om_dot = mode == 0 ? 0.0 : (stuck_torque - mode * Rv0 - Rv1 * om) / J;
    S dy;
    dy.q = y.qd;
    dy.qd = -n * spring / 19.5;
    dy.x = u / 0.05;
    dy.vC = (y.i - i_ref) * w / (0.04 * D);
    dy.i = (-5.0 * y.vC - R * y.i - kt * om) / L;
    dy.psi = n * y.qd - om;
    dy.om_s = n * dy.qd - om_dot;
    return dy;
  };
  const auto plus = [](const S& a, double h, const S& b) {
    return S{a.q + h * b.q, a.qd + h * b.qd,   a.x + h * b.x,      a.vC + h * b.vC,
             a.i + h * b.i, a.psi + h * b.psi, a.om_s + h * b.om_s};
  };
  constexpr double h = 1e-5;
  int switches = 0, present = 0;
  double worst = 0.0;
  for (int step = 0; step < 149813; ++step) {
    const double t = bench.t;
    const S k1 = f(t, s), k2 = f(t + 0.5 * h, plus(s, 0.5 * h, k1)),
            k3 = f(t + 0.5 * h, plus(s, 0.5 * h, k2)), k4 = f(t + h, plus(s, h, k3));
    s = plus(plus(plus(plus(s, h / 6.0, k1), h / 3.0, k2), h / 3.0, k3), h / 6.0, k4);
    if (mode != 0 && mode * (n * s.qd - s.om_s) <= 0.0) mode = 0, s.om_s = n * s.qd;
    f(t + h, s);
    if (mode == 0 && std::abs(stuck_torque) > Rv0) mode = stuck_torque > 0.0 ? 1 : -1;
    bench.rk4(h);
    const double* z = bench.x.data() + robot.drive_state(0);
    ASSERT_EQ(static_cast<int>(robot.drive(0).mode(z)), mode) << "at " << bench.t;
    ASSERT_NEAR(bench.x[0], s.q, 1e-9) << "at " << bench.t;
    ASSERT_NEAR(z[DetailedDrive::current], s.i, 1e-6) << "at " << bench.t;
    ASSERT_NEAR(z[DetailedDrive::deflection], s.psi, 1e-8) << "at " << bench.t;
    if (mode != present) ++switches, present = mode;
    worst = std::max(worst, std::abs(bench.x[0] - to[0]));
  }
  EXPECT_GT(switches, 1);  // it broke away and stuck again
  EXPECT_NEAR(bench.x[0], to[0], 0.005);
}

TEST(DetailedDrive, RegularisedFrictionStaysNearTrueFriction) {
  double end[2] = {};
  for (const bool regularised : {false, true}) {
    KinematicRobotParameters k;
    k.robot = 0;
    k.arm.joints.resize(1);
    KinematicRobot reference(k);
    const double from[] = {0.0}, to[] = {1.0};
    const MotionLimits limits[] = {{3.0, 10.0}};
    reference.set_trajectory(point_to_point(0.0, from, to, limits));
    DynamicRobotParameters p;
    p.robot = 0;
    p.arm = k.arm;
    p.links.push_back({1.0, Vec3::Zero(), 5.0 * Mat3::Identity()});
    std::vector<std::unique_ptr<Drive>> drives;
    DetailedDriveParameters d = axis(3, regularised);
    d.friction.regularisation_speed_rad_per_s = 1e-3;
    drives.push_back(std::make_unique<DetailedDrive>(d));
    EXPECT_EQ(drives[0]->has_modes(), !regularised);
    DynamicRobot robot(p, std::move(drives), reference, {});
    EXPECT_EQ(robot.indicator_count(), regularised ? 0 : 1);
    RobotBench bench(robot, 0);
    while (bench.t < 0.4) bench.rk4(2e-5);
    end[regularised ? 1 : 0] = bench.x[0];
  }
  EXPECT_NEAR(end[0], end[1], 5e-4);
  EXPECT_NE(end[0], end[1]);
}

TEST(Drive, InvalidParametersAreRefusedByName) {
  const auto refused = [](const auto& make, const char* text) {
    try {
      make();
      ADD_FAILURE() << "no error, expected " << text;
    } catch (const std::invalid_argument& e) {
      EXPECT_NE(std::string(e.what()).find(text), std::string::npos) << e.what();
    }
  };
  refused([] { IdealServo({-1.0}); }, "frequency");
  refused([] { IdealServo({100.0, 0.0}); }, "largest torque");
  refused([] { SimplifiedDrive(SimplifiedDriveParameters{}); }, "inertia");
  DetailedDriveParameters p = axis(1, false);
  p.gear_ratio = 0.0;
  refused([&] { DetailedDrive{p}; }, "gear ratio");
  p = axis(1, false);
  p.gear_stiffness_N_m_per_rad = 0.0;
  refused([&] { DetailedDrive{p}; }, "stiffness");
  p = axis(1, false);
  p.friction.break_away = 0.5;
  refused([&] { DetailedDrive{p}; }, "break-away");
}

TEST(RobotPower, PowerFollowsTheThesis) {
  RobotPowerParameters p;
  p.loss_factor = 1.3;
  EXPECT_DOUBLE_EQ(electrical_power_of_axis(p, 100.0), 130.0);
  EXPECT_EQ(electrical_power_of_axis(p, -100.0), 0.0);
  EXPECT_EQ(electrical_power_of_motor(p, -5.0), 0.0);
  p.recovers = true;
  EXPECT_DOUBLE_EQ(electrical_power_of_axis(p, -130.0), -100.0);
  EXPECT_EQ(electrical_power_of_motor(p, -5.0), -5.0);
}

}  // namespace
}  // namespace takt

// Force mode of the controller that takt-ur shows, against closed forms and a spring.
#include <gtest/gtest.h>

#include <cmath>
#include <deque>
#include <numbers>

#include "client_lib/gateway/ur/force_mode.h"

namespace {

using takt::Pose;
using takt::Vec3;
using takt::Wrench;
using takt::ur::ForceMode;
using takt::ur::ForceModeOptions;

constexpr double kCycle_s = 0.002;

ForceModeOptions pressing_down(double force_N) {
  ForceModeOptions options;
  options.compliant = {false, false, true, false, false, false};
  options.wrench = {0, 0, -force_N, 0, 0, 0};
  options.speed_limit.fill(0.1);
  return options;
}

Pose tool_at(const Vec3& p) {
  Pose X;
  X.p = p;
  return X;
}

TEST(UrForceMode, AFreeToolReachesTheSpeedOfTheDamping) {
  // v[n] = v_end (1 - (1 - d)^n), v_end = F dt / (m d): the sum of the recurrence.
  ForceModeOptions options = pressing_down(2.0);
  options.damping = 0.1;
  const Pose X = tool_at({0.4, 0.1, 0.3});
  ForceMode mode(options, X);
  const double v_end = 2.0 * kCycle_s / (4.0 * ForceMode::kMass_kg * options.damping);
  for (int n = 1; n <= 100; ++n) {
    mode.advance(X, {}, kCycle_s);
    EXPECT_NEAR(mode.speed()[2], -v_end * (1.0 - std::pow(1.0 - options.damping, n)), 1e-15) << n;
  }
}

TEST(UrForceMode, TheSpeedLimitOfACompliantAxisHolds) {
  ForceModeOptions options = pressing_down(1000.0);
  options.speed_limit[2] = 0.03;
  const Pose X = tool_at({0.4, 0.1, 0.3});
  ForceMode mode(options, X);
  for (int n = 0; n < 1000; ++n) mode.advance(X, {}, kCycle_s);
  EXPECT_NEAR(mode.commanded().p.z(), 0.3 - 0.03 * 2.0, 0.03 * 0.2);
  EXPECT_EQ(mode.speed()[2], -0.03);
}

TEST(UrForceMode, AgainstASpringTheForceIsTheWantedOne) {
  // Measurements are 10 ms old. A wall of stiffness k at 0.29.
  for (const double k : {1e3, 1e4, 1e5, 2e5}) {
    const Pose X = tool_at({0.4, 0.1, 0.3});
    ForceMode mode(pressing_down(20.0), X);
    std::deque<double> forces(5, 0.0);
    double largest = 0.0;
    for (int n = 0; n < 20000; ++n) {
      const double force = k * std::max(0.0, 0.29 - mode.commanded().p.z());
      forces.push_back(force);
      mode.advance(X, {Vec3(0, 0, forces.front()), Vec3::Zero()}, kCycle_s);
      forces.pop_front();
      largest = std::max(largest, force);
    }
    EXPECT_NEAR(forces.back(), 20.0, 0.2) << k;
    EXPECT_LT(largest, 20.0 + 0.1 * 0.016 * k + 1.0) << k;  // the speed limit times all delays
  }
}

TEST(UrForceMode, OtherAxesFollowTheProgramExactly) {
  ForceModeOptions options = pressing_down(5.0);
  const Pose start = tool_at({0.4, 0.1, 0.3});
  ForceMode mode(options, start);
  Pose program = start;
  for (int n = 1; n <= 500; ++n) {
    program.p = start.p + Vec3(1e-4 * n, -5e-5 * n, 2e-4 * n);
    program.R = Eigen::AngleAxisd(1e-3 * n, Vec3::UnitY()).toRotationMatrix();
    mode.advance(program, {Vec3(0, 0, 5.0), Vec3::Zero()}, kCycle_s);
  }
  EXPECT_NEAR(mode.commanded().p.x(), program.p.x(), 1e-12);
  EXPECT_NEAR(mode.commanded().p.y(), program.p.y(), 1e-12);
  EXPECT_NEAR((mode.commanded().R - program.R).norm(), 0.0, 1e-9);
  EXPECT_NEAR(mode.commanded().p.z(), 0.3,
              1e-12);  // the force is the wanted one: along z the program has no say
}

TEST(UrForceMode, ATorqueTurnsTheTool) {
  ForceModeOptions options;
  options.compliant[5] = true;
  options.speed_limit.fill(0.5);
  options.damping = 1.0;  // without memory: w = T dt / (I + c dt)
  const Pose X = tool_at({0.4, 0.1, 0.3});
  ForceMode mode(options, X);
  for (int n = 0; n < 100; ++n) mode.advance(X, {Vec3::Zero(), Vec3(0, 0, 2.0)}, kCycle_s);
  const double rate =
      2.0 * kCycle_s / (ForceMode::kInertia_kg_m2 + ForceMode::kContactDamping_N_m_s * kCycle_s);
  EXPECT_NEAR(takt::rotation_vector(mode.commanded().R).z(), 100 * kCycle_s * rate, 1e-9);
  EXPECT_NEAR((mode.commanded().p - X.p).norm(), 0.0, 1e-15);
}

TEST(UrForceMode, AxesOfTheTypes) {
  // Type 1: y points from the TCP to the frame's origin. Type 3: x is along the velocity in the frame's plane.
  ForceModeOptions options;
  options.speed_limit.fill(0.5);
  options.damping = 1.0;
  options.X_RK.p = Vec3(0.4, 1.1, 0.3);
  options.type = ForceModeOptions::Type::toward_frame;
  options.compliant[1] = true;
  options.wrench[1] = 1.0;
  const Pose X = tool_at({-0.6, 0.1, 0.3});
  ForceMode toward(options, X);
  for (int n = 0; n < 50; ++n) toward.advance(X, {}, kCycle_s);
  const Vec3 way = toward.commanded().p - X.p;
  EXPECT_NEAR(way.normalized().dot(Vec3(1, 1, 0).normalized()), 1.0, 1e-12);

  options.type = ForceModeOptions::Type::along_velocity;
  options.compliant = {false, true, false, false, false, false};  // beside the way
  ForceMode along(options, X);
  Pose program = X;
  for (int n = 0; n < 50; ++n) {
    program.p += Vec3(1e-4, 1e-4, 1e-4);
    along.advance(program, {}, kCycle_s);
  }
  const Vec3 beside = along.commanded().p - program.p;
  EXPECT_GT(beside.norm(), 1e-6);
  EXPECT_NEAR(beside.normalized().dot(Vec3(-1, 1, 0).normalized()), 1.0, 1e-9);
}

TEST(UrForceMode, InvalidOptionsAreRefusedWithTheirName) {
  ForceModeOptions options = pressing_down(1.0);
  EXPECT_EQ(problem_of(options), "");
  options.speed_limit[2] = 0.0;
  EXPECT_NE(problem_of(options).find("limits"), std::string::npos);
  options = pressing_down(1.0);
  options.type = takt::ur::force_mode_type(4.0);
  EXPECT_NE(problem_of(options).find("type"), std::string::npos);
  options = pressing_down(1.0);
  options.damping = 1.5;
  EXPECT_NE(problem_of(options).find("damping"), std::string::npos);
  options = pressing_down(1.0);
  options.gain = std::nan("");
  EXPECT_NE(problem_of(options).find("gain"), std::string::npos);
}

}  // namespace

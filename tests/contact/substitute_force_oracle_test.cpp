// The substitute force against closed forms: spring constants (5.8), (5.10); sag and stiffness (3.19) to
// (3.31); load and moment on the partner; critical damping.
#include <gtest/gtest.h>

#include <cmath>

#include "server/simulation/step/simulation.h"
#include "tests/support/box_cell.h"
#include "tests/support/constants.h"

namespace takt::test {
namespace {

void run_steps(Simulation& simulation, int steps) {
  for (int i = 0; i < steps; ++i) ASSERT_TRUE(simulation.step({})) << simulation.fault();
}

TEST(SubstituteParameters, SpringConstantsAreThoseOfTheThesis) {
  const double k = translational_stiffness(0.3, kGravity_m_s2, 0.0001);
  EXPECT_NEAR(k, 29419.95, 1e-6);                                 // (5.8)
  EXPECT_NEAR(translational_damping(0.3, k, 1.0), 187.89, 0.01);  // (5.10)
  EXPECT_NEAR(translational_stiffness(1.0, kGravity_m_s2, 0.0001), 98066.5, 1e-6);
}

TEST(SubstituteParameters, RotationHasTheSamePolesInEveryAxis) {
  const Mat3 I = box_inertia(0.8, {0.08, 0.05, 0.2});
  const SubstituteParameters p = substitute_parameters(0.8, I, kGravity_m_s2, 1e-4, 1.0);
  const double omega_squared = p.k_tr_N_per_m / 0.8;
  EXPECT_TRUE(p.K_rot_B.isApprox(I * omega_squared, 1e-14));
  EXPECT_TRUE(p.D_rot_B.isApprox(I * 2.0 * std::sqrt(omega_squared), 1e-14));
}

TEST(SubstituteForce, TheLawOfTheThesisSagsByWeightOverStiffness) {  // (3.19) to (3.21)
  BoxCell cell;
  cell.feed_forward(false).ground("T", {1, 1, 0.1}, at(0, 0, -0.1));
  const int part = cell.part("B", 1.0, 4, {0.2, 0.1, 0.06}, at(0, 0, 0));
  Simulation simulation(cell.build());
  run_steps(simulation, 1000);
  EXPECT_NEAR(simulation.make_snapshot().components[static_cast<size_t>(part)].p_WB.z(), -0.0001, 1e-10);
}

TEST(SubstituteForce, FeedForwardDoesNotSagAtAll) {
  BoxCell cell;
  cell.ground("T", {1, 1, 0.1}, at(0, 0, -0.1));
  const int part = cell.part("B", 1.0, 4, {0.2, 0.1, 0.06}, at(0, 0, 0));
  Simulation simulation(cell.build());
  run_steps(simulation, 1000);
  EXPECT_LT(std::abs(simulation.make_snapshot().components[static_cast<size_t>(part)].p_WB.z()), 1e-15);
}

TEST(SubstituteForce, SingleConnectionsDoNotAddUp) {  // (3.30), (3.31): C on B on T, both held by T itself
  BoxCell cell;
  const int table = cell.ground("T", {1, 1, 0.1}, at(0, 0, -0.1));
  cell.feed_forward(false);
  const int b = cell.part("B", 1.0, 4, {0.2, 0.1, 0.06}, at(0, 0, 0));
  const int c = cell.part("C", 0.5, 3, {0.06, 0.08, 0.08}, at(0, 0, 0.06));
  Simulation simulation(cell.build());
  run_steps(simulation, 1000);
  const Snapshot snapshot = simulation.make_snapshot();
  EXPECT_EQ(snapshot.components[static_cast<size_t>(b)].partner, table);
  EXPECT_EQ(snapshot.components[static_cast<size_t>(c)].partner, table);
  EXPECT_NEAR(snapshot.components[static_cast<size_t>(b)].p_WB.z(), -0.0001, 1e-10);
  EXPECT_NEAR(snapshot.components[static_cast<size_t>(c)].p_WB.z(), 0.06 - 0.0001, 1e-10);
  // The table carries both weights.
  EXPECT_NEAR(snapshot.components[static_cast<size_t>(table)].F_Bo_W.f.z(), -1.5 * kGravity_m_s2, 1e-6);
}

TEST(SubstituteForce, SagOfAChainAddsUpAndParallelConnectionsAddTheirStiffness) {  // (3.22) to (3.25), (3.29)
  // Chains do not arise under partner search; the law itself must still give the series and parallel results.
  BoxCell cell;
  const int table = cell.ground("T", {1, 1, 0.1}, at(0, 0, -0.1));
  const int b = cell.part("B", 1.0, 4, {0.2, 0.1, 0.06}, at(0, 0, 0));
  const int c = cell.part("C", 0.5, 3, {0.06, 0.08, 0.08}, at(0, 0, 0.06));
  const auto model = cell.build();
  CellMotion motion;
  motion.bodies.resize(model->components.size());
  const auto place = [&](int body, double z) {
    BodyMotion& m = motion.bodies[static_cast<size_t>(body)];
    m.X_WB = at(0, 0, z);
    m.p_WBcm = m.X_WB * model->components[static_cast<size_t>(body)].p_BBcm;
  };
  place(table, -0.1), place(b, 0.0), place(c, 0.06);
  Connection b_on_t, c_on_b;
  b_on_t.gains = model->components[static_cast<size_t>(b)].substitute;
  c_on_b.gains = model->components[static_cast<size_t>(c)].substitute;
  const auto body = [&](int id) -> const BodyMotion& { return motion.bodies[static_cast<size_t>(id)]; };
  capture_offset(body(b), body(table), b_on_t);
  capture_offset(body(c), body(b), c_on_b);
  const double sag_b = 1.5 * kGravity_m_s2 / b_on_t.gains.k_tr_N_per_m;          // (3.24)
  const double sag_c = sag_b + 0.5 * kGravity_m_s2 / c_on_b.gains.k_tr_N_per_m;  // (3.25)
  place(b, -sag_b), place(c, 0.06 - sag_c);
  const Wrench on_c = substitute_wrench(c_on_b, body(c), body(b));
  const Wrench on_b = substitute_wrench(b_on_t, body(b), body(table));
  const Wrench back_on_b = reaction_on_target(on_c, body(c), body(b));
  EXPECT_NEAR(on_c.f.z(), 0.5 * kGravity_m_s2, 1e-9);
  EXPECT_NEAR(on_b.f.z() + back_on_b.f.z(), 1.0 * kGravity_m_s2, 1e-9);

  // Two connections of the same Part in parallel: twice the force at the same deflection (3.29).
  Connection second = c_on_b;
  place(c, 0.06 - sag_c);
  const Wrench sum_a = substitute_wrench(c_on_b, body(c), body(b));
  Wrench sum = sum_a;
  sum += substitute_wrench(second, body(c), body(b));
  EXPECT_NEAR(sum.f.z(), 2.0 * sum_a.f.z(), 1e-12);
}

TEST(SubstituteForce, ADisplacedPartReturnsCriticallyDamped) {  // (A.9) with D = 1: x (1 + w t) exp(-w t)
  BoxCell cell;
  cell.step(1e-4).ground("T", {1, 1, 0.1}, at(0, 0, -0.1));
  const int part = cell.part("B", 1.0, 4, {0.2, 0.1, 0.06}, at(0, 0, 0));
  const auto model = cell.build();
  CellMotion motion;
  motion.bodies.resize(2);
  motion.bodies[0].X_WB = at(0, 0, -0.1);
  motion.bodies[0].p_WBcm = motion.bodies[0].X_WB.p;
  const RigidBody body(model->parts.front());
  std::vector<double> x(13), xdot(13);
  body.initial_state(x.data());
  body.write_motion(0, x.data(), motion);
  Connection connection;
  connection.gains = model->components[static_cast<size_t>(part)].substitute;
  connection.feed_forward_W = Vec3(0, 0, kGravity_m_s2);
  capture_offset(motion.bodies[static_cast<size_t>(part)], motion.bodies[0], connection);
  const double z0 = x[2];
  x[2] += 1e-3;
  const double w = std::sqrt(kGravity_m_s2 / 1e-4);
  std::vector<Wrench> wrenches(2);
  const double h = 1e-6;
  for (int i = 0; i < 10000; ++i) {
    body.write_motion(0, x.data(), motion);
    wrenches[1] = substitute_wrench(connection, motion.bodies[1], motion.bodies[0]);
    body.derivatives(0, x.data(), motion, wrenches, xdot.data());
    // Semi-implicit Euler at a tiny step: independent of the solver under test.
    for (int j = 7; j < 13; ++j) x[static_cast<size_t>(j)] += h * xdot[static_cast<size_t>(j)];
    for (int j = 0; j < 3; ++j) x[static_cast<size_t>(j)] += h * x[static_cast<size_t>(j + 7)];
    const double t = (i + 1) * h;
    ASSERT_NEAR(x[2] - z0, 1e-3 * (1.0 + w * t) * std::exp(-w * t), 2e-6) << "t = " << t;
  }
}

TEST(SubstituteForce, AGripperCarriesWeightAndMomentOfItsLoad) {
  BoxCell cell;
  const int palm = cell.gantry_with_gripper("R", "G", at(0, 0, 0.5));
  // The Part hangs off centre by 10 mm in x.
  const int part = cell.part("C", 0.5, 3, {0.06, 0.08, 0.08}, at(0.01, 0, 0.40));
  Simulation simulation(cell.build());
  const Command close = GripperCommand{0, {}, GripperAction::close, 0.0, 0.0};
  ASSERT_TRUE(simulation.step({&close, 1}));
  run_steps(simulation, 500);
  const Snapshot snapshot = simulation.make_snapshot();
  EXPECT_EQ(snapshot.components[static_cast<size_t>(part)].partner, palm);
  const Wrench& F = snapshot.components[static_cast<size_t>(palm)].F_Bo_W;
  EXPECT_NEAR(F.f.z(), -0.5 * kGravity_m_s2, 1e-9);
  EXPECT_NEAR(F.t.y(), 0.01 * 0.5 * kGravity_m_s2, 1e-9);  // r x f = (0.01, 0, z) x (0, 0, -m g)
  EXPECT_NEAR(F.t.x(), 0.0, 1e-9);
}

TEST(SubstituteForce, FeedForwardCarriesTheWeightInAnyOrientationWithoutSagOrJump) {
  // A Part is held by a gripper that turns it upside down; its place in the gripper does not change.
  BoxCell cell;
  const int palm = cell.gantry_with_gripper("R", "G", at(0, 0, 0.5));
  const int part = cell.part("C", 0.5, 3, {0.06, 0.08, 0.08}, at(0.0, 0, 0.40));
  Simulation simulation(cell.build());
  const Command close = GripperCommand{0, {}, GripperAction::close, 0.0, 0.0};
  ASSERT_TRUE(simulation.step({&close, 1}));
  const auto relative = [&] {
    const Snapshot s = simulation.make_snapshot();
    const Pose X_WG = Pose::from_quaternion(s.components[static_cast<size_t>(palm)].p_WB,
                                            s.components[static_cast<size_t>(palm)].q_WB);
    return Vec3(X_WG.inverse() * s.components[static_cast<size_t>(part)].p_WB);
  };
  const Vec3 before = relative();
  JointCommand turn;
  turn.robot = 0;
  turn.period_s = 3.0;
  turn.position = {0, 0, 0, 3.0, 0, 0};
  const Command command = turn;
  ASSERT_TRUE(simulation.step({&command, 1}));
  run_steps(simulation, 4000);
  EXPECT_LT((relative() - before).norm(), 1e-9);
}

}  // namespace
}  // namespace takt::test

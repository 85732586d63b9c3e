// The simulation as a whole against closed forms: free fall, order of the solver, largest stable step,
// falling assemblies, energy, grasp rules, equal bits.
#include "server/simulation/step/simulation.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "plant_models/mechanics/rigid_body.h"
#include "server/simulation/solver/explicit_integrators.h"
#include "tests/support/box_cell.h"
#include "tests/support/constants.h"

namespace takt::test {
namespace {

const ComponentSample& sample_of(const Snapshot& snapshot, int id) {
  return snapshot.components[static_cast<size_t>(id)];
}

TEST(Simulation, FreeFallIsExact) {
  BoxCell cell;
  const int part = cell.part("P", 0.3, 2, {0.03, 0.03, 0.08}, at(0.1, 0.2, 5.0));
  Simulation simulation(cell.build());
  for (int i = 0; i < 500; ++i) ASSERT_TRUE(simulation.step({}));
  const Snapshot s = simulation.make_snapshot();
  EXPECT_EQ(sample_of(s, part).partner, -1);
  EXPECT_EQ(sample_of(s, part).state, PartState::free);
  EXPECT_NEAR(sample_of(s, part).p_WB.z(), 5.0 - 0.5 * kGravity_m_s2 * 0.25,
              1e-12);  // a parabola is exact at order two
  EXPECT_NEAR(sample_of(s, part).V_WB.v.z(), -kGravity_m_s2 * 0.5, 1e-12);
  EXPECT_EQ(sample_of(s, part).p_WB.x(), 0.1);
}

TEST(Simulation, AReleasedAssemblyFallsAsOneWithoutGainingEnergy) {
  BoxCell cell;
  const int b = cell.part("B", 1.0, 4, {0.2, 0.1, 0.06}, at(0, 0, 3.0));
  const int p = cell.part("P", 0.3, 2, {0.03, 0.03, 0.08}, at(0.05, 0.01, 3.06));
  const int c = cell.part("C", 5.0, 3, {0.06, 0.08, 0.08}, at(-0.06, 0, 3.06));
  Simulation simulation(cell.build());
  for (int i = 0; i < 500; ++i) ASSERT_TRUE(simulation.step({}));
  const Snapshot s = simulation.make_snapshot();
  EXPECT_EQ(sample_of(s, b).partner, -1);
  EXPECT_EQ(sample_of(s, p).partner, b);
  EXPECT_EQ(sample_of(s, c).partner, b);
  const double fall = 0.5 * kGravity_m_s2 * 0.25;
  EXPECT_NEAR(sample_of(s, b).p_WB.z(), 3.0 - fall, 1e-9);
  EXPECT_NEAR(sample_of(s, p).p_WB.z(), 3.06 - fall, 1e-9);
  EXPECT_NEAR(sample_of(s, c).p_WB.z(), 3.06 - fall, 1e-9);
}

TEST(Simulation, ManyPartsOnALightBaseFallAsOne) {
  // A light plate with sixteen heavy cubes on it, let go in the air: every connection acts on the plate, and
  // together they must not carry it past the largest stable step.
  BoxCell cell;
  const int plate = cell.part("plate", 0.02, 4, {0.12, 0.12, 0.005}, at(0, 0, 3.0));
  std::vector<int> cubes;
  for (int i = 0; i < 16; ++i) {
    cubes.push_back(cell.part("P" + std::to_string(i), 0.1, 3, {0.02, 0.02, 0.02},
                              at(-0.045 + 0.03 * (i % 4), -0.045 + 0.03 * (i / 4), 3.005)));
  }
  Simulation simulation(cell.build());
  for (int i = 0; i < 500; ++i) ASSERT_TRUE(simulation.step({})) << simulation.fault();
  const Snapshot s = simulation.make_snapshot();
  const double fall = 0.5 * kGravity_m_s2 * 0.25;
  EXPECT_NEAR(sample_of(s, plate).p_WB.z(), 3.0 - fall, 1e-9);
  EXPECT_LE(sample_of(s, plate).V_WB.w.norm(), 1e-9);
  for (const int cube : cubes) {
    EXPECT_EQ(sample_of(s, cube).partner, plate);
    EXPECT_NEAR(sample_of(s, cube).p_WB.z(), 3.005 - fall, 1e-9);
  }
}

TEST(Simulation, AFreeAssemblySpinsWithConstantMomentum) {
  // No gravity, no partner outside: the pair forces must not create linear or angular momentum.
  BoxCell cell;
  cell.gravity(Vec3::Zero());
  cell.part("B", 1.0, 4, {0.2, 0.1, 0.06}, at(0, 0, 0));
  cell.part("P", 0.3, 2, {0.03, 0.03, 0.08}, at(0.05, 0.01, 0.06));
  const auto model = cell.build();
  ComponentInteraction interaction(model->components, model->pairs, model->interaction);
  RigidBody b(model->parts[0]), p(model->parts[1]);
  OdeSystem system({&b, &p}, interaction, 2, 0);
  std::vector<double> x(26);
  system.initial_state(x);
  // A common spin about z and a drift, set up by hand: v = w x r about the centre of B.
  const Vec3 w(0.3, -0.2, 1.0), drift(0.1, 0.0, 0.05);
  const auto momentum = [&](Vec3& linear, Vec3& angular) {
    linear.setZero(), angular.setZero();
    for (int i = 0; i < 2; ++i) {
      const double* s = x.data() + 13 * i;
      const RigidBodyParameters& body = model->parts[static_cast<size_t>(i)];
      const Vec3 r(s[0], s[1], s[2]), v(s[7], s[8], s[9]), omega(s[10], s[11], s[12]);
      const Mat3 R = Quat(s[3], s[4], s[5], s[6]).normalized().toRotationMatrix();
      linear += body.mass_kg * v;
      angular += r.cross(body.mass_kg * v) + R * body.I_BBcm_B * R.transpose() * omega;
    }
  };
  for (int i = 0; i < 2; ++i) {
    double* s = x.data() + 13 * i;
    const Vec3 v = w.cross(Vec3(s[0], s[1], s[2])) + drift;
    for (int k = 0; k < 3; ++k) s[7 + k] = v[k], s[10 + k] = w[k];
  }
  Vec3 p0, l0, p1, l1;
  momentum(p0, l0);
  system.update_motion(0.0, x);
  interaction.update_poses(system.motion(), nullptr);
  interaction.update_connections(system.motion(), {}, nullptr);
  ASSERT_EQ(interaction.partner(1), 0);
  Rk2Integrator solver(26);
  for (int i = 0; i < 20000; ++i) {
    system.update_motion(1e-4 * i, x);
    solver.advance(system, 1e-4 * i, 1e-4, x);
  }
  momentum(p1, l1);
  EXPECT_LE((p1 - p0).norm(), 1e-12);
  EXPECT_LE((l1 - l0).norm(), 1e-6 * l0.norm());  // the solver's error
}

TEST(Simulation, TheSolverConvergesWithOrderTwo) {
  // A Part thrown out of its rest by a moving gripper: error against a fine solution falls by four per
  // halving.
  const auto end_position = [](double h) {
    BoxCell cell;
    cell.step(h);
    const int palm = cell.gantry_with_gripper("R", "G", at(0, 0, 0.5));
    static_cast<void>(palm);
    const int part = cell.part("C", 0.5, 3, {0.06, 0.08, 0.08}, at(0.0, 0, 0.40));
    Simulation simulation(cell.build());
    const Command close = GripperCommand{0, {}, GripperAction::close, 0.0, 0.0};
    JointCommand move;
    move.robot = 0;
    move.period_s = 0.064;
    move.position = {0.01, 0.005, 0.0, 0.1, 0.0, 0.0};
    const Command commands[] = {close, move};
    EXPECT_TRUE(simulation.step(commands));
    while (simulation.time_s() < 0.064 - 1e-9) EXPECT_TRUE(simulation.step({}));
    return Vec3(sample_of(simulation.make_snapshot(), part).p_WB);
  };
  const Vec3 reference = end_position(0.064 / 4096);
  const double coarse = (end_position(0.064 / 128) - reference).norm();
  const double fine = (end_position(0.064 / 256) - reference).norm();
  EXPECT_GT(coarse, 1e-10);
  EXPECT_NEAR(std::log2(coarse / fine), 2.0, 0.2);
}

TEST(Simulation, TheLargestStableStepIsTheClosedForm) {
  // Double real pole at -w, w = sqrt(g / error): Runge-Kutta of order two is stable up to h = 2 / w = 6.39
  // ms.
  const double limit = 2.0 / std::sqrt(kGravity_m_s2 / 1e-4);
  const auto settles = [](double h) {
    BoxCell cell;
    cell.step(h).feed_forward(false).ground("T", {1, 1, 0.1}, at(0, 0, -0.1));
    const int part = cell.part("B", 1.0, 4, {0.2, 0.1, 0.06}, at(0, 0, 0));
    Simulation simulation(cell.build());
    for (int i = 0; i < 4000; ++i) {
      if (!simulation.step({})) return false;
    }
    return std::abs(sample_of(simulation.make_snapshot(), part).p_WB.z() + 1e-4) < 1e-6;
  };
  EXPECT_TRUE(settles(0.97 * limit));
  EXPECT_FALSE(settles(1.03 * limit));
}

TEST(Simulation, ANonFiniteStateIsNeverAccepted) {
  BoxCell cell;
  cell.step(0.5).ground("T", {1, 1, 0.1}, at(0, 0, -0.1));  // far beyond the stable step
  const int part = cell.part("B", 1.0, 4, {0.2, 0.1, 0.06}, at(0, 0, 0));
  cell.part("Q", 1.0, 3, {0.2, 0.1, 0.06}, at(0, 0, 0.0601));
  cell.feed_forward(false);
  Simulation simulation(cell.build());
  bool running = true;
  for (int i = 0; i < 5000 && running; ++i) running = simulation.step({});
  const Snapshot s = simulation.make_snapshot();
  EXPECT_TRUE(sample_of(s, part).p_WB.allFinite());
  if (!running) {
    EXPECT_THAT(simulation.fault(),
                testing::AnyOf(testing::HasSubstr("non-finite"), testing::HasSubstr("gains energy")));
    const std::uint64_t hash = simulation.state_hash();
    EXPECT_FALSE(simulation.step({}));
    EXPECT_EQ(simulation.state_hash(), hash);
    simulation.reset();
    EXPECT_TRUE(simulation.fault().empty());
    EXPECT_TRUE(simulation.step({}));
  }
}

TEST(Simulation, ANonFiniteSetPointEndsInAFault) {
  BoxCell cell;
  cell.gantry_with_gripper("R", "G", at(0, 0, 0.5));
  Simulation simulation(cell.build());
  JointCommand bad;  // made by hand: validate() would refuse it
  bad.robot = 0;
  bad.position[1] = std::nan("");
  const Command command = bad;
  EXPECT_FALSE(simulation.step({&command, 1}));
  EXPECT_NE(simulation.fault().find("joint 'R_2' of R"), std::string::npos) << simulation.fault();
  EXPECT_EQ(simulation.step_index(), 0U);
  for (const RobotSample& robot : simulation.make_snapshot().robots) EXPECT_EQ(robot.position[1], 0.0);
  simulation.reset();
  EXPECT_TRUE(simulation.step({}));
  for (const ComponentSample& component : simulation.make_snapshot().components) {
    EXPECT_TRUE(component.p_WB.allFinite());
  }
}

TEST(Simulation, TheSameCommandsGiveTheSameBitsAndAResetRepeatsThem) {
  BoxCell cell;
  cell.gantry_with_gripper("R", "G", at(0, 0, 0.5));
  cell.ground("T", {1, 1, 0.1}, at(0, 0, 0.3));
  cell.part("C", 0.5, 3, {0.06, 0.08, 0.08}, at(0.0, 0, 0.40));
  const auto model = cell.build();
  const auto run = [](Simulation& simulation) {
    const Command close = GripperCommand{0, {}, GripperAction::close, 0.0, 0.0};
    JointCommand move;
    move.robot = 0;
    move.position = {0.1, 0.05, 0.1, 0.1, 0.2, 0.3};
    const Command commands[] = {close, move};
    simulation.step(commands);
    for (int i = 0; i < 300; ++i) simulation.step({});
    return simulation.state_hash();
  };
  Simulation first(model), second(model);
  const std::uint64_t hash = run(first);
  EXPECT_EQ(run(second), hash);
  first.reset();
  EXPECT_EQ(first.epoch(), 1U);
  EXPECT_EQ(run(first), hash);
  // Reading snapshots in between has no effect.
  second.reset();
  Snapshot s = second.make_snapshot();
  second.read_snapshot(s);
  EXPECT_EQ(run(second), hash);
}

TEST(Grasping, JawsStopWhereTheyTouchAndOnContactNeedsBoth) {
  BoxCell cell;
  const int palm = cell.gantry_with_gripper("R", "G", at(0, 0, 0.5), GraspRule::on_contact);
  const int table = cell.ground("T", {1, 1, 0.1}, at(0, 0, 0.3));
  // 80 mm wide, 10 mm off centre: faces at y = -0.03 and +0.05.
  const int part = cell.part("C", 0.5, 3, {0.06, 0.08, 0.08}, at(0.0, 0.01, 0.40));
  Simulation simulation(cell.build());
  const Command close = GripperCommand{0, {}, GripperAction::close, 0.0, 0.0};
  ASSERT_TRUE(simulation.step({&close, 1}));
  // The left jaw reaches +0.05 after 0.05 / 0.1 = 0.5 s, the right one -0.03 after 0.7 s.
  double held_since = -1.0;
  while (simulation.time_s() < 1.0) {
    ASSERT_TRUE(simulation.step({}));
    for (const ConnectionChange& change : simulation.events().connection_changes) {
      if (change.to == palm) held_since = change.time_s;
    }
    const double t = simulation.time_s();
    if (t > 0.1 && t < 0.69) {
      EXPECT_EQ(sample_of(simulation.make_snapshot(), part).partner, table) << t;
    }
  }
  EXPECT_NEAR(held_since, 0.7, 0.002);
  const Snapshot s = simulation.make_snapshot();
  EXPECT_NEAR(s.grippers[0].width_m, 0.08, 1e-6);
  const Command open = GripperCommand{0, {}, GripperAction::open, 0.0, 0.0};
  ASSERT_TRUE(simulation.step({&open, 1}));
  EXPECT_EQ(sample_of(simulation.make_snapshot(), part).partner, table);
}

TEST(Grasping, OnlyPartsBetweenTheJawsAreHeld) {
  BoxCell cell;
  const int palm = cell.gantry_with_gripper("R", "G", at(0, 0, 0.5));
  const int table = cell.ground("T", {1, 1, 0.1}, at(0, 0, 0.3));
  const int inside = cell.part("C", 0.5, 3, {0.06, 0.08, 0.08}, at(0.0, 0.0, 0.40));
  const int beside = cell.part("D", 0.5, 3, {0.06, 0.08, 0.08}, at(0.1, 0.0, 0.40));
  const int below = cell.part("E", 0.5, 3, {0.02, 0.02, 0.02}, at(0.0, 0.06, 0.40));
  Simulation simulation(cell.build());
  const Command close = GripperCommand{0, {}, GripperAction::close, 0.0, 0.0};
  ASSERT_TRUE(simulation.step({&close, 1}));
  for (int i = 0; i < 100; ++i) ASSERT_TRUE(simulation.step({}));
  const Snapshot s = simulation.make_snapshot();
  EXPECT_EQ(sample_of(s, inside).partner, palm);
  EXPECT_EQ(sample_of(s, beside).partner, table);
  EXPECT_EQ(sample_of(s, below).partner, table);
  EXPECT_EQ(sample_of(s, inside).state, PartState::grasped);
  EXPECT_EQ(sample_of(s, beside).state, PartState::placed);
}

}  // namespace
}  // namespace takt::test

// Parts attached by the user: they keep their place relative to their holder, independent of the rules and
// however it moves, until they are detached. And Parts moved by request.
#include <gtest/gtest.h>

#include <cmath>
#include <memory>

#include "server/simulation/step/simulation.h"
#include "tests/support/random_handling.h"
#include "tests/support/state_runs.h"

namespace takt::test {
namespace {

/// A table, two gantries with grippers, and Parts far from each other, but for B, which stands on A.
struct AttachCell {
  explicit AttachCell(const std::string& solver = "rk2") {
    table = cell.ground("Table", {2.0, 2.0, 0.1}, at(0.0, 0.0, -0.1));
    palm = cell.gantry_with_gripper("R", "G", at(0.0, 0.0, 1.0));
    a = cell.part("A", 0.5, 5, {0.06, 0.06, 0.06}, at(0.3, 0.0, 0.0));
    b = cell.part("B", 0.2, 4, {0.04, 0.04, 0.04}, at(0.3, 0.0, 0.06));
    c = cell.part("C", 0.3, 5, {0.05, 0.05, 0.05}, at(-0.4, 0.3, 0.0));
    cell.model().solver.name = solver;
    for (KinematicRobotParameters& robot : cell.model().robots) {
      robot.q_initial = {-0.5, -0.5, 0.0};
      for (JointModel& joint : robot.arm.joints) joint.max_velocity = 5.0;
      cell.model().description.robots[static_cast<std::size_t>(robot.robot)].arm = robot.arm;
    }
    model = cell.build();
  }
  BoxCell cell;
  int table = -1, palm = -1, a = -1, b = -1, c = -1;
  std::shared_ptr<const CellModel> model;
};

struct AttachRun {
  explicit AttachRun(const AttachCell& attach_cell)
      : simulation(attach_cell.model), snapshot(simulation.make_snapshot()) {}
  /// The gantry goes to and fro in x, z and about z.
  void move(int steps) {
    for (int i = 0; i < steps; ++i) {
      std::vector<Command> commands;
      if (simulation.step_index() % 8 == 0) {
        const double t = simulation.time_s() + 0.008;
        JointCommand command;
        command.robot = 0;
        command.position = {
            -0.5 + 0.2 * (1.0 - std::cos(3.0 * t)), -0.5, -0.1 * (1.0 - std::cos(4.0 * t)), 0.0, 0.0,
            0.5 * (1.0 - std::cos(2.0 * t))};
        commands.push_back(command);
      }
      ASSERT_TRUE(simulation.step(commands)) << simulation.fault();
    }
    simulation.read_snapshot(snapshot);
  }
  Pose pose(int id) const {
    const ComponentSample& s = snapshot.components[static_cast<std::size_t>(id)];
    return Pose::from_quaternion(s.p_WB, s.q_WB);
  }
  Pose relative(int id, int to) const { return pose(to).inverse() * pose(id); }
  int partner(int id) const { return snapshot.components[static_cast<std::size_t>(id)].partner; }
  Simulation simulation;
  Snapshot snapshot;
};

// A critically damped spring of 313 1/s lags behind an acceleration a by a / 313^2: here below 5 m/s^2.
constexpr double kLag_m = 1e-4;

double distance(const Pose& x, const Pose& y) {
  return (x.p - y.p).norm();
}

class Attached : public testing::TestWithParam<std::string> {};

TEST_P(Attached, AnAttachedPartAndItsLoadFollowADistantGripperUntilDetached) {
  const AttachCell cell(GetParam());
  AttachRun run(cell);
  run.move(9);
  EXPECT_EQ(run.partner(cell.a), cell.table);
  const Pose a = run.relative(cell.a, cell.palm), b = run.relative(cell.b, cell.palm);
  ASSERT_EQ(run.simulation.attach(cell.a, cell.palm), "");
  run.move(1);
  bool reported = false;
  for (const ConnectionChange& change : run.simulation.events().connection_changes)
    reported = reported || (change.part == cell.a && change.from == cell.table && change.to == cell.palm);
  EXPECT_TRUE(reported);
  EXPECT_EQ(run.partner(cell.a), cell.palm);
  EXPECT_EQ(run.partner(cell.b), cell.palm) << "it rides on A";
  EXPECT_EQ(run.partner(cell.c), cell.table);
  const Explanation e = run.simulation.explain(cell.a);
  EXPECT_EQ(e.decision.rule, PartnerRule::attached);
  EXPECT_EQ(e.decision.partner, cell.palm);
  EXPECT_NE(describe(e, run.simulation.description()).find("attached"), std::string::npos);
  for (int i = 0; i < 20; ++i) {
    run.move(50);
    EXPECT_LE(distance(run.relative(cell.a, cell.palm), a), kLag_m);
    EXPECT_LE(distance(run.relative(cell.b, cell.palm), b), kLag_m);
  }
  ASSERT_EQ(run.simulation.detach(cell.a), "");
  run.move(1);
  EXPECT_NE(run.partner(cell.a), cell.palm);
  run.move(600);
  EXPECT_EQ(run.partner(cell.a), cell.table) << "it fell and was caught";
}
INSTANTIATE_TEST_SUITE_P(Solvers, Attached, testing::Values("rk2", "rosenbrock", "cvode"),
                         [](const auto& test) { return test.param; });

TEST(AttachedParts, PartsAttachedToACarriedPartDoNotSag) {
  const AttachCell cell;
  AttachRun run(cell);
  run.move(9);
  ASSERT_EQ(run.simulation.attach(cell.a, cell.palm), "");
  ASSERT_EQ(run.simulation.attach(cell.c, cell.a), "");
  const Pose c = run.relative(cell.c, cell.a);
  for (int i = 0; i < 600; ++i) ASSERT_TRUE(run.simulation.step({}));  // the gantry stops
  run.move(0);
  EXPECT_EQ(run.partner(cell.c), cell.palm) << "as all that A leads to";
  EXPECT_LE(distance(run.relative(cell.c, cell.a), c), 1e-9);
  for (int i = 0; i < 10; ++i) {
    run.move(50);
    EXPECT_LE(distance(run.relative(cell.c, cell.a), c), 2.0 * kLag_m);
  }
  // Every force is balanced: the gripper carries all three.
  for (int i = 0; i < 600; ++i) ASSERT_TRUE(run.simulation.step({}));
  run.move(0);
  const double weight = (0.5 + 0.2 + 0.3) * 9.80665;
  EXPECT_NEAR(run.snapshot.components[static_cast<std::size_t>(cell.palm)].F_Bo_W.f.z(), -weight, 1e-6);
}

TEST(AttachedParts, PartsAttachedToAGroundKeepThePoseOfEachAttachment) {
  const AttachCell cell;
  AttachRun run(cell);
  ASSERT_EQ(run.simulation.set_component_state(cell.c, at(-0.4, 0.3, 0.5), {}), "");
  ASSERT_EQ(run.simulation.attach(cell.c, cell.table), "");
  run.move(500);
  EXPECT_LE((run.pose(cell.c).p - Vec3(-0.4, 0.3, 0.5)).norm(), 1e-9);
  ASSERT_EQ(run.simulation.set_component_state(cell.c, at(-0.4, -0.3, 0.7), {}), "");
  run.move(500);
  EXPECT_LE((run.pose(cell.c).p - Vec3(-0.4, -0.3, 0.7)).norm(), 1e-9);
  EXPECT_EQ(run.partner(cell.c), cell.table);
}

TEST(AttachedParts, InvalidAttachmentsAreRefusedWithAReason) {
  const AttachCell cell;
  AttachRun run(cell);
  Simulation& s = run.simulation;
  const auto expect = [](const std::string& why, const std::string& part) {
    EXPECT_NE(why.find(part), std::string::npos) << why;
  };
  expect(s.attach(cell.a, cell.a), "itself");
  expect(s.attach(cell.table, cell.a), "only a Part");
  expect(s.attach(cell.palm, cell.a), "only a Part");
  expect(s.attach(-1, cell.a), "no component");
  expect(s.attach(cell.a, 99), "no component");
  expect(s.attach(cell.a, cell.model->grippers[0].parameters.jaws[0]), "is a jaw");
  expect(s.detach(cell.a), "not attached");
  expect(s.detach(99), "no component");
  ASSERT_EQ(s.attach(cell.a, cell.b), "");
  ASSERT_EQ(s.attach(cell.b, cell.c), "");
  expect(s.attach(cell.c, cell.a), "detach that first");
  expect(s.set_component_state(cell.table, {}, {}), "only a Part");
  Pose X_WB;
  X_WB.p.x() = std::nan("");
  expect(s.set_component_state(cell.a, X_WB, {}), "finite");
  X_WB = {};
  X_WB.R *= 1.1;
  expect(s.set_component_state(cell.a, X_WB, {}), "no rotation");
  Twist V_WB;
  V_WB.w.z() = INFINITY;
  expect(s.set_component_state(cell.a, {}, V_WB), "finite");
  for (int i = 0; i < 300; ++i) ASSERT_TRUE(s.step({})) << s.fault();
}

TEST(AttachedParts, AttachmentsAreInTheStateHash) {
  const AttachCell cell;
  AttachRun attached(cell), other(cell);
  ASSERT_EQ(attached.simulation.attach(cell.c, cell.table), "");  // already its holder
  attached.move(1), other.move(1);
  EXPECT_NE(attached.simulation.state_hash(), other.simulation.state_hash());
}

TEST(AttachedParts, AttachmentsAreSaved) {
  const AttachCell cell;
  for (const bool between : {false, true}) {  // also saved ahead of the step that executes it
    AttachRun run(cell), restored(cell);
    run.move(9);
    ASSERT_EQ(run.simulation.attach(cell.a, cell.palm), "");
    ASSERT_EQ(run.simulation.attach(cell.c, cell.a), "");
    ASSERT_EQ(run.simulation.set_component_state(cell.b, at(0.0, 0.4, 0.3), {}), "");
    if (!between) run.move(40);
    std::vector<std::byte> bytes;
    run.simulation.save_state(bytes);
    ASSERT_EQ(restored.simulation.restore_state(bytes), "");
    for (int i = 0; i < 60; ++i) {
      run.move(10), restored.move(10);
      if (i == 30) {
        ASSERT_EQ(run.simulation.detach(cell.a), "");
        ASSERT_EQ(restored.simulation.detach(cell.a), "");
      }
      ASSERT_EQ(run.simulation.state_hash(), restored.simulation.state_hash()) << i;
      expect_same_changes(run.simulation, restored.simulation);
    }
  }
}

TEST(PartPutElsewhere, APartPutElsewhereAppearsAtOnceFallsWithItsTwistAndIsCaught) {
  const AttachCell cell;
  AttachRun run(cell);
  for (int i = 0; i < 300; ++i) ASSERT_TRUE(run.simulation.step({}));  // all rest
  Twist V_WB;
  V_WB.v = Vec3(0.3, 0.0, 0.0);
  ASSERT_EQ(run.simulation.set_component_state(cell.a, at(-0.5, -0.5, 0.4), V_WB), "");
  run.move(0);
  EXPECT_LE((run.pose(cell.a).p - Vec3(-0.5, -0.5, 0.4)).norm(), 1e-12);
  for (int i = 0; i < 100; ++i) ASSERT_TRUE(run.simulation.step({}));
  run.move(0);
  const double t = 0.1;
  EXPECT_LE((run.pose(cell.a).p - Vec3(-0.5 + 0.3 * t, -0.5, 0.4 - 0.5 * 9.80665 * t * t)).norm(), 1e-9);
  EXPECT_EQ(run.partner(cell.a), -1);
  EXPECT_EQ(run.partner(cell.b), -1) << "A went away under it";
  for (int i = 0; i < 1000; ++i) ASSERT_TRUE(run.simulation.step({}));
  run.move(0);
  EXPECT_EQ(run.partner(cell.a), cell.table);
  EXPECT_EQ(run.partner(cell.b), cell.table);
}

// Random attachments, detachments and moves among random assemblies: no state diverges, partners never form a
// cycle, attached Parts keep their partner.
TEST(AttachedParts, RandomAttachmentsStayInPlaceUnderEveryAlgorithm) {
  for (const auto algorithm : {InteractionAlgorithm::partner_search, InteractionAlgorithm::substitute_force,
                               InteractionAlgorithm::extended_substitute_force}) {
    RandomCellOptions options;
    options.seed = 5;
    options.parts = 15;
    const RandomCell cell(options);
    auto model = std::make_shared<CellModel>(*cell.model());
    model->interaction.algorithm = algorithm;
    const bool search = algorithm == InteractionAlgorithm::partner_search;
    if (!search) {
      model->step_s = model->description.step_s = 2.5e-5;
      for (const int part : cell.parts) {
        Component& component = model->components[static_cast<std::size_t>(part)];
        component.substitute =
            substitute_parameters(component.mass_kg, component.I_BBcm_B, 9.80665, 1e-3, 1.0);
      }
    }
    Simulation simulation(model);
    Snapshot snapshot = simulation.make_snapshot();
    Dice dice(9);
    std::vector<int> attached_to(model->components.size(), -1);
    const auto any_part = [&] {
      return cell.parts[static_cast<std::size_t>(dice.below(static_cast<int>(cell.parts.size())))];
    };
    int attached = 0;
    for (int round = 0; round < 120; ++round) {
      const int part = any_part(), what = dice.below(4);
      int& present = attached_to[static_cast<std::size_t>(part)];
      if (what < 2) {
        const int to = dice.chance(50) ? any_part() : dice.chance(50) ? cell.palms[0] : cell.grounds[0];
        if (simulation.attach(part, to).empty()) present = to, ++attached;
      } else if (what == 2) {
        EXPECT_EQ(simulation.detach(part).empty(), present != -1);
        present = -1;
      }
      for (int i = 0; i < 20; ++i) ASSERT_TRUE(simulation.step({})) << simulation.fault();
      simulation.read_snapshot(snapshot);
      for (const int p : cell.parts) {
        int length = 0;
        for (int at = p; at != -1; at = snapshot.components[static_cast<std::size_t>(at)].partner)
          ASSERT_LE(++length, static_cast<int>(model->components.size()));
        const int held = attached_to[static_cast<std::size_t>(p)];
        const bool to_part =
            held != -1 && model->components[static_cast<std::size_t>(held)].type == ComponentType::part;
        if (search && held != -1 && !to_part) {
          ASSERT_EQ(snapshot.components[static_cast<std::size_t>(p)].partner, held) << round;
        } else if (search && to_part) {
          ASSERT_NE(snapshot.components[static_cast<std::size_t>(p)].partner, -1) << round;
        }
        static_cast<void>(simulation.explain(p));
      }
      for (const PairConnection& pair : simulation.connections()) {
        const Wrench F = simulation.pair_wrench(pair);
        ASSERT_TRUE(F.f.allFinite());
      }
    }
    EXPECT_GT(attached, 20);
  }
}

}  // namespace
}  // namespace takt::test

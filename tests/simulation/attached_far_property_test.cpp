// Parts attached to a Gripper from afar, where the robot has dynamics: the lever must not swing the robot
// faster than the solver can follow.
#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <cmath>
#include <memory>

#include "server/contact/holding/connections.h"
#include "server/simulation/model/cell_model.h"
#include "server/simulation/step/simulation.h"
#include "tests/support/loop_reader.h"
#include "tests/support/random_assembly.h"
#include "tests/support/service_cell.h"

namespace takt::test {
namespace {

/// Two arms of UR10e size that swing until rest_s; P lies 1.4 m away from Gripper1. `rotors`: drives with the
/// inertia of motors behind gears, as in config/scenarios/block_assembly.yaml. Without them only the links'
/// inertia resists the pull at the wrist, and the drives' gains are designed for a hundredth of P's effect at
/// that distance: the control cannot hold it still, but no state may diverge.
std::shared_ptr<CellModel> far_model(bool rotors, const std::string& solver = "rk2") {
  auto model = service_contact_model();
  model->solver.name = model->contact_solver.name = solver;
  if (!rotors) return model;
  constexpr double kRotor[] = {2e-4, 2e-4, 1e-4, 3e-5, 3e-5, 3e-5};  // kg m^2
  for (auto& dynamics : model->dynamics) {
    for (std::size_t j = 0; j < dynamics->drives.size(); ++j) {
      auto& drive = std::get<SimplifiedDriveParameters>(dynamics->drives[j]);
      drive.gear_ratio = 101.0;
      drive.rotor_inertia_kg_m2 = kRotor[j];
      drive.set_bandwidth(60.0);
    }
  }
  return model;
}

struct FarRun {
  explicit FarRun(std::shared_ptr<const CellModel> cell)
      : model(std::move(cell)), simulation(model), snapshot(simulation.make_snapshot()) {}
  int id(const char* name) const { return model->description.find_component(name); }
  Pose pose(const char* name) const {
    const ComponentSample& s = snapshot.components[static_cast<std::size_t>(id(name))];
    return Pose::from_quaternion(s.p_WB, s.q_WB);
  }
  Pose relative(const char* name, const char* to) const { return pose(to).inverse() * pose(name); }
  void run_to(double time_s) {
    const double period_s = 0.008;
    while (simulation.time_s() < time_s - 1e-9) {
      std::vector<Command> commands;
      if (simulation.step_index() % 8 == 0 && simulation.time_s() < rest_s) {
        for (const int robot : {0, 1}) {
          JointCommand command = swing(robot, simulation.time_s());
          command.period_s = period_s;
          commands.emplace_back(command);
        }
      }
      ASSERT_TRUE(simulation.step(commands)) << simulation.fault();
      simulation.read_snapshot(snapshot);
      if (part == nullptr) continue;
      const ComponentSample& s = snapshot.components[static_cast<std::size_t>(id(part))];
      largest_force_N = std::max(largest_force_N, s.F_Bo_W.f.norm());
      largest_way_m = std::max(largest_way_m, (relative(part, "Gripper1").p - offset.p).norm());
    }
  }
  void attach(const char* name) {
    simulation.read_snapshot(snapshot);
    part = name;
    offset = relative(name, "Gripper1");
    ASSERT_EQ(simulation.attach(id(name), id("Gripper1")), "");
  }

  std::shared_ptr<const CellModel> model;
  Simulation simulation;
  Snapshot snapshot;
  const char* part = nullptr;
  Pose offset;
  double rest_s = 3.0, largest_force_N = 0.0, largest_way_m = 0.0;
};

struct Case {
  const char* solver;
  int level;
  bool rotors;
};
std::string name_of(const testing::TestParamInfo<Case>& test) {
  return test.param.solver + std::to_string(test.param.level) + (test.param.rotors ? "_rotors" : "");
}

class AttachedFar : public testing::TestWithParam<Case> {
 protected:
  AttachedFar() : run_(far_model(GetParam().rotors, GetParam().solver)) {
    EXPECT_EQ(run_.simulation.set_level_of_detail(-1, GetParam().level), "");
    run_.run_to(0.5);
    // Off the table, which it would rub on at level 3.
    EXPECT_EQ(
        run_.simulation.set_component_state(run_.id("P"), Pose{run_.pose("P").R, Vec3(-0.22, 0.2, 1.1)}, {}),
        "");
    run_.attach("P");
    EXPECT_GT(run_.offset.p.norm(), 1.0);
  }
  FarRun run_;
};

/// An arm in motion takes P along at once, so that it has to gain 0.7 m/s: it swings out, and comes back.
using AttachedFarToAGoodControl = AttachedFar;
TEST_P(AttachedFarToAGoodControl, ThePartFollowsAndComesToRestInItsPlace) {
  run_.run_to(3.0);
  EXPECT_LE(run_.largest_way_m, 0.03);
  EXPECT_LE(run_.largest_force_N, 150.0);
  run_.run_to(6.0);  // the arms stand still after 3 s
  EXPECT_LE((run_.relative("P", "Gripper1").p - run_.offset.p).norm(), 1e-4);
  EXPECT_EQ(run_.snapshot.components[static_cast<std::size_t>(run_.id("P"))].partner, run_.id("Gripper1"));
}
INSTANTIATE_TEST_SUITE_P(Cases, AttachedFarToAGoodControl,
                         testing::Values(Case{"rk2", 1, true}, Case{"rk2", 2, true},
                                         Case{"implicit", 2, true}, Case{"implicit", 3, true},
                                         Case{"rosenbrock", 2, true}, Case{"rosenbrock", 3, true}),
                         name_of);

using AttachedFarToAWeakControl = AttachedFar;
TEST_P(AttachedFarToAWeakControl, ThePartSwingsAndDoesNotDiverge) {
  run_.run_to(4.0);
  EXPECT_LE(run_.largest_way_m, 0.5);
  EXPECT_LE(run_.largest_force_N, 200.0);
  ASSERT_EQ(run_.simulation.detach(run_.id("P")), "");
  run_.part = nullptr;
  run_.run_to(4.5);
}
INSTANTIATE_TEST_SUITE_P(Cases, AttachedFarToAWeakControl,
                         testing::Values(Case{"rk2", 2, false}, Case{"implicit", 2, false},
                                         Case{"implicit", 3, false}, Case{"rosenbrock", 2, false}),
                         name_of);

TEST(AttachedFarParts, AttachedPartsStayWhenTheRobotBecomesDynamic) {
  FarRun run(far_model(false));
  run.run_to(0.5);
  run.attach("P");
  run.run_to(1.0);
  EXPECT_LE(run.largest_way_m, 3e-3) << "stiff at level 1";
  ASSERT_EQ(run.simulation.set_level_of_detail(-1, 2), "");
  run.run_to(1.5);
  EXPECT_LE(run.largest_force_N, 200.0);
  ASSERT_EQ(run.simulation.set_level_of_detail(-1, 1), "");
  run.run_to(6.0);
  EXPECT_LE((run.relative("P", "Gripper1").p - run.offset.p).norm(), 1e-4);
}

TEST(AttachedFarParts, ChainsAndSeveralPartsOnOneGripperStayInPlace) {
  FarRun run(far_model(true));
  ASSERT_EQ(run.simulation.set_level_of_detail(-1, 2), "");
  run.run_to(0.5);
  run.attach("P");
  ASSERT_EQ(run.simulation.attach(run.id("C"), run.id("P")), "");
  run.run_to(8.0);
  EXPECT_LE(run.largest_way_m, 0.2);
  EXPECT_LE((run.relative("P", "Gripper1").p - run.offset.p).norm(), 1e-4);
}

TEST(AttachedFarParts, DistantAttachmentsAreSavedAndRestored) {
  const std::shared_ptr<const CellModel> model = far_model(true);
  FarRun run(model), restored(model);
  ASSERT_EQ(run.simulation.set_level_of_detail(-1, 2), "");
  run.run_to(0.5);
  run.attach("P");
  run.run_to(0.7);
  std::vector<std::byte> bytes;
  run.simulation.save_state(bytes);
  ASSERT_EQ(restored.simulation.restore_state(bytes), "");
  for (FarRun* either : {&run, &restored}) {
    either->run_to(1.0);
    ASSERT_EQ(either->simulation.attach(either->id("C"), either->id("Gripper1")), "");
    either->run_to(1.5);
  }
  EXPECT_EQ(run.simulation.state_hash(), restored.simulation.state_hash());
}

/// A grip is no attachment: constants and bits of merely gripped Parts stay.
TEST(AttachedFarParts, SofteningAppliesToTheAttachmentAndNotToTheGrip) {
  FarRun run(far_model(false));
  ASSERT_EQ(run.simulation.set_level_of_detail(-1, 2), "");
  run.run_to(0.2);
  const auto softening = [&](const char* part) {
    for (const PairConnection& pair : run.simulation.connections())
      if (pair.base == run.id(part)) return pair.connection.softening;
    return 0.0;
  };
  EXPECT_EQ(softening("P"), 1.0) << "on the table";
  run.attach("P");
  run.run_to(0.3);
  EXPECT_LT(softening("P"), 0.1);
  EXPECT_EQ(softening("C"), 1.0);
}

/// Inertia with which the palm responds, in the axes of the base and about its centre of mass: (J M^-1
/// J^T)^-1. It is never less than that of the substitute body.
TEST(LeastPalmInertia, TheBoundHoldsForTheArmInEveryPosition) {
  const auto model = service_model();
  Dice dice(3);
  for (const double armature : {0.0, 0.3}) {
    const RobotDynamics& dynamics = *model->dynamics[0];
    std::vector<std::unique_ptr<Drive>> drives;
    for (int j = 0; j < 6; ++j) {
      SimplifiedDriveParameters p;
      p.rotor_inertia_kg_m2 = armature;
      p.set_bandwidth(30.0);
      if (armature > 0.0)
        drives.push_back(std::make_unique<SimplifiedDrive>(p));
      else
        drives.push_back(std::make_unique<IdealServo>(IdealServoParameters{}));
    }
    const KinematicRobot reference(model->robots[0]);
    const ParallelGripper gripper(model->grippers[0].parameters);
    const DynamicRobot robot(dynamics.parameters, std::move(drives), reference, {&gripper});
    const BodyInertia least = robot.least_palm_inertia(0);
    const MultibodyTree& tree = robot.tree();
    const Pose X_LG = dynamics.parameters.arm.X_JF * gripper.parameters().X_FG;
    double closest = 1e30;
    for (int round = 0; round < 2000; ++round) {
      JointArray q{}, qd{};
      for (std::size_t j = 0; j < 6; ++j) q[j] = dice.between(-3.1, 3.1);
      q[6] = q[7] = dice.between(0.0, 0.07);
      MultibodyTree::Workspace w;
      tree.update(q.data(), qd.data(), w);
      MultibodyTree::MassMatrix M(8, 8);
      tree.mass_matrix(M, w);
      const Pose X_RG = tree.link_pose(5, w) * X_LG;
      const Vec3 p_R = X_RG * least.p_BBcm_B;
      Eigen::Matrix<double, 6, 8> J;
      for (std::size_t j = 0; j < 8; ++j) {
        qd = {};
        qd[j] = 1.0;
        tree.update(q.data(), qd.data(), w);
        const Twist V = tree.link_twist(5, w);
        J.col(static_cast<Eigen::Index>(j)) << V.v + V.w.cross(p_R - tree.link_pose(5, w).p), V.w;
      }
      Eigen::Matrix<double, 6, 6> yields = Eigen::Matrix<double, 6, 6>::Zero();
      yields.diagonal().head<3>().setConstant(1.0 / least.mass_kg);
      yields.bottomRightCorner<3, 3>() = X_RG.R * least.I_BBcm_B.inverse() * X_RG.R.transpose();
      const Eigen::Matrix<double, 6, 6> arm = J * Eigen::MatrixXd(M).ldlt().solve(J.transpose());
      const Eigen::Matrix<double, 6, 6> left = yields - arm;
      const double smallest =
          Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, 6, 6>>(left).eigenvalues().minCoeff();
      ASSERT_GE(smallest, -1e-9) << "round " << round << " armature " << armature;
      closest = std::min(closest, smallest);
    }
    EXPECT_LT(closest, 1e30);
  }
}

}  // namespace
}  // namespace takt::test

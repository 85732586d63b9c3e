// Nut runners: turns, time, torque and angle of a screw that is turned in and tightened.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "server/devices/screw_joints.h"
#include "tests/support/device_cell.h"

namespace takt {
namespace {

using test::DeviceCell;
constexpr double kRunnerTurn = 2.0 * std::numbers::pi;

TEST(TurnIn, TheTorqueRisesWithTheAngleBeyondTheSeat) {
  const ScrewThread thread{0.001, 0.012, 0.5};
  const ScrewTightening tightening{20.0};
  EXPECT_DOUBLE_EQ(tightening.angle_rad(thread, 5.5), 0.25);
  ThreadIn in = turn_in(thread, tightening, 1.0, 0.0, 10.0, 5.5, 0.01);
  EXPECT_DOUBLE_EQ(in.down_rad, 0.1);
  EXPECT_EQ(in.torque_N_m, 0.5);
  EXPECT_FALSE(in.reached);
  in = turn_in(thread, tightening, 0.04, 0.0, 10.0, 5.5, 0.01);
  EXPECT_DOUBLE_EQ(in.down_rad, 0.04);
  EXPECT_NEAR(in.tight_rad, 0.06, 1e-15);
  EXPECT_NEAR(in.torque_N_m, 0.5 + 20.0 * 0.06, 1e-12);
  in = turn_in(thread, tightening, 0.0, 0.2, 10.0, 5.5, 0.01);
  EXPECT_NEAR(in.tight_rad, 0.05, 1e-15);
  EXPECT_NEAR(in.torque_N_m, 5.5, 1e-12);
  EXPECT_TRUE(in.reached);
  in = turn_in(thread, tightening, 1.0, 0.0, 10.0, 0.4, 0.01);
  EXPECT_EQ(in.down_rad, 0.0);
  EXPECT_EQ(in.torque_N_m, 0.4);
  EXPECT_TRUE(in.reached);
}

TEST(NutRunner, TurnsAScrewInAndTightensItToItsTorque) {
  DeviceCell cell(DeviceCell::load_device("nut_runner"));
  cell.run(0.1);
  EXPECT_EQ(cell.read("Screw_thread", "held"), 0.0);
  EXPECT_NEAR(cell.read("Screw_thread", "turns"), 12.0, 1e-12);
  EXPECT_EQ(cell.read("Runner", "engaged"), 1.0);
  EXPECT_EQ(cell.read("Runner", "torque"), 0.0);
  cell.set("Runner", "speed", 10.0 * kRunnerTurn);
  cell.set("Runner", "torque_limit", 5.5);
  cell.run(0.601);  // the thread takes the screw in the first step; half-way
  EXPECT_EQ(cell.read("Screw_thread", "held"), 1.0);
  EXPECT_NEAR(cell.read("Screw_thread", "turns"), 6.0, 1e-9);
  EXPECT_EQ(cell.read("Runner", "torque"), 0.5);
  EXPECT_NEAR(cell.component("Screw").p_WB.z(), 0.7 - 0.006, 2e-4);
  EXPECT_NEAR(cell.read("Runner", "power"), 0.5 * 10.0 * kRunnerTurn, 1e-9);
  const double seated = 0.601 + 0.6;
  cell.run(0.602);
  // 12 turns with 0.5 N m, then (5.5 - 0.5) / 20 rad, 4 ms at this speed.
  ASSERT_TRUE(cell.run_until([&] { return cell.read("Runner", "done") != 0.0; }, 0.1));
  EXPECT_NEAR(cell.time_s() - 0.1, seated + 0.25 / (10.0 * kRunnerTurn), 0.003);
  EXPECT_NEAR(cell.read("Runner", "torque"), 5.5, 1e-9);
  EXPECT_NEAR(cell.read("Runner", "angle"), 12.0 * kRunnerTurn + 0.25, 1e-9);
  EXPECT_NEAR(cell.read("Screw_thread", "turns"), 0.0, 1e-9);
  EXPECT_NEAR(cell.component("Screw").p_WB.z(), 0.688, 2e-4);
  // It stays tight, and turns no further.
  cell.run(0.2);
  EXPECT_NEAR(cell.read("Runner", "angle"), 12.0 * kRunnerTurn + 0.25, 1e-9);
  cell.set("Runner", "speed", 0.0);
  cell.run(0.1);
  EXPECT_EQ(cell.read("Runner", "done"), 1.0);
  EXPECT_EQ(cell.partner("Screw"), "Table");
  // More torque turns it further, by the same curve.
  cell.set("Runner", "torque_limit", 9.5);
  cell.set("Runner", "speed", 1.0);
  cell.run(0.5);
  EXPECT_NEAR(cell.read("Runner", "angle"), 4.0 / 20.0, 1e-9);
}

TEST(NutRunner, ASavedStateAndAResetGoOnWithTheSameBits) {
  const auto model = DeviceCell::load_device("nut_runner");
  DeviceCell cell(model), restored(model);
  const auto begin = [](DeviceCell& now) {
    now.run(0.1);
    now.set("Runner", "speed", 10.0 * kRunnerTurn);
    now.run(1.2045);
  };
  begin(cell);
  std::vector<std::byte> bytes;
  ASSERT_EQ(cell.simulation().save_state(bytes), "");
  cell.run(0.3);
  ASSERT_EQ(restored.simulation().restore_state(bytes), "");
  restored.run(0.3);
  EXPECT_EQ(restored.simulation().state_hash(), cell.simulation().state_hash());
  EXPECT_EQ(restored.read("Runner", "angle"), cell.read("Runner", "angle"));
  const std::uint64_t hash = cell.simulation().state_hash();
  cell.simulation().reset();
  begin(cell);
  cell.run(0.3);
  EXPECT_EQ(cell.simulation().state_hash(), hash);
}

}  // namespace
}  // namespace takt

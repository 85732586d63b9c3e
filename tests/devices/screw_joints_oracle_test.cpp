// Parts held by their thread, and the screwdriver that turns them out: turns, pitch, speed and torque.
#include "plant_models/mechanics/screw_thread.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <memory>
#include <numbers>
#include <string>
#include <vector>

#include "server/devices/screw_joints.h"
#include "server/simulation/step/simulation.h"
#include "tests/support/box_cell.h"

namespace takt {
namespace {

constexpr double kTurn = 2.0 * std::numbers::pi;
const ScrewThread kM6{0.001, 0.012, 1.5};

TEST(ScrewThread, TurnsAreLengthOverPitch) {
  EXPECT_DOUBLE_EQ(kM6.whole_angle_rad(), 12.0 * kTurn);
  double turned = 0.0, time = 0.0;
  const double speed = 10.0 * kTurn, h = 1e-3;
  for (bool free = false; !free; time += h) {
    const ThreadTurn turn = turn_thread(kM6, turned, speed, 4.0, h);
    EXPECT_EQ(turn.torque_N_m, 1.5);
    turned += turn.angle_rad;
    free = turn.free;
    ASSERT_LT(time, 2.0);
  }
  EXPECT_NEAR(time, 1.2, 1e-9);
  EXPECT_DOUBLE_EQ(kM6.travel_m(turned), 0.012);
}

TEST(ScrewThread, AScrewStallsUnderAWeakScrewdriverAndAtItsSeat) {
  const ThreadTurn weak = turn_thread(kM6, 0.0, 60.0, 1.4, 1e-3);
  EXPECT_EQ(weak.angle_rad, 0.0);
  EXPECT_EQ(weak.torque_N_m, 1.4);
  const ThreadTurn in = turn_thread(kM6, 1.0, -60.0, 4.0, 1e-3);
  EXPECT_NEAR(in.angle_rad, -0.06, 1e-15);
  const ThreadTurn seat = turn_thread(kM6, 0.01, -60.0, 4.0, 1e-3);
  EXPECT_DOUBLE_EQ(seat.angle_rad, -0.01);
  EXPECT_EQ(seat.torque_N_m, 4.0);
  EXPECT_EQ(turn_thread(kM6, 0.01, 0.0, 4.0, 1e-3).torque_N_m, 0.0);
}

/// A screw upright in a plate on a table, and a gripper with a bit above it.
class ScrewCell {
 public:
  explicit ScrewCell(double max_torque_N_m = 4.0) {
    cell_.step(0.001);
    cell_.ground("Table", {0.5, 0.5, 0.1}, test::at(0.0, 0.0, -0.1));
    plate_ = cell_.part("Plate", 10.0, 2, {0.2, 0.2, 0.05}, test::at(0.0, 0.0, 0.0));
    screw_ = cell_.part("Screw", 0.1, 1, {0.01, 0.01, 0.03}, test::at(0.0, 0.0, 0.04));
    palm_ = cell_.gantry_with_gripper("Robot", "Gripper", test::at(0.0, 0.0, 0.125));
    CellModel& model = cell_.model();
    ScrewJoints::Screwdriver driver;
    driver.palm = palm_;
    driver.device = kDriver;
    driver.X_GT.R = Vec3(1.0, -1.0, -1.0).asDiagonal();  // the bit points down
    driver.X_GT.p = Vec3(0.0, 0.0, -0.055);
    driver.reach_m = 0.02;
    driver.max_torque_N_m = max_torque_N_m;
    ScrewJoints::Joint thread;
    thread.part = screw_, thread.holder = plate_, thread.device = kThread;
    thread.law = kM6;
    thread.p_BH = Vec3(0.0, 0.0, 0.03);
    auto joints = std::make_shared<ScrewJoints::Model>(ScrewJoints::Model{{thread}, {driver}});
    model.mechanisms = {
        {ScrewJoints::kName, joints, [joints] { return std::make_unique<ScrewJoints>(*joints); }}};
    model.joined = {{screw_, plate_}};
    add_signal_table("Driver", ScrewJoints::kDriverSignals, kDriver, {});
    add_signal_table("Screw_thread", ScrewJoints::kJointSignals, kThread, {0.0, 1.0});
    simulation_ = std::make_unique<Simulation>(cell_.build());
    snapshot_ = simulation_->make_snapshot();
  }

  void speed(double rad_per_s) {
    DeviceCommand command;
    command.device = kDriver;
    command.count = 1;
    command.signals[0] = ScrewJoints::speed;
    command.values[0] = rad_per_s;
    step(command);
  }
  void step(const Command& command) { ASSERT_TRUE(simulation_->step(std::array{command})); }
  void run(double seconds) {
    for (int i = static_cast<int>(std::lround(seconds / 0.001)); i > 0; --i)
      ASSERT_TRUE(simulation_->step({}));
  }
  const Snapshot& now() {
    simulation_->read_snapshot(snapshot_);
    return snapshot_;
  }
  double driver(int signal) { return now().devices[kDriver].signals[static_cast<std::size_t>(signal)]; }
  double thread(int signal) { return now().devices[kThread].signals[static_cast<std::size_t>(signal)]; }
  const ComponentSample& screw() { return now().components[static_cast<std::size_t>(screw_)]; }
  const ComponentSample& palm() { return now().components[static_cast<std::size_t>(palm_)]; }
  Simulation& simulation() { return *simulation_; }
  /// Heights of the robot's flange above where it is at the start.
  void lift(double height_m) {
    JointCommand command;
    command.robot = 0;
    command.position[2] = height_m;
    step(command);
  }
  void grip() {
    GripperCommand command;
    command.gripper = 0;
    command.action = GripperAction::close;
    step(command);
  }

 private:
  enum : int { kDriver, kThread };
  void add_signal_table(const std::string& name, int signals, int device,
                        const std::array<double, 2>& initial) {
    SignalTableParameters p;
    p.count = static_cast<std::size_t>(signals);
    p.initial[0] = initial[0], p.initial[1] = initial[1];
    AuxiliaryModel board;
    board.name = name;
    board.make = [p] { return std::make_unique<SignalTable>(p); };
    board.device = device;
    cell_.model().auxiliary_models.push_back(board);
    cell_.model().description.devices.push_back({name, {}});
    cell_.model().description.devices.back().signals.resize(p.count);
  }
  test::BoxCell cell_;
  int plate_ = -1, screw_ = -1, palm_ = -1;
  std::unique_ptr<Simulation> simulation_;
  Snapshot snapshot_;
};

TEST(Screwdriver, TheScrewIsOutAfterTurnsOverSpeed) {
  ScrewCell cell;
  cell.run(0.1);
  EXPECT_EQ(cell.thread(ScrewJoints::held), 1.0);
  EXPECT_EQ(cell.driver(ScrewJoints::engaged), 1.0);
  EXPECT_EQ(cell.driver(ScrewJoints::torque), 0.0);
  const double z = cell.screw().p_WB.z(), begin = cell.simulation().time_s();
  cell.speed(10.0 * kTurn);
  cell.run(0.5);
  // Half-way: five turns and a bit, torque and power of the law, the reaction on the gripper.
  EXPECT_NEAR(cell.thread(ScrewJoints::turns), 10.0 * (cell.simulation().time_s() - begin), 1e-9);
  EXPECT_EQ(cell.driver(ScrewJoints::torque), 1.5);
  EXPECT_NEAR(cell.driver(ScrewJoints::power), 1.5 * 10.0 * kTurn, 1e-9);
  EXPECT_NEAR(cell.palm().F_Bo_W.t.z(), -1.5, 1e-12);
  EXPECT_NEAR(cell.screw().p_WB.z() - z, 0.001 * cell.thread(ScrewJoints::turns), 3e-5);
  const Mat3 R_WB = cell.screw().q_WB.toRotationMatrix();
  const double angle = std::atan2(R_WB(1, 0), R_WB(0, 0));
  const double wanted = std::remainder(kTurn * cell.thread(ScrewJoints::turns), kTurn);
  EXPECT_NEAR(std::remainder(angle - wanted, kTurn), 0.0, 0.1);
  while (cell.thread(ScrewJoints::held) == 1.0 && cell.simulation().time_s() < 3.0) cell.run(0.001);
  EXPECT_NEAR(cell.simulation().time_s() - begin, 1.2, 0.0021);
  EXPECT_NEAR(cell.thread(ScrewJoints::turns), 12.0, 1e-9);
  EXPECT_NEAR(cell.driver(ScrewJoints::energy), 1.5 * 12.0 * kTurn, 1e-6);
  cell.run(0.002);
  EXPECT_EQ(cell.driver(ScrewJoints::torque), 0.0);
  EXPECT_EQ(cell.palm().F_Bo_W.t.z(), 0.0);
}

TEST(Screwdriver, AScrewInItsThreadStaysAndAFreeScrewIsPulledOff) {
  for (const bool turned_out : {false, true}) {
    ScrewCell cell;
    cell.run(0.05);
    if (turned_out) {
      cell.speed(10.0 * kTurn);
      cell.run(1.25);
      cell.speed(0.0);
    }
    EXPECT_EQ(cell.thread(ScrewJoints::held), turned_out ? 0.0 : 1.0);
    const double z = cell.screw().p_WB.z();
    cell.grip();
    cell.run(1.2);
    for (int i = 1; i <= 25; ++i) {
      cell.lift(0.002 * i);
      cell.run(0.02);
    }
    cell.run(0.3);
    EXPECT_NEAR(cell.screw().p_WB.z() - z, turned_out ? 0.05 : 0.0, 2e-4) << turned_out;
  }
}

TEST(Screwdriver, AWeakScrewdriverStalls) {
  ScrewCell cell(1.0);
  cell.speed(10.0 * kTurn);
  cell.run(0.5);
  EXPECT_EQ(cell.thread(ScrewJoints::turns), 0.0);
  EXPECT_EQ(cell.driver(ScrewJoints::torque), 1.0);
  EXPECT_EQ(cell.driver(ScrewJoints::power), 0.0);
}

TEST(Screwdriver, AStateHalfWayOutContinuesWithTheSameBits) {
  ScrewCell cell;
  cell.speed(10.0 * kTurn);
  cell.run(0.6);
  std::vector<std::byte> bytes;
  cell.simulation().save_state(bytes);
  cell.run(1.0);
  const std::uint64_t hash = cell.now().state_hash;
  ASSERT_EQ(cell.simulation().restore_state(bytes), "");
  EXPECT_NEAR(cell.thread(ScrewJoints::turns), 6.0, 0.02);
  cell.run(1.0);
  EXPECT_EQ(cell.now().state_hash, hash);
  EXPECT_EQ(cell.thread(ScrewJoints::held), 0.0);
}

}  // namespace
}  // namespace takt

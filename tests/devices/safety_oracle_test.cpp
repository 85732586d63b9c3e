// Emergency stop, door and speed override against closed forms: stopping distance and time, the time of a trajectory.
#include "server/devices/safety.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/device_cell.h"

namespace takt {
namespace {

using test::DeviceCell;
using Kind = DeviceNotice::Kind;

double slide_position(DeviceCell& cell) {
  return cell.now().robots[0].position[0];
}
/// Set-points of a slide that goes from 0.3 m at this velocity.
double move_slide(DeviceCell& cell, double velocity_m_per_s, double seconds) {
  double to = slide_position(cell);
  for (auto n = std::lround(seconds / DeviceCell::kStep_s); n > 0; --n) {
    to += velocity_m_per_s * DeviceCell::kStep_s;
    cell.slide_to(to, velocity_m_per_s);
    if (!cell.step()) break;
  }
  return to;
}
TrajectoryCommand slide_trajectory(double to_m, double seconds) {
  auto path = std::make_shared<JointPath>();
  path->order = PathOrder::cubic;
  JointPathPoint point;
  point.t = seconds;
  point.q[0] = to_m;
  path->points.push_back(point);
  TrajectoryCommand command;
  command.robot = 0;
  command.path = path;
  return command;
}
/// Time at which the robot is at the end of its trajectory.
double done_at(DeviceCell& cell, double at_most_s) {
  double done = -1.0;
  cell.run_until(
      [&] {
        for (const MotionNotice& notice : cell.simulation().events().motion_notices)
          if (notice.kind == MotionNotice::Kind::trajectory_done) done = notice.time_s;
        return done >= 0.0;
      },
      at_most_s);
  return done;
}

class SafetyStop : public ::testing::TestWithParam<const char*> {};

TEST_P(SafetyStop, StopsWithinTheBrakingDistanceAndRefusesCommandsUntilAReset) {
  DeviceCell cell(DeviceCell::load_device("safety"));
  const bool door = std::string(GetParam()) == "door_closed";
  const double v = -0.15, a = 1.0;
  const double begin = move_slide(cell, v, 0.1);
  ASSERT_NEAR(slide_position(cell), begin, 1e-12);
  cell.set("Guard", GetParam(), door ? 0.0 : 1.0);
  const double stopped_at = cell.time_s();
  cell.step();
  EXPECT_EQ(cell.read("Guard", "released"), 0.0);
  EXPECT_EQ(cell.count(Kind::motion_stopped), 1U);
  // On the way: q = q0 + v s - a s^2 / 2 against the motion.
  while (cell.time_s() - stopped_at < 0.1495) {
    const double s = cell.time_s() - stopped_at;
    EXPECT_NEAR(slide_position(cell), begin + v * s + 0.5 * a * s * s, 1e-9) << s;
    cell.slide_to(0.0, 0.0);  // without effect
    ASSERT_TRUE(cell.step());
  }
  cell.run(0.1);
  EXPECT_NEAR(slide_position(cell), begin - v * v / (2.0 * a), 1e-9);
  EXPECT_EQ(cell.now().robots[0].velocity[0], 0.0);
  const std::uint64_t applied = cell.now().robots[0].commands_applied;
  const double rest = slide_position(cell);
  // Neither a reset with the cause there, nor set-points, nor trajectories.
  cell.set("Guard", "reset", 1.0);
  cell.give(slide_trajectory(0.5, 1.0));
  cell.step();
  cell.slide_to(rest + 1e-4, 0.0);
  cell.run(0.05);
  EXPECT_EQ(cell.read("Guard", "released"), 0.0);
  EXPECT_EQ(slide_position(cell), rest);
  EXPECT_EQ(cell.now().robots[0].commands_applied, applied);
  // The cause ends: still a stop. A reset that was 1 all the time does not count.
  cell.set("Guard", GetParam(), door ? 1.0 : 0.0);
  cell.run(0.05);
  EXPECT_EQ(cell.read("Guard", "released"), 0.0);
  cell.set("Guard", "reset", 0.0);
  cell.step();
  cell.set("Guard", "reset", 1.0);
  cell.step();
  EXPECT_EQ(cell.read("Guard", "released"), 1.0);
  EXPECT_EQ(cell.count(Kind::motion_released), 1U);
  cell.give(slide_trajectory(0.35, 1.0));
  const double go = cell.time_s();
  EXPECT_NEAR(done_at(cell, 2.0), go + 1.0, 1e-9);
  EXPECT_NEAR(slide_position(cell), 0.35, 1e-12);
}

INSTANTIATE_TEST_SUITE_P(Causes, SafetyStop, ::testing::Values("emergency_stop", "door_closed"));

TEST(SafetyStop, ATrajectoryIsLeftOnItsPathAndASavedStopGoesOn) {
  const auto model = DeviceCell::load_device("safety");
  DeviceCell cell(model), restored(model);
  cell.give(slide_trajectory(0.5, 2.0));
  cell.run(1.0);  // half-way at 0.15 m/s
  EXPECT_NEAR(slide_position(cell), 0.4, 1e-9);
  cell.set("Guard", "emergency_stop", 1.0);
  cell.run(0.05);
  std::vector<std::byte> bytes;
  ASSERT_EQ(cell.simulation().save_state(bytes), "");
  ASSERT_EQ(restored.simulation().restore_state(bytes), "");
  for (DeviceCell* now : {&cell, &restored}) {
    now->slide_to(0.45, 0.0);
    now->run(1.0);
    EXPECT_NEAR(slide_position(*now), 0.4 + 0.15 * 0.15 / 2.0, 1e-9);
  }
  EXPECT_EQ(cell.simulation().state_hash(), restored.simulation().state_hash());
  cell.simulation().reset();
  EXPECT_EQ(cell.read("Guard", "released"), 1.0);
  cell.give(slide_trajectory(0.5, 2.0));
  EXPECT_NEAR(done_at(cell, 3.0), 2.0, 1e-9);
}

TEST(SafetyStop, BeltsAndAxesBrakeAndFollowTheirCommandsAgain) {
  DeviceCell cell(DeviceCell::load_text(R"(
world: {gravity_m_per_s2: [0, 0, 0]}
grounds:
  Belt: {mesh: MESHES/contact/plate.obj}
  Table: {mesh: MESHES/contact/plate.obj, pose: {position_m: [0, 2, 0]}}
conveyors: {Conveyor: {ground: Belt, max_speed_m_per_s: 0.5, max_acceleration_m_per_s2: 2, speed_m_per_s: 0.4, running: true}}
linear_axes: {Lift: {grounds: [Table], direction: [0, 0, 1], stroke_m: [0, 1], max_speed_m_per_s: 0.2, max_acceleration_m_per_s2: 0.5}}
safety: {Safety: {}}
)"));
  cell.set("Lift", "set_position", 0.5);
  cell.run(1.0);
  const double belt = cell.read("Conveyor", "position"), lift = cell.read("Lift", "position");
  cell.set("Safety", "emergency_stop", 1.0);
  cell.run(1.0);
  // Braking distance v^2 / 2a.
  EXPECT_NEAR(cell.read("Conveyor", "position"), belt + 0.4 * 0.4 / 4.0, 1e-12);
  EXPECT_NEAR(cell.read("Lift", "position"), lift + 0.2 * 0.2 / 1.0, 1e-12);
  EXPECT_EQ(cell.read("Conveyor", "speed"), 0.0);
  // A command during the stop is kept.
  cell.set("Lift", "set_position", 0.1);
  cell.run(0.2);
  EXPECT_EQ(cell.read("Lift", "speed"), 0.0);
  std::vector<std::byte> saved;
  ASSERT_EQ(cell.simulation().save_state(saved), "");
  ASSERT_EQ(cell.simulation().restore_state(saved), "");
  cell.set("Safety", "emergency_stop", 0.0);
  cell.set("Safety", "reset", 1.0);
  cell.run(2.5);
  EXPECT_NEAR(cell.read("Lift", "position"), 0.1, 1e-12);
  EXPECT_NEAR(cell.read("Conveyor", "speed"), 0.4, 1e-12);
}

TEST(SpeedOverride, ScalesTheTimeOfATrajectory) {
  DeviceCell cell(DeviceCell::load_device("safety"));
  cell.set("Guard", "speed_override", 50.0);
  cell.run(1.0);
  EXPECT_EQ(cell.read("Guard", "speed"), 50.0);
  const double begin = cell.time_s();
  cell.give(slide_trajectory(0.4, 1.0));
  cell.run(0.5);  // a quarter of the path's time: q = q0 + d (3 u^2 - 2 u^3), velocity d (6 u - 6 u^2) / T
  EXPECT_NEAR(slide_position(cell), 0.3 + 0.1 * (3.0 / 16.0 - 2.0 / 64.0), 1e-9);
  EXPECT_NEAR(cell.now().robots[0].velocity[0], 0.5 * 0.1 * (6.0 / 4.0 - 6.0 / 16.0), 1e-9);
  EXPECT_NEAR(done_at(cell, 3.0), begin + 2.0, DeviceCell::kStep_s);
  EXPECT_NEAR(slide_position(cell), 0.4, 1e-12);
}

TEST(SpeedOverride, RampsAndStandsAtZero) {
  DeviceCell cell(DeviceCell::load_device("safety"));
  cell.give(slide_trajectory(0.4, 1.0));
  cell.set("Guard", "speed_override", 50.0);
  // From 100 to 50 % in 0.25 s: 0.1875 s of the path; the other 0.8125 s take twice as long.
  EXPECT_NEAR(done_at(cell, 3.0), 0.25 + 2.0 * 0.8125, 2.0 * DeviceCell::kStep_s);
  cell.give(slide_trajectory(0.3, 1.0));
  cell.set("Guard", "speed_override", 0.0);
  cell.run(1.0);
  const double there = slide_position(cell);
  cell.run(1.0);
  EXPECT_NEAR(slide_position(cell), there, 1e-12);
  EXPECT_GT(there, 0.3);
  cell.set("Guard", "speed_override", 100.0);
  EXPECT_GT(done_at(cell, 3.0), 0.0);
  EXPECT_NEAR(slide_position(cell), 0.3, 1e-12);
}

}  // namespace
}  // namespace takt

// Trajectories and deadlines in the step loop: lockstep, events.
#include <gtest/gtest.h>

#include <cmath>

#include "server/runtime/loop/run_loop.h"
#include "tests/support/constants.h"
#include "tests/support/loop_reader.h"
#include "tests/support/service_cell.h"

namespace takt {
namespace {

Command trajectory(const CellDescription& cell, double first, double time_s, double stamp_s) {
  RawTrajectory raw{SimTime::from_seconds(stamp_s), {}, {}};
  for (const JointModel& joint : cell.robots[0].arm.joints) raw.names.push_back(joint.name);
  raw.points.push_back({{first, -test::kQuarterTurn_rad, test::kQuarterTurn_rad, -test::kQuarterTurn_rad,
                         -test::kQuarterTurn_rad, 0.0},
                        {},
                        {},
                        {},
                        time_s});
  return std::get<TrajectoryCommand>(validate(cell, 0, raw));
}

TEST(RunLoopTrajectory, ATrajectoryStandsForItsControllerInLockstepUntilItsEnd) {
  Simulation simulation(test::service_model());
  RunLoop loop(simulation, {.pace = Pace::lockstep, .state = SimulationState::paused});
  test::LoopReader reader(loop);
  loop.start();
  ASSERT_EQ(
      reader
          .request("register_controller",
                   {{"name", "plc"}, {"period", "0.008"}, {"command_timeout", "600"}, {"targets", "Robot1"}})
          .result,
      ControlResult::ok);
  ASSERT_EQ(reader.request("set_state", {{"state", "1"}}).result, ControlResult::ok);
  EXPECT_FALSE(loop.append(trajectory(loop.cell(), 0.1, 0.2, -1.0), 1, monotonic_now_ns()));
  // It is not replaced, whenever this comes.
  EXPECT_FALSE(loop.append(test::swing(0, 0.104), 1, monotonic_now_ns()));
  ASSERT_TRUE(reader.wait_until([&] {
    return reader.status && reader.status->step == 200 && reader.status->waiting_count == 1 &&
           reader.snapshot && reader.snapshot->step == 200;
  }));
  EXPECT_NEAR(reader.snapshot->robots[0].position[0], 0.1, 1e-12);
  EXPECT_EQ(reader.snapshot->robots[0].commands_applied, 1U);
  EXPECT_EQ(reader.count("trajectory_done"), 1U);
  JointCommand next = test::swing(0, 0.0);
  next.stamp = SimTime::from_seconds(0.2);
  next.position[0] = 0.1;
  EXPECT_FALSE(loop.append(next, 1, monotonic_now_ns()));
  ASSERT_TRUE(reader.wait_until([&] { return reader.snapshot->step == 208; }));
  loop.stop();
}

TEST(RunLoopTrajectory, SilenceIsReportedOutsideOfLockstep) {
  const auto model = test::service_model();
  model->description.robots[0].command_deadline = {0.05, SafeAction::hold, {}};
  Simulation simulation(model);
  RunLoop loop(simulation, {.pace = Pace::free, .state = SimulationState::paused});
  test::LoopReader reader(loop);
  loop.start();
  EXPECT_FALSE(loop.append(test::swing(0, 0.0), 1, monotonic_now_ns()));
  ASSERT_EQ(reader.request("step", {{"steps", "200"}}).result, ControlResult::ok);
  const auto missed = reader.wait_for_event("command_deadline_missed");
  ASSERT_TRUE(missed);
  EXPECT_NEAR(missed->time_s, 0.05, 1e-9);
  EXPECT_EQ(describe(*missed, loop.cell()).message,
            "No set-point arrived for Robot1 for 0.05 s (simulated); allowed are 0.05 s. Its safe action "
            "follows: hold.");
  loop.stop();
}

}  // namespace
}  // namespace takt

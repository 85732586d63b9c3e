// Commands with torques as feed-forward at random, at level of detail 2 under every solver: saved and
// restored runs continue with the same bits, and torques have an effect.
#include <gtest/gtest.h>

#include <random>

#include "server/simulation/model/solver.h"
#include "tests/support/geared_drives.h"
#include "tests/support/loop_reader.h"
#include "tests/support/service_cell.h"
#include "tests/support/state_runs.h"

namespace takt::test {
namespace {

StepCommands pushing_commands(const CellDescription& cell, std::size_t steps, bool with_efforts) {
  std::mt19937 dice(17);
  const auto torque_N_m = [&] { return static_cast<double>(dice() % 21) - 10.0; };
  StepCommands commands(steps);
  for (std::size_t i = 0; i < steps; i += 8) {
    const int robot = static_cast<int>(dice() % 2);
    if (dice() % 6 == 0) {
      auto path = std::make_shared<JointPath>();
      path->has_feed_forward = dice() % 3 != 0;
      for (const double t : {0.03, 0.05}) {
        JointPathPoint& point = path->points.emplace_back();
        point.t = t;
        point.q = swing(robot, 0.5 * t).position;
        for (std::size_t j = 0; j < cell.robots[0].arm.joints.size(); ++j)
          point.feed_forward[j] = torque_N_m();
        if (!with_efforts || !path->has_feed_forward) point.feed_forward = {};
      }
      commands[i].emplace_back(TrajectoryCommand{robot, {}, path});
      continue;
    }
    JointCommand command = swing(robot, 1e-3 * static_cast<double>(dice() % 20));
    command.stamp = {};
    command.has_effort = dice() % 3 != 0;
    for (std::size_t j = 0; j < cell.robots[0].arm.joints.size(); ++j) command.effort[j] = torque_N_m();
    if (!with_efforts || !command.has_effort) command.effort = {};
    command.has_effort = command.has_effort && with_efforts;
    commands[i].emplace_back(command);
  }
  return commands;
}

class SavedFeedForward : public testing::TestWithParam<std::string> {};
TEST_P(SavedFeedForward, SavedFeedForwardContinuesWithTheSameBits) {
  auto model = service_model();
  add_rotors(*model);
  model->solver.name = GetParam();
  model->solver.tolerance = solver_default_tolerance(GetParam());
  const auto at_level_two = [](Simulation& run) { ASSERT_EQ(run.set_level_of_detail(-1, 2), ""); };
  const StepCommands commands = pushing_commands(model->description, 160, true);
  check_restored_runs(model, commands, {3, 41, 90}, 60, at_level_two);

  Simulation with(model), without(model);
  at_level_two(with), at_level_two(without);
  const StepCommands others = pushing_commands(model->description, 160, false);
  for (std::size_t i = 0; i < commands.size(); ++i) {
    ASSERT_TRUE(with.step(commands[i])) << with.fault();
    ASSERT_TRUE(without.step(others[i])) << without.fault();
  }
  EXPECT_NE(with.state_hash(), without.state_hash());
  EXPECT_GT(
      std::abs(with.make_snapshot().robots[0].position[1] - without.make_snapshot().robots[0].position[1]),
      1e-7);
}
std::vector<std::string> feed_forward_solvers() {
  return {solver_names().begin(), solver_names().end()};
}
INSTANTIATE_TEST_SUITE_P(Solvers, SavedFeedForward, testing::ValuesIn(feed_forward_solvers()),
                         [](const auto& test) { return test.param; });

}  // namespace
}  // namespace takt::test

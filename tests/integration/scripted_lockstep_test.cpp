// A test of a cell as a user writes it in C++: takt-server in its own process, commands in lockstep, no
// sleep; and the same bits as the same motion in one process.
#include <gtest/gtest.h>

#include <filesystem>
#include <string>

#include "client_lib/client.h"
#include "client_lib/lockstep_controller.h"
#include "server/headless/headless_run.h"
#include "server/scenario/scenario_builder.h"
#include "tests/support/built_programs.h"
#include "tests/support/child_process.h"
#include "tests/support/temporary_directory.h"
#include "tests/support/test_domain.h"

namespace takt::test {
namespace {

using takt::test::kBin;
using takt::test::kBlockScenario;
using takt::test::kConfig;

constexpr int kPeriods = 250;
constexpr double kPeriod_s = 0.008;

/// The motion as a robot program.
constexpr const char* kScript = R"(
period_s = 0.008
routine("Robot2", function(r)
  local start = r.joints
  for k = 1, 250 do
    local u = k / 250
    local q = {}
    for j = 1, #start do q[j] = start[j] end
    q[5] = start[5] + 3.2 * u * u * (1 - u) * (1 - u)
    if k == 51 then r.gripper:close() end
    r:move_joints(q, {duration_s = period_s, speed = 1, acceleration_rad_per_s2 = 1e9})
  end
end)
)";

std::uint64_t hash_in_process() {
  const TemporaryDirectory directory;
  directory.write("motion.lua", kScript);
  const Scenario scenario = read_scenario(kBlockScenario);
  Simulation simulation(build_cell(scenario));
  HeadlessOptions options;
  options.duration_s = kPeriods * kPeriod_s;
  options.program = directory / "motion.lua";
  EXPECT_EQ(run_headless(simulation, scenario, options).fault, "");
  return simulation.state_hash();
}

/// The same from outside; the state at its end. `ahead`: without a look at the cell.
State drive(Client& cell, bool ahead = false) {
  LockstepOptions options;
  options.targets = {"Robot2", "Gripper2"};
  options.period_s = kPeriod_s;
  LockstepController controller(cell, options);
  const std::vector<double> start = controller.state().robot("Robot2").position;
  std::vector<double> target = start;
  for (int k = 1; k <= kPeriods; ++k) {
    const double u = static_cast<double>(k) / kPeriods;
    target[4] = start[4] + 3.2 * u * u * (1 - u) * (1 - u);
    if (k == 51) controller.grip("Gripper2", GripperAction::close);
    controller.move("Robot2", target);
    if (ahead && k < kPeriods)
      controller.advance_ahead();
    else
      controller.advance();
    EXPECT_NEAR(controller.time_s(), kPeriod_s * k, 1e-12);
  }
  return controller.state();
}

TEST(ScriptedLockstep, AScriptedMotionHasTheBitsOfTheSameMotionInOneProcess) {
  const std::uint64_t expected = hash_in_process();
  const std::string name = "scripted_" + std::to_string(getpid());
  const std::string domain = std::to_string(takt::test::test_domain());
  ChildProcess server(
      {kBin + "/takt-server", kBlockScenario, "--paused", "--cell", name, "--domain", domain});
  ASSERT_TRUE(server.wait_for_output("ready")) << server.text;
  ClientOptions options;
  options.cell = name;
  options.domain = std::stoi(domain);
  options.timeout = Seconds(60.0);
  options.liveliness_timeout = Seconds(60.0);
  Client cell(options);
  const State end = drive(cell);
  EXPECT_EQ(end.step, 2000U);
  EXPECT_EQ(end.state_hash, expected);
  EXPECT_TRUE(end.gripper("Gripper2").closed);
  cell.reset();
  EXPECT_EQ(drive(cell).state_hash, expected);
  cell.reset();
  EXPECT_EQ(drive(cell, true).state_hash, expected);
  EXPECT_EQ(cell.status().commands_rejected, 0U);
  cell.set_state(SimulationState::quitting);
  EXPECT_EQ(server.wait(), 0) << server.text;
}

}  // namespace
}  // namespace takt::test

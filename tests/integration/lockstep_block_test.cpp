// The block scenario over DDS in lockstep, with the users' programs: the same bits as takt-run of the same
// program, in every run, under any load of the machine.
#include <gtest/gtest.h>

#include <filesystem>
#include <string>
#include <vector>

#include "client_lib/client.h"
#include "server/headless/headless_run.h"
#include "server/scenario/scenario_builder.h"
#include "tests/support/built_programs.h"
#include "tests/support/child_process.h"
#include "tests/support/effort.h"
#include "tests/support/test_domain.h"

namespace takt::test {
namespace {

using takt::test::kBin;
using takt::test::kBlockScenario;
using takt::test::kConfig;

const std::string kProgram = kConfig / "programs" / "block_assembly.lua";

/// State hash after every step of the run in one process.
std::vector<std::uint64_t> hashes_in_process() {
  const Scenario scenario = read_scenario(kBlockScenario);
  Simulation simulation(build_cell(scenario));
  HeadlessOptions options;
  options.duration_s = scenario.duration_s;
  options.program = scenario.controller_program;
  std::vector<std::uint64_t> hashes;
  const HeadlessResult result = run_headless(simulation, scenario, options,
                                             [&](const Simulation& s) { hashes.push_back(s.state_hash()); });
  EXPECT_EQ(result.fault, "");
  return hashes;
}

TEST(LockstepBlockScenario, EveryRunHasTheBitsOfTheRunInOneProcess) {
  const std::vector<std::uint64_t> expected = hashes_in_process();
  ASSERT_EQ(expected.size(), 42001U);
  const std::string domain = std::to_string(takt::test::test_domain());
  const std::size_t rounds = 2 * effort();
  for (std::size_t round = 0; round < rounds; ++round) {
    const std::string cell_name = "lockstep_" + std::to_string(getpid()) + "_" + std::to_string(round);
    ChildProcess server(
        {kBin + "/takt-server", kBlockScenario, "--paused", "--cell", cell_name, "--domain", domain});
    ASSERT_TRUE(server.wait_for_output("ready")) << server.text;
    ClientOptions options;
    options.cell = cell_name;
    options.domain = std::stoi(domain);
    options.timeout = Seconds(60.0);
    options.liveliness_timeout = Seconds(60.0);
    Client cell(options);
    ChildProcess controller({kBin + "/takt-controller", kProgram, "--cell", cell_name, "--domain", domain,
                             "--pace", "lockstep", "--start", "--until", "42", "--timeout", "60",
                             "--lookahead", round % 2 == 0 ? "0" : "63"});
    // Every instant that reaches this client is compared. The hash is chained, so equality at a step means
    // equality at every step before it.
    std::size_t compared = 0;
    std::uint64_t first_wrong = 0;
    const auto end = cell.wait_for(
        takt::topics::state,
        [&](const State& state) {
          if (state.step < expected.size()) {
            ++compared;
            if (state.state_hash != expected[state.step] && first_wrong == 0) first_wrong = state.step;
          }
          return state.step >= 42000 || first_wrong != 0;
        },
        Seconds(300.0));
    ASSERT_TRUE(end.has_value()) << "round " << round << ": the end was not reached\n" << controller.text;
    ASSERT_EQ(first_wrong, 0U) << "round " << round << ": other bits at this step";
    EXPECT_EQ(end->step, 42000U);
    EXPECT_GT(compared, round % 2 == 0 ? 1000U : 100U);
    EXPECT_EQ(controller.wait(), 0) << controller.text;
    server.signal(SIGTERM);
    EXPECT_EQ(server.wait(), 0) << server.text;
  }
}

}  // namespace
}  // namespace takt::test

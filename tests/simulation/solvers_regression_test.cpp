// The block scenario with every solver: the same places, the same partners, the same bits in every run.
#include <gtest/gtest.h>

#include "server/headless/report.h"
#include "server/simulation/model/solver.h"
#include "tests/support/block_scenario_run.h"

namespace takt {
namespace {

using test::BlockRun;

class EverySolver : public testing::TestWithParam<std::string> {};

TEST_P(EverySolver, BlocksEndAtTheSamePlaces) {
  static const BlockRun reference = test::run_block_scenario("block_assembly");
  const BlockRun r = test::run_block_scenario("block_assembly", {"solver.method=" + GetParam()});
  ASSERT_EQ(r.result.fault, "");
  EXPECT_EQ(r.lost_part_steps, 0U);
  EXPECT_LE(max_position_error_m(r.scenario, r.cell->description, r.result.final_state), 1e-4);
  ASSERT_EQ(r.result.changes.size(), reference.result.changes.size());
  std::uint64_t change_steps = 0;
  for (std::size_t i = 0; i < r.result.changes.size(); ++i) {
    const ConnectionChange& change = r.result.changes[i];
    EXPECT_EQ(change.part, reference.result.changes[i].part) << i;
    EXPECT_EQ(change.from, reference.result.changes[i].from) << i;
    EXPECT_EQ(change.to, reference.result.changes[i].to) << i;
    EXPECT_NEAR(change.time_s, reference.result.changes[i].time_s, 2e-3) << i;
    if (i == 0 || change.step != r.result.changes[i - 1].step) ++change_steps;
  }
  const SolverStatistics& work = r.result.statistics.solver;
  EXPECT_GE(work.steps, 42000U);
  EXPECT_EQ(work.evaluations, r.result.statistics.derivative_evaluations);
  if (solver_has_error_control(GetParam())) {
    // Connections restart it, and jaws that arrive (two each time a gripper opens or closes); 5250 set-points
    // per robot do not.
    constexpr std::uint64_t kJawArrivals = 2 * 8;
    EXPECT_LE(work.restarts, change_steps + 1 + kJawArrivals);
    EXPECT_GT(work.jacobians, 0U);
  } else {
    EXPECT_EQ(work.restarts, 0U);
  }
  const BlockRun again = test::run_block_scenario("block_assembly", {"solver.method=" + GetParam()});
  EXPECT_EQ(again.result.final_state.state_hash, r.result.final_state.state_hash);
}

TEST_P(EverySolver, ErrorControlKeepsThePlacesAtLargeCommunicationSteps) {
  if (!solver_has_error_control(GetParam())) GTEST_SKIP() << "beyond the stability of fixed steps";
  const BlockRun r =
      test::run_block_scenario("block_assembly", {"solver.method=" + GetParam(), "solver.step_s=0.008"});
  ASSERT_EQ(r.result.fault, "");
  EXPECT_EQ(r.lost_part_steps, 0U);
  EXPECT_LE(max_position_error_m(r.scenario, r.cell->description, r.result.final_state), 1e-4);
}

// At level of detail 3, in communication steps of 1 ms.
TEST(BoundedSolverOfABlockAssembly, TheBlocksEndWhereTheExactSolverPutsThem) {
  const auto run = [](const std::string& solver, const std::string& tolerance) {
    return test::run_block_scenario("block_assembly",
                                    {"processes.assembly.level_of_detail=3", "solver.step_s=0.001",
                                     "solver.method=" + solver, "solver.tolerance=" + tolerance});
  };
  const BlockRun exact = run("cvode", "1e-7"), bounded = run("implicit", "1e-6");
  ASSERT_EQ(exact.result.fault, "");
  ASSERT_EQ(bounded.result.fault, "");
  for (const ScenarioPart& part : exact.scenario.parts) {
    const auto id = static_cast<std::size_t>(exact.cell->description.find_component(part.name));
    EXPECT_LE((bounded.result.final_state.components[id].p_WB - exact.result.final_state.components[id].p_WB)
                  .norm(),
              5e-5)
        << part.name;
  }
  const SolverStatistics& work = bounded.result.statistics.solver;
  EXPECT_LT(work.forced_steps, 420U) << "one in a hundred communication steps";
  EXPECT_LT(work.evaluations, 5 * 42'000U);
}

std::vector<std::string> every_solver() {
  return {solver_names().begin(), solver_names().end()};
}
INSTANTIATE_TEST_SUITE_P(Solvers, EverySolver, testing::ValuesIn(every_solver()),
                         [](const auto& test) { return test.param; });

}  // namespace
}  // namespace takt

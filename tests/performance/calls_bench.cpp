// bench_calls: Table 5.4 of the thesis. Block scenario at LoD 3 at a tolerance of 2e-6 with and without the
// optimisation of function calls and the parallel evaluation of pairs (two threads): computation time and
// calls of the contact algorithm, beside the thesis' (i7-11700K, Dymola). The final states must not differ.
#include <cstdio>
#include <optional>
#include <string>

#include "server/headless/headless_run.h"
#include "server/headless/report.h"
#include "server/runtime/worker_pool.h"
#include "server/scenario/scenario_builder.h"

namespace {

struct Row {
  const char* solver;
  bool optimize, parallel;
  const char* thesis;  ///< solver, time, calls in millions; empty: not in the thesis
};

constexpr Row kRows[] = {
    {"ida", false, false, "DASSL 1560 s 49.7"},
    {"ida", false, true, "DASSL 831 s 49.7"},
    {"ida", true, false, "DASSL 597 s 16.9"},
    {"ida", true, true, "DASSL 408 s 16.9"},
    {"esdirk", false, false, "Esdirk 1273 s 41.7"},
    {"esdirk", false, true, "Esdirk 688 s 41.7"},
    {"esdirk", true, false, "Esdirk 573 s 17.0"},
    {"esdirk", true, true, "Esdirk 384 s 17.0"},
    {"cvode", false, false, ""},
    {"cvode", false, true, ""},
    {"cvode", true, false, ""},
    {"cvode", true, true, ""},
};

}  // namespace

int main(int argc, char** argv) {
  const std::string file = argc > 1 ? argv[1] : TAKT_CONFIG_DIR "/scenarios/block_assembly.yaml";
  const std::string step = argc > 2 ? argv[2] : "0.008";
  std::printf("%s at LoD 3, tolerance 2e-6, communication step %s s\n", file.c_str(), step.c_str());
  std::printf("%-7s %-4s %-4s %9s %9s %11s %11s %9s  %-16s  %s\n", "solver", "opt", "par", "wall s", "cpu s",
              "calls 1e6", "skipped 1e6", "error mm", "state hash", "thesis: time, calls 1e6");
  for (const Row& row : kRows) {
    takt::ScenarioOptions options;
    options.level_of_detail = 3;
    options.overrides = {std::string("solver.method=") + row.solver, "solver.tolerance=2e-6",
                         "solver.step_s=" + step,
                         std::string("contact.optimize_calls=") + (row.optimize ? "true" : "false"),
                         std::string("contact.parallel=") + (row.parallel ? "true" : "false")};
    const takt::Scenario scenario = takt::read_scenario(file, options);
    const auto cell = takt::build_cell(scenario);
    takt::Simulation simulation(cell);
    std::optional<takt::WorkerPool> pool;
    if (row.parallel) simulation.set_executor(&pool.emplace(2, 0, takt::WorkerPool::Sharing::always));
    takt::HeadlessOptions headless;
    headless.duration_s = scenario.duration_s;
    headless.program = scenario.controller_program;
    const takt::HeadlessResult result = takt::run_headless(simulation, scenario, headless);
    const takt::ContactCallCounts calls = simulation.contact_counts();
    std::printf("%-7s %-4s %-4s %9.3f %9.3f %11.4f %11.4f %9.4f  %016llx  %s%s%s\n", row.solver,
                row.optimize ? "x" : "-", row.parallel ? "x" : "-", result.wall_s, result.cpu_s,
                1e-6 * static_cast<double>(calls.made), 1e-6 * static_cast<double>(calls.skipped),
                1e3 * takt::max_position_error_m(scenario, cell->description, result.final_state),
                static_cast<unsigned long long>(result.final_state.state_hash), row.thesis,
                result.fault.empty() ? "" : "  ended early: ", result.fault.c_str());
    std::fflush(stdout);
  }
  return 0;
}

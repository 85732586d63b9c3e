// bench_calls: Table 5.4 of the thesis. Block scenario at LoD 3 at a tolerance of 2e-6 with and without the
// optimisation of function calls and the parallel evaluation of pairs (two threads): computation time and
// calls of the contact algorithm, beside the thesis' (i7-11700K, Dymola). The final states must not differ.
// Wall times are significant only on a machine with two idle cores.
// A run beyond the limit of processor time is stopped, its figures are extrapolated and marked "~".
//   bench_calls [SCENARIO.yaml] [--solver NAME] [--limit SECONDS (60; 0: none)] [--step SECONDS (0.008)]
#include <CLI/CLI.hpp>
#include <cstdio>
#include <ctime>
#include <optional>
#include <stdexcept>
#include <string>

#include "server/headless/headless_run.h"
#include "server/headless/report.h"
#include "server/runtime/loop/worker_pool.h"
#include "server/scenario/scenario_builder.h"
#include "tests/performance/solver_runs.h"

namespace {

using takt::bench::RunOptions;

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

void run(const RunOptions& options, const Row& row) {
  takt::ScenarioOptions scenario_options;
  scenario_options.level_of_detail = 3;
  scenario_options.overrides = {
      std::string("solver.method=") + row.solver, "solver.tolerance=2e-6", "solver.step_s=" + options.step,
      std::string("contact.cache_unmoved_pairs=") + (row.optimize ? "true" : "false"),
      std::string("contact.parallel=") + (row.parallel ? "true" : "false")};
  const takt::Scenario scenario = takt::read_scenario(options.file, scenario_options);
  const auto cell = takt::build_cell(scenario);
  std::optional<takt::WorkerPool> pool;
  takt::Simulation simulation(cell);
  if (row.parallel) simulation.set_executor(&pool.emplace(2, 0, takt::WorkerPool::Sharing::always));
  takt::HeadlessOptions headless;
  headless.duration_s = scenario.duration_s;
  headless.program = scenario.controller_program;
  double stopped_s = 0.0;
  const std::clock_t begin = std::clock();
  const takt::HeadlessResult result =
      takt::run_headless(simulation, scenario, headless, {}, [&](double time_s) {
        const double used_s = static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC;
        if (options.limit_s <= 0.0 || used_s < options.limit_s) return;
        stopped_s = time_s;
        throw std::runtime_error("limit of processor time");
      });
  const takt::ContactCallCounts calls = simulation.contact_counts();
  const bool stopped = stopped_s > 0.0;
  const double scale = stopped ? scenario.duration_s / stopped_s : 1.0;
  const char* about = stopped ? "~" : "";
  const auto number = [&](double value, int digits) {
    char text[32];
    std::snprintf(text, sizeof text, "%s%.*f", about, digits, scale * value);
    return std::string(text);
  };
  char end[64] = "";
  if (stopped)
    std::snprintf(end, sizeof end, "%9s  %-16s", "", "-");
  else
    std::snprintf(end, sizeof end, "%9.4f  %016llx",
                  1e3 * takt::max_position_error_m(scenario, cell->description, result.final_state),
                  static_cast<unsigned long long>(result.final_state.state_hash));
  std::printf("%-7s %-4s %-4s %9s %9s %11s %11s %s  %s", row.solver, row.optimize ? "x" : "-",
              row.parallel ? "x" : "-", number(result.wall_s, 3).c_str(), number(result.cpu_s, 3).c_str(),
              number(1e-6 * static_cast<double>(calls.made), 4).c_str(),
              number(1e-6 * static_cast<double>(calls.skipped), 4).c_str(), end, row.thesis);
  if (stopped)
    std::printf("  stopped at %.3f s", stopped_s);
  else if (!result.fault.empty())
    std::printf("  ended early: %s", result.fault.c_str());
  std::printf("\n");
  std::fflush(stdout);
}

void run_all(const RunOptions& options) {
  std::printf("%s at LoD 3, tolerance 2e-6, communication step %s s\n", options.file.c_str(),
              options.step.c_str());
  std::printf("%-7s %-4s %-4s %9s %9s %11s %11s %9s  %-16s  %s\n", "solver", "opt", "par", "wall s", "cpu s",
              "calls 1e6", "skipped 1e6", "error mm", "state hash", "thesis: time, calls 1e6");
  std::fflush(stdout);
  for (const Row& row : kRows) {
    if (options.wants(row.solver)) run(options, row);
  }
}

}  // namespace

int main(int argc, char** argv) {
  RunOptions options;
  options.file = TAKT_CONFIG_DIR "/scenarios/block_assembly.yaml";
  options.step = "0.008";
  CLI::App app("Table 5.4 of the thesis, ours beside it", "bench_calls");
  app.add_option("scenario", options.file, "Scenario file");
  takt::bench::add_run_options(app, options, false);
  return takt::bench::run_bench(app, argc, argv, [&] { run_all(options); });
}

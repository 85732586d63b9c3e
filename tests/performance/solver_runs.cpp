#include "tests/performance/solver_runs.h"

#include <CLI/CLI.hpp>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <stdexcept>

#include "server/geometry/convex/decomposition_cache.h"
#include "server/headless/headless_run.h"
#include "server/headless/report.h"
#include "server/scenario/scenario_builder.h"

namespace takt::bench {

namespace {
struct LimitReached : std::runtime_error {
  using std::runtime_error::runtime_error;
};
}  // namespace

void add_run_options(CLI::App& app, RunOptions& options, bool with_level) {
  if (with_level)
    app.add_option("--lod", options.level, "This level of detail only")->check(CLI::Range(1, 3));
  app.add_option("--solver", options.solver, "This solver only");
  app.add_option("--limit", options.limit_s, "Processor time after which a run is stopped (s); 0: none")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  app.add_option("--step", options.step, "Communication step of solvers with error control (s)");
}

int run_bench(CLI::App& app, int argc, char** argv, const std::function<void()>& run) {
  CLI11_PARSE(app, argc, argv);
  try {
    run();
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s: %s\n", app.get_name().c_str(), error.what());
    return 1;
  }
  return 0;
}

const char* Outcome::mark() const {
  if (refused) return "refused";
  if (instable) return "instable";
  if (broken) return "broken";
  if (stopped_s > 0.0) return "stopped";
  return error_m <= 1e-3 ? "" : "error";
}

Outcome run_solver(const SolverRun& run, const SolverRow& row) {
  ScenarioOptions options;
  if (run.level > 0) options.level_of_detail = run.level;
  char value[32];
  std::snprintf(value, sizeof value, "%.17g", row.value);
  if (row.solver[0] != '\0') {
    options.overrides = {std::string("solver.method=") + row.solver};
    if (solver_has_error_control(row.solver)) {
      options.overrides.push_back(std::string("solver.tolerance=") + value);
      if (!run.step.empty()) options.overrides.push_back("solver.step_s=" + run.step);
    } else {
      options.overrides.push_back(std::string("solver.step_s=") + value);
    }
  }
  Outcome outcome;
  Scenario scenario;
  std::shared_ptr<const CellModel> cell;
  try {
    scenario = read_scenario(run.file, options);
    cell = build_cell(scenario, {user_cache_directory(), nullptr});
  } catch (const ScenarioError& error) {
    if (row.solver[0] == '\0') throw;
    std::printf("  %s\n", error.what());
    outcome.refused = true;
    outcome.simulated_s = 1.0;
    return outcome;
  }
  Simulation simulation(cell);
  HeadlessOptions headless;
  headless.duration_s = scenario.duration_s;
  headless.program = scenario.controller_program;
  const std::clock_t begin = std::clock();
  const HeadlessResult result = run_headless(simulation, scenario, headless, {}, [&](double time_s) {
    const double used_s = static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC;
    if (run.limit_s <= 0.0 || used_s < run.limit_s || time_s <= 0.0) return;
    outcome.stopped_s = time_s;
    throw LimitReached("limit of processor time");
  });
  outcome.cpu_s = result.cpu_s;
  outcome.simulated_s = scenario.duration_s;
  if (outcome.stopped_s > 0.0) outcome.cpu_s *= scenario.duration_s / outcome.stopped_s;
  outcome.error_m = max_position_error_m(scenario, cell->description, result.final_state);
  outcome.instable = !result.fault.empty() && !(outcome.stopped_s > 0.0);
  for (const auto& change : result.changes) outcome.broken = outcome.broken || change.to < 0;
  for (const AssertionResult& demand : result.assertions) {
    ++outcome.demands;
    if (demand.verdict == AssertionResult::Verdict::failed) ++outcome.failed_demands;
  }
  outcome.work = result.statistics.solver;
  return outcome;
}

double thesis_seconds(const char* text) {
  const double value = std::atof(text);
  if (std::strstr(text, "min") != nullptr) return 60.0 * value;
  return std::strstr(text, " h") != nullptr ? 3600.0 * value : value;
}

void print_details_head(const std::string& title) {
  std::printf("%s\n  %-10s %-8s %9s %12s  %-9s %-12s  %8s %9s %10s %9s %9s\n", title.c_str(), "solver",
              "step/tol", "time s", "error mm", "mark", "thesis", "ratio", "steps", "evaluations",
              "Jacobians", "restarts");
  std::fflush(stdout);
}

void print_details(const SolverRow& row, const char* thesis, const Outcome& o) {
  char ratio[16] = "", error[16] = "";
  if (thesis_seconds(thesis) > 0.0)
    std::snprintf(ratio, sizeof ratio, "%.1f", thesis_seconds(thesis) / o.cpu_s);
  if (o.stopped_s <= 0.0) std::snprintf(error, sizeof error, "%.6f", 1e3 * o.error_m);
  std::printf("  %-10s %-8g %9.3f %12s  %-9s %-12s  %8s %9llu %10llu %9llu %9llu", row.solver, row.value,
              o.cpu_s, error, o.mark(), thesis, ratio, static_cast<unsigned long long>(o.work.steps),
              static_cast<unsigned long long>(o.work.evaluations),
              static_cast<unsigned long long>(o.work.jacobians),
              static_cast<unsigned long long>(o.work.restarts));
  if (o.stopped_s > 0.0) std::printf("  stopped at %.3f s", o.stopped_s);
  std::printf("\n");
  std::fflush(stdout);
}

void run_rows(const RunOptions& options, const std::vector<SolverRow>& rows, const std::string& scenario,
              const std::string& title) {
  std::vector<Outcomes> outcomes(rows.size());
  for (const int level : {1, 2, 3}) {
    if (!options.wants_level(level)) continue;
    print_details_head(scenario + ", LoD " + std::to_string(level));
    const auto k = static_cast<std::size_t>(level - 1);
    for (std::size_t i = 0; i < rows.size(); ++i) {
      if (!options.wants(rows[i].solver)) continue;
      outcomes[i][k] = run_solver({options.file, level, options.limit_s, options.step}, rows[i]);
      print_details(rows[i], rows[i].thesis[k], *outcomes[i][k]);
    }
  }
  print_table(title, rows, outcomes);
}

std::string cell_of_table(const std::optional<Outcome>& o) {
  if (!o) return "";
  char text[32];
  const char* mark = o->mark();
  if (std::strcmp(mark, "refused") == 0 || std::strcmp(mark, "instable") == 0 ||
      std::strcmp(mark, "broken") == 0)
    return mark;
  if (o->stopped_s > 0.0)
    std::snprintf(text, sizeof text, "~%.0f s", o->cpu_s);
  else
    std::snprintf(text, sizeof text, "%.*f s %s", o->cpu_s < 10.0 ? 2 : 1, o->cpu_s, mark);
  return text;
}

void print_table(const std::string& title, const std::vector<SolverRow>& rows,
                 const std::vector<Outcomes>& outcomes) {
  std::printf("\n%s\n  %-10s %-8s", title.c_str(), "solver", "step/tol");
  for (const int level : {1, 2, 3}) std::printf("  %-14s%-14s", ("LoD " + std::to_string(level)).c_str(), "");
  std::printf("\n");
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const SolverRow& row = rows[i];
    if (!outcomes[i][0] && !outcomes[i][1] && !outcomes[i][2]) continue;
    std::printf("  %-10s %-8g", row.solver, row.value);
    for (std::size_t k = 0; k < 3; ++k) {
      const std::string thesis = row.thesis[k][0] == '\0' ? "" : "(" + std::string(row.thesis[k]) + ")";
      std::printf("  %-14s%-14s", cell_of_table(outcomes[i][k]).c_str(), thesis.c_str());
    }
    std::printf("\n");
  }
  std::printf("~: stopped at the limit of processor time, extrapolated (--limit 0: none is)\n");
}

}  // namespace takt::bench

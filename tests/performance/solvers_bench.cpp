// Table 5.1 of the thesis: the block scenario with every solver, step and tolerance at levels of detail 1, 2
// and 3, our computation times beside the thesis' (i7-11700K, Dymola), marked by its criteria (5.18, 5.19):
// "error" ends more than 1 mm off, "instable" was aborted, "broken" lost a connection. What needs more
// processor time than the limit is stopped and its time extrapolated: "~".
//   bench_solvers [SCENARIO.yaml] [--lod N] [--solver NAME] [--limit SECONDS (30; 0: none)] [--step SECONDS]
#include <array>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <iterator>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "server/headless/headless_run.h"
#include "server/headless/report.h"
#include "server/scenario/scenario_builder.h"

namespace {

struct Row {
  const char* solver;
  double value;               ///< step (s) or tolerance
  const char* thesis_solver;  ///< empty: not in the thesis
  const char* thesis[3];      ///< per level of detail
};

constexpr Row kRows[] = {
    {"rk2", 1e-6, "Rkfix2", {"54 min", "65 min", "15 h error"}},
    {"rk2", 1e-5, "Rkfix2", {"343 s", "394 s", "broken"}},
    {"rk2", 1e-4, "Rkfix2", {"34.3 s", "39.9 s", "instable"}},
    {"rk2", 2e-4, "Rkfix2", {"17.2 s", "20.8 s", "instable"}},
    {"rk2", 1e-3, "Rkfix2", {"3.9 s", "instable", "instable"}},
    {"rk2", 1e-2, "Rkfix2", {"broken", "instable", "instable"}},
    {"rk4", 2e-4, "", {"", "", ""}},
    {"rk4", 1e-3, "", {"", "", ""}},
    {"implicit", 2e-4, "", {"", "", ""}},
    {"implicit", 1e-3, "", {"", "", ""}},
    {"implicit", 2e-3, "", {"", "", ""}},
    {"rosenbrock", 1e-4, "", {"", "", ""}},
    {"rosenbrock", 1e-3, "", {"", "", ""}},
    {"ida", 1e-6, "DASSL", {"6.6 s", "7.7 s", "501 s"}},
    {"ida", 2e-6, "DASSL", {"5.9 s", "7.0 s", "405 s"}},
    {"ida", 1e-5, "DASSL", {"5.3 s", "6.3 s", "255 s"}},
    {"ida", 1e-4, "DASSL", {"5.0 s", "5.9 s", "144 s"}},
    {"ida", 1e-3, "DASSL", {"4.8 s", "5.9 s error", "instable"}},
    {"ida", 1e-2, "DASSL", {"4.7 s error", "5.8 s error", "instable"}},
    {"cvode", 1e-6, "Cvode", {"5.0 s", "5.9 s", "148 s"}},
    {"cvode", 1e-5, "Cvode", {"4.5 s", "5.2 s", "106 s"}},
    {"cvode", 1e-4, "Cvode", {"4.2 s", "4.9 s", "148 s error"}},
    {"cvode", 1e-3, "Cvode", {"4.1 s error", "4.8 s error", "broken"}},
    {"esdirk", 1e-6, "Esdirk45a", {"6.0 s", "6.9 s", "439 s"}},
    {"esdirk", 1e-5, "Esdirk45a", {"4.2 s", "5.0 s", "270 s"}},
    {"esdirk", 1e-4, "Esdirk45a", {"4.0 s", "4.5 s", "206 s"}},
    {"esdirk", 1e-3, "Esdirk45a", {"3.6 s error", "4.3 s error", "193 s"}},
    {"esdirk", 1e-2, "Esdirk45a", {"4.1 s error", "4.3 s error", "235 s error"}},
};

struct Arguments {
  std::string file = TAKT_CONFIG_DIR "/scenarios/block_assembly.yaml";
  std::string step;    ///< communication step of solvers with error control (s); empty: the scenario's own
  std::string solver;  ///< this one only; empty: all
  int level = 0;       ///< this one only; 0: all
  double limit_s = 30.0;
};

struct Outcome {
  double cpu_s = 0.0;      ///< extrapolated where the run was stopped
  double stopped_s = 0.0;  ///< simulated time at which the limit was reached; 0: it was not
  double error_m = 0.0;
  bool instable = false, broken = false;
  takt::SolverStatistics work;

  const char* mark() const {
    if (instable) return "instable";
    if (broken) return "broken";
    if (stopped_s > 0.0) return "stopped";
    return error_m <= 1e-3 ? "" : "error";
  }
};

struct LimitReached : std::runtime_error {
  using std::runtime_error::runtime_error;
};

Outcome run(const Arguments& arguments, const Row& row, int level_of_detail) {
  takt::ScenarioOptions options;
  options.level_of_detail = level_of_detail;
  char value[32];
  std::snprintf(value, sizeof value, "%.17g", row.value);
  options.overrides = {std::string("solver.method=") + row.solver};
  if (takt::solver_has_error_control(row.solver)) {
    options.overrides.push_back(std::string("solver.tolerance=") + value);
    if (!arguments.step.empty()) options.overrides.push_back("solver.step_s=" + arguments.step);
  } else {
    options.overrides.push_back(std::string("solver.step_s=") + value);
  }
  const takt::Scenario scenario = takt::read_scenario(arguments.file, options);
  const auto cell = takt::build_cell(scenario);
  takt::Simulation simulation(cell);
  takt::HeadlessOptions headless;
  headless.duration_s = scenario.duration_s;
  headless.program = scenario.controller_program;
  Outcome outcome;
  const std::clock_t begin = std::clock();
  const takt::HeadlessResult result =
      takt::run_headless(simulation, scenario, headless, {}, [&](double time_s) {
        const double used_s = static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC;
        if (arguments.limit_s <= 0.0 || used_s < arguments.limit_s) return;
        outcome.stopped_s = time_s;
        throw LimitReached("limit of processor time");
      });
  outcome.cpu_s = result.cpu_s;
  if (outcome.stopped_s > 0.0) outcome.cpu_s *= scenario.duration_s / outcome.stopped_s;
  outcome.error_m = takt::max_position_error_m(scenario, cell->description, result.final_state);
  outcome.instable = !result.fault.empty() && !(outcome.stopped_s > 0.0);
  for (const auto& change : result.changes) outcome.broken = outcome.broken || change.to < 0;
  outcome.work = result.statistics.solver;
  return outcome;
}

double thesis_seconds(const char* text) {
  const double value = std::atof(text);
  if (std::strstr(text, "min") != nullptr) return 60.0 * value;
  return std::strstr(text, " h") != nullptr ? 3600.0 * value : value;
}

void print_details(const Row& row, const char* thesis, const Outcome& o) {
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

/// A cell of the table as the thesis prints it: a time, with the mark where it is worth one.
std::string cell_of_table(const std::optional<Outcome>& o) {
  if (!o) return "";
  char text[32];
  const char* mark = o->mark();
  if (std::strcmp(mark, "instable") == 0 || std::strcmp(mark, "broken") == 0) return mark;
  if (o->stopped_s > 0.0)
    std::snprintf(text, sizeof text, "~%.0f s", o->cpu_s);
  else
    std::snprintf(text, sizeof text, "%.*f s %s", o->cpu_s < 10.0 ? 2 : 1, o->cpu_s, mark);
  return text;
}

using Outcomes = std::array<std::optional<Outcome>, 3>;

void print_table(const std::vector<Outcomes>& outcomes) {
  std::printf("\nTable 5.1: computation time for 42 s, ours and (thesis)\n  %-10s %-8s", "solver",
              "step/tol");
  for (const int level : {1, 2, 3}) std::printf("  %-14s%-14s", ("LoD " + std::to_string(level)).c_str(), "");
  std::printf("\n");
  for (std::size_t i = 0; i < std::size(kRows); ++i) {
    const Row& row = kRows[i];
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

Arguments read_arguments(int argc, char** argv) {
  Arguments arguments;
  for (int i = 1; i < argc; ++i) {
    const std::string key = argv[i];
    if (key.rfind("--", 0) != 0) {
      arguments.file = key;
      continue;
    }
    const char* value = i + 1 < argc ? argv[++i] : "";
    if (key == "--lod")
      arguments.level = std::atoi(value);
    else if (key == "--solver")
      arguments.solver = value;
    else if (key == "--limit")
      arguments.limit_s = std::atof(value);
    else if (key == "--step")
      arguments.step = value;
    else
      throw std::invalid_argument("unknown option '" + key + "'; there are --lod, --solver, --limit, --step");
  }
  return arguments;
}

void run_all(const Arguments& arguments) {
  std::vector<Outcomes> outcomes(std::size(kRows));
  for (const int level : {1, 2, 3}) {
    if (arguments.level != 0 && level != arguments.level) continue;
    std::printf("LoD %d\n  %-10s %-8s %9s %12s  %-9s %-12s  %8s %9s %10s %9s %9s\n", level, "solver",
                "step/tol", "time s", "error mm", "mark", "thesis", "ratio", "steps", "evaluations",
                "Jacobians", "restarts");
    std::fflush(stdout);
    const auto k = static_cast<std::size_t>(level - 1);
    for (std::size_t i = 0; i < std::size(kRows); ++i) {
      const Row& row = kRows[i];
      if (!arguments.solver.empty() && arguments.solver != row.solver) continue;
      outcomes[i][k] = run(arguments, row, level);
      print_details(row, row.thesis[k], *outcomes[i][k]);
    }
  }
  print_table(outcomes);
}

}  // namespace

int main(int argc, char** argv) {
  try {
    run_all(read_arguments(argc, argv));
  } catch (const std::exception& error) {
    std::fprintf(stderr, "bench_solvers: %s\n", error.what());
    return 1;
  }
  return 0;
}

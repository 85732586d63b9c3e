// Table 5.1 of the thesis: the block scenario with every solver, step and tolerance,
// our computation times beside the thesis' (i7-11700K, Dymola), marked by its criteria (5.18, 5.19): "error"
// ends more than 1 mm off, "instable" was aborted, "broken" lost a connection. Steps below 5e-6 s, and at LoD
// 3 below 1e-4 s, take minutes: --all. One level alone: --lod N.
#include <cstdio>
#include <cstdlib>
#include <cstring>
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

struct Outcome {
  double cpu_s = 0.0, error_m = 0.0;
  bool instable = false, broken = false;
  takt::SolverStatistics work;
};

Outcome run(const std::string& file, const Row& row, int level_of_detail, const std::string& step) {
  takt::ScenarioOptions options;
  options.level_of_detail = level_of_detail;
  char value[32];
  std::snprintf(value, sizeof value, "%.17g", row.value);
  options.overrides = {std::string("solver.method=") + row.solver};
  if (takt::solver_has_error_control(row.solver)) {
    options.overrides.push_back(std::string("solver.tolerance=") + value);
    options.overrides.push_back("solver.step_s=" + step);
  } else {
    options.overrides.push_back(std::string("solver.step_s=") + value);
  }
  const takt::Scenario scenario = takt::read_scenario(file, options);
  const auto cell = takt::build_cell(scenario);
  takt::Simulation simulation(cell);
  takt::HeadlessOptions headless;
  headless.duration_s = scenario.duration_s;
  headless.program = scenario.controller_program;
  const takt::HeadlessResult result = takt::run_headless(simulation, scenario, headless);
  Outcome outcome;
  outcome.cpu_s = result.cpu_s;
  outcome.error_m = takt::max_position_error_m(scenario, cell->description, result.final_state);
  outcome.instable = !result.fault.empty();
  for (const auto& change : result.changes) outcome.broken = outcome.broken || change.to < 0;
  outcome.work = result.statistics.solver;
  return outcome;
}

}  // namespace

int main(int argc, char** argv) {
  bool all = false;
  int only = 0;
  std::string file = TAKT_CONFIG_DIR "/scenarios/block_assembly.yaml", step = "0.001";
  for (int i = 1; i < argc; ++i) {
    if (std::strcmp(argv[i], "--all") == 0)
      all = true;
    else if (std::strcmp(argv[i], "--lod") == 0 && i + 1 < argc)
      only = std::atoi(argv[++i]);
    else if (std::strcmp(argv[i], "--step") == 0 && i + 1 < argc)
      step = argv[++i];
    else
      file = argv[i];
  }
  for (const int level : {1, 2, 3}) {
    if (only != 0 && level != only) continue;
    std::printf("%sBlock scenario, LoD %d; communication step with error control: %s s\n",
                level > 1 && only == 0 ? "\n" : "", level, step.c_str());
    std::printf("  %-10s %-8s %9s %10s  %-9s %-12s  %9s %9s %10s %9s %9s\n", "solver", "step/tol", "time s",
                "error mm", "mark", "thesis", "ratio", "steps", "evaluations", "Jacobians", "restarts");
    for (const Row& row : kRows) {
      const double least = level == 3 ? 9e-5 : 5e-6;
      if (!all && row.value < least && !takt::solver_has_error_control(row.solver)) continue;
      Outcome o;
      try {
        o = run(file, row, level, step);
      } catch (const std::exception& error) {
        std::printf("  not available: %s\n", error.what());
        break;
      }
      const char* thesis = row.thesis[level - 1];
      double thesis_s = std::atof(thesis);
      if (std::strstr(thesis, "min") != nullptr) thesis_s *= 60.0;
      if (std::strstr(thesis, " h") != nullptr) thesis_s *= 3600.0;
      char ratio[16] = "";
      if (thesis_s > 0.0) std::snprintf(ratio, sizeof ratio, "%.1f", thesis_s / o.cpu_s);
      std::printf("  %-10s %-8g %9.3f %10.6f  %-9s %-12s  %9s %9llu %10llu %9llu %9llu\n", row.solver,
                  row.value, o.cpu_s, 1e3 * o.error_m,
                  o.instable             ? "instable"
                  : o.broken             ? "broken"
                  : !(o.error_m <= 1e-3) ? "error"
                                         : "",
                  thesis, ratio, static_cast<unsigned long long>(o.work.steps),
                  static_cast<unsigned long long>(o.work.evaluations),
                  static_cast<unsigned long long>(o.work.jacobians),
                  static_cast<unsigned long long>(o.work.restarts));
      std::fflush(stdout);
    }
  }
  return 0;
}

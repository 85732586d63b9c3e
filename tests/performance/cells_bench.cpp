// The industrial cells of the thesis: Table 5.5 (motor into the chainsaw's housing, every solver, step and
// tolerance at levels of detail 1, 2 and 3), the times of section 5.5.3 (rotor), the import of the housing,
// all beside the thesis' figures (i7-11700K, Dymola), and our goals: reached or missed.
//   bench_cells [table] [goals] [--lod N] [--solver NAME] [--limit SECONDS (60; 0: none)] [--step SECONDS]
// Without `table` or `goals`: both.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <ctime>
#include <string>
#include <vector>

#include "server/geometry/convex/decomposition_cache.h"
#include "server/scenario/scenario_builder.h"
#include "tests/performance/solver_runs.h"

namespace {

using namespace takt::bench;

const std::string kChainsaw = TAKT_CONFIG_DIR "/scenarios/chainsaw_motor.yaml";
const std::string kRotor = TAKT_CONFIG_DIR "/scenarios/bev_rotor.yaml";
const std::string kFurnace = TAKT_CONFIG_DIR "/scenarios/furnace.yaml";

const std::vector<SolverRow> kRows{
    {"rk2", 2e-6, "Rkfix2", {"105 min", "108 min", "8 h error"}},
    {"rk2", 1e-5, "Rkfix2", {"21 min", "21 min", "instable"}},
    {"rk2", 2e-4, "Rkfix2", {"32.7 s", "29.2 s", "instable"}},
    {"rk2", 1e-3, "Rkfix2", {"6.4 s", "instable", "instable"}},
    {"rk2", 1e-2, "Rkfix2", {"0.14 s error", "instable", "instable"}},
    {"implicit", 1e-3, "", {"", "", ""}},
    {"rosenbrock", 1e-4, "", {"", "", ""}},
    {"ida", 1e-7, "DASSL", {"22.3 s", "14.7 s", "734 s"}},
    {"ida", 5e-7, "DASSL", {"12.8 s", "14.4 s", "334 s"}},
    {"ida", 1e-6, "DASSL", {"11.5 s", "12.7 s", "225 s"}},
    {"cvode", 1e-7, "Cvode", {"9.6 s", "9.0 s", "154 s"}},
    {"cvode", 5e-7, "Cvode", {"8.2 s", "8.8 s", "112 s"}},
    {"cvode", 1e-6, "Cvode", {"7.6 s", "9.7 s", "104 s"}},
    {"esdirk", 1e-7, "Esdirk45a", {"15.4 s", "15.1 s", "370 s"}},
    {"esdirk", 5e-7, "Esdirk45a", {"13.7 s", "14.0 s", "236 s"}},
    {"esdirk", 1e-6, "Esdirk45a", {"11.5 s", "12.2 s", "197 s"}},
};

struct Goal {
  const char* what;
  const std::string& file;
  int level;        ///< 0: that of the scenario
  double limit;     ///< largest computation ratio
  double thesis_s;  ///< best computation time in the thesis; 0: not in the thesis
  const char* thesis_is;
};

void print_mark(bool reached) {
  std::printf("  %s\n", reached ? "reached" : "MISSED");
}

void run_goals(const RunOptions& options) {
  const Goal goals[] = {
      {"chainsaw, LoD 1", kChainsaw, 1, 0.01, 6.4, "Rkfix2, 1 ms"},
      {"chainsaw, LoD 2", kChainsaw, 2, 0.05, 8.8, "Cvode, 5e-7"},
      {"chainsaw, LoD 3", kChainsaw, 3, 1.0, 104.0, "Cvode, 1e-6"},
      {"rotor, LoD 1", kRotor, 1, 0.02, 41.1, "Rkfix2, 2 ms"},
      {"rotor, LoD 2", kRotor, 2, 1.0, 77.6, "Cvode, 1e-5"},
      {"rotor, hybrid (LoD 1 to 3)", kRotor, 0, 1.0, 1099.0, "Cvode, 1e-5"},
      {"furnace, 10 000 s", kFurnace, 0, 0.01, 0.0, ""},
  };
  std::printf(
      "\nSections 5.4.2 and 5.5.3, with the solvers of our scenario files\n  %-28s %10s %12s %10s %12s %8s "
      "%9s\n",
      "cell", "time s", "real-time", "goal", "thesis s", "ratio", "held");
  std::fflush(stdout);
  for (const Goal& goal : goals) {
    if (!options.wants_level(goal.level)) continue;
    const Outcome o = run_solver({goal.file, goal.level, 0.0, ""}, {"", 0.0, "", {"", "", ""}});
    // A magnet that falls out of the press loses its partner correctly: the assertions decide.
    const bool sound = !o.instable && o.failed_demands == 0 && o.error_m <= 1e-3;
    std::printf("  %-28s %10.3f %12.5f %10g", goal.what, o.cpu_s, o.computation_ratio(), goal.limit);
    if (goal.thesis_s > 0.0)
      std::printf(" %12.1f %8.1f", goal.thesis_s, goal.thesis_s / o.cpu_s);
    else
      std::printf(" %12s %8s", "", "");
    std::printf(" %5d/%-3d", o.demands - o.failed_demands, o.demands);
    print_mark(sound && o.computation_ratio() <= goal.limit);
    if (!sound)
      std::printf("      %s, %.3f mm off, %d demands failed\n", o.mark(), 1e3 * o.error_m, o.failed_demands);
    std::fflush(stdout);
  }
}

/// The housing, with the hierarchy for contact, and its decomposition from the cache.
void run_import() {
  std::size_t triangles = 0;
  const auto build = [&](int level) {
    takt::ScenarioOptions options;
    options.level_of_detail = level;
    const std::clock_t begin = std::clock();
    const auto cell =
        takt::build_cell(takt::read_scenario(kChainsaw, options), {takt::user_cache_directory(), nullptr});
    const double cpu_s = static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC;
    const auto housing = static_cast<std::size_t>(cell->description.find_component("Housing"));
    triangles = cell->description.components[housing].mesh->triangles.size() / 3;
    return cpu_s;
  };
  build(1);  // fills the cache
  const double kinematic_s = build(1), contact_s = build(3);
  std::printf(
      "\nImport of the whole chainsaw cell (housing of %zu triangles), decomposition cached\n"
      "  LoD 1 %.2f s, LoD 3 (hierarchies for contact) %.2f s of processor time; goal: 2 s",
      triangles, kinematic_s, contact_s);
  print_mark(contact_s <= 2.0);
}

}  // namespace

int main(int argc, char** argv) {
  RunOptions options;
  options.file = kChainsaw;
  std::vector<std::string> words;
  CLI::App app("The industrial cells of the thesis, beside its times", "bench_cells");
  app.add_option("words", words, "table, goals; none: both")->check(CLI::IsMember({"table", "goals"}));
  add_run_options(app, options, true);
  return run_bench(app, argc, argv, [&] {
    const auto wants = [&](const char* word) {
      return words.empty() || std::find(words.begin(), words.end(), word) != words.end();
    };
    if (wants("goals")) {
      run_goals(options);
      run_import();
    }
    if (wants("table"))
      run_rows(options, kRows, "Chainsaw", "Table 5.5: computation time for 30 s, ours and (thesis)");
  });
}

// Table 5.1 of the thesis: the block scenario with every solver, step and tolerance at levels of detail 1, 2
// and 3, our computation times beside the thesis' (i7-11700K, Dymola), marked by its criteria (5.18, 5.19):
// "error" ends more than 1 mm off, "instable" was aborted, "broken" lost a connection. A run beyond the limit
// of processor time is stopped and its time extrapolated: "~".
//   bench_solvers [SCENARIO.yaml] [--lod N] [--solver NAME] [--limit SECONDS (30; 0: none)] [--step SECONDS]
#include <CLI/CLI.hpp>
#include <string>
#include <vector>

#include "tests/performance/solver_runs.h"

namespace {

using namespace takt::bench;

const std::vector<SolverRow> kRows{
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

}  // namespace

int main(int argc, char** argv) {
  RunOptions options;
  options.file = TAKT_CONFIG_DIR "/scenarios/block_assembly.yaml";
  options.limit_s = 30.0;
  CLI::App app("Table 5.1 of the thesis, ours beside it", "bench_solvers");
  app.add_option("scenario", options.file, "Scenario file");
  add_run_options(app, options, true);
  return run_bench(app, argc, argv, [&] {
    run_rows(options, kRows, "Block scenario", "Table 5.1: computation time for 42 s, ours and (thesis)");
  });
}

#pragma once
// Runs of a scenario with a given solver, judged as the thesis' tables do (criteria 5.18, 5.19): "error" ends
// more than 1 mm off, "instable" was aborted, "broken" lost a connection. A run beyond the limit of processor
// time is stopped and its time extrapolated.
#include <array>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "server/simulation/solver/integrator.h"

namespace CLI {
class App;
}

namespace takt::bench {

struct SolverRow {
  const char* solver;  ///< empty: that of the scenario
  double value;        ///< step (s) or tolerance
  const char* thesis_solver;
  const char* thesis[3];  ///< per level of detail; empty: not in the thesis
};

struct SolverRun {
  std::string file;
  int level = 1;  ///< 0: that of the scenario
  double limit_s = 30.0;
  std::string step;  ///< communication step of solvers with error control (s); empty: the scenario's own
};

/// Options on the command line of a bench of solvers.
struct RunOptions {
  std::string file;
  std::string step;    ///< communication step of solvers with error control (s); empty: the scenario's own
  std::string solver;  ///< this one only; empty: all
  int level = 0;       ///< this level of detail only; 0: all
  double limit_s = 60.0;

  bool wants(const char* name) const { return solver.empty() || solver == name; }
  bool wants_level(int n) const { return level == 0 || level == n; }
};
/// --solver, --limit, --step; with_level: --lod. The present values of the options are their defaults.
void add_run_options(CLI::App& app, RunOptions& options, bool with_level);
/// Reads the command line and runs; returns the program's exit code, with an error in one line on stderr.
int run_bench(CLI::App& app, int argc, char** argv, const std::function<void()>& run);

struct Outcome {
  double cpu_s = 0.0;      ///< extrapolated where the run was stopped
  double stopped_s = 0.0;  ///< simulated time at which the limit was reached; 0: it was not
  double simulated_s = 0.0;
  double error_m = 0.0;
  bool instable = false, broken = false;
  bool refused = false;                 ///< when it was loaded
  int demands = 0, failed_demands = 0;  ///< assertions of the scenario
  SolverStatistics work;

  const char* mark() const;
  double computation_ratio() const { return cpu_s / simulated_s; }
};

Outcome run_solver(const SolverRun& run, const SolverRow& row);

/// "6.6 s", "54 min", "15 h error" in seconds; 0: no time.
double thesis_seconds(const char* text);
/// A cell of the table as the thesis prints it: a time, with the mark if there is one.
std::string cell_of_table(const std::optional<Outcome>& outcome);

using Outcomes = std::array<std::optional<Outcome>, 3>;
/// All rows with an outcome, levels side by side.
void print_table(const std::string& title, const std::vector<SolverRow>& rows,
                 const std::vector<Outcomes>& outcomes);
/// Head of, and one row of the list of runs.
void print_details_head(const std::string& title);
void print_details(const SolverRow& row, const char* thesis, const Outcome& outcome);
/// Runs the selected rows at levels 1 to 3, printing each, then the table.
void run_rows(const RunOptions& options, const std::vector<SolverRow>& rows, const std::string& scenario,
              const std::string& title);

}  // namespace takt::bench

#pragma once
// `takt-run study SCENARIO --vary KEY=FROM:TO:N`: the same scenario with other values, every combination a run of
// its own, several at once, each a process. Results are stored beside the table, so that an interrupted study
// continues.
#include <filesystem>
#include <iosfwd>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "server/headless/table.h"

namespace takt {

/// Begins a note of takt-run on its error output.
inline constexpr std::string_view kNoteOfRun = "takt-run: note: ";

struct VariedKey {
  std::string key;  ///< dotted, as for --set
  double from = 0.0, to = 0.0;
  int count = 1;  ///< values, evenly spaced, both ends included
  double value(int i) const { return count < 2 ? from : from + (to - from) * i / (count - 1); }
};
/// "key=from:to:n". Throws ScenarioError.
VariedKey parse_varied_key(const std::string& text);

struct StudyOptions {
  std::filesystem::path executable;  ///< takt-run
  std::string scenario;
  std::vector<std::string> arguments;  ///< for every run, besides scenario, values and report
  std::vector<VariedKey> keys;
  std::filesystem::path
      table;         ///< CSV; single runs go into TABLE.runs, plot and page beside it as .svg, .html
  std::string plot;  ///< column; empty: the result that changes most
  int jobs = 1;      ///< processes at once
  /// Of `tasks` processes that share the runs, this one does run `task`, task + tasks, ... With more than one
  /// task: they may work at the same time, on several machines, and do not write the table.
  int task = 0, tasks = 1;
  bool bar = false;  ///< show a bar with the time left on the error output, where that is a terminal
};

int study_runs(const StudyOptions& options);
/// Values of a run, in the order of the keys; the last key varies fastest.
std::vector<double> study_values(const StudyOptions& options, int run);

/// Runs the missing combinations, and writes table, plot and page. Throws ScenarioError if runs refuse their
/// arguments, the directory belongs to another study, or another process works on it. Returns the number of
/// runs finished earlier.
int run_study(const StudyOptions& options, std::ostream& progress);

/// "I/N": task I of N. Throws ScenarioError.
std::pair<int, int> parse_task(const std::string& text);

/// Writes the files that submit the study to Slurm: submit.sh, study.sbatch (an array job, a task for each
/// run, up to 1000) and table.sbatch (after it). Files of the study are in the table's directory, which all
/// machines must share.
void write_slurm_job(const StudyOptions& options, const std::filesystem::path& directory);

/// The table of all available reports.
Table study_table(const StudyOptions& options);

}  // namespace takt

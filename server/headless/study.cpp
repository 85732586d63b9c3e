#include "server/headless/study.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/file.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <iterator>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <ostream>
#include <sstream>

#include "idl/common/atomic_file.h"
#include "idl/common/parse.h"
#include "idl/common/text.h"
#include "server/headless/progress.h"
#include "server/headless/study_page.h"
#include "server/scenario/scenario_reader.h"

namespace takt {

namespace {

using Json = nlohmann::ordered_json;
namespace fs = std::filesystem;

constexpr int kMaxRuns = 1000000;

bool is_count(double number) {
  return number >= 0.0 && number <= kMaxRuns && number == std::floor(number);
}

fs::path directory_of(const StudyOptions& options) {
  fs::path directory = options.table;
  directory += ".runs";
  return directory;
}

fs::path file_of(const StudyOptions& options, int run, const char* extension) {
  char name[32];
  std::snprintf(name, sizeof name, "%06d", run);
  return directory_of(options) / (std::string(name) + extension);
}

std::string content(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

/// A name beside a file, unique among processes and machines.
fs::path part_of(const fs::path& file) {
  char host[65] = "";
  gethostname(host, sizeof host - 1);
  fs::path part = file;
  part += std::string(".") + host + "." + std::to_string(getpid()) + ".part";
  return part;
}

void write_whole(const fs::path& file, const std::string& text) {
  if (const std::error_code error = replace_file(file, {text}))
    throw std::runtime_error(file.string() + ": cannot be written: " + error.message());
}

/// Identity of a study.
std::string manifest(const StudyOptions& options) {
  Json keys = Json::array();
  for (const VariedKey& key : options.keys)
    keys.push_back({{"key", key.key}, {"from", key.from}, {"to", key.to}, {"count", key.count}});
  const Json all{{"scenario", content(options.scenario)}, {"arguments", options.arguments}, {"keys", keys}};
  return all.dump(1);
}

/// Lock of the directory during work on it: by one process alone, or shared by the tasks of an array job.
class DirectoryLock {
 public:
  DirectoryLock(const fs::path& directory, bool shared) {
    descriptor_ = open((directory / "lock").c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0644);
    if (descriptor_ < 0) throw std::runtime_error(directory.string() + ": cannot be written");
    if (flock(descriptor_, (shared ? LOCK_SH : LOCK_EX) | LOCK_NB) != 0) {
      close(descriptor_);
      throw ScenarioError(directory.string() +
                          ": another process is working on this study; wait for it, or end it");
    }
  }
  ~DirectoryLock() { close(descriptor_); }
  DirectoryLock(const DirectoryLock&) = delete;
  DirectoryLock& operator=(const DirectoryLock&) = delete;

 private:
  int descriptor_ = -1;
};

/// Holds why a run refused its arguments: this study has no end.
fs::path refusal_of(const StudyOptions& options) {
  return directory_of(options) / "refused";
}

/// The cell of the first run.
fs::path picture_of(const StudyOptions& options) {
  return directory_of(options) / "cell.png";
}

/// Files of runs with this extension.
std::vector<fs::path> files_of_runs(const StudyOptions& options, const char* extension) {
  std::vector<fs::path> files;
  for (const fs::directory_entry& entry : fs::directory_iterator(directory_of(options)))
    if (entry.path().extension() == extension && entry.path().filename() != "study.json")
      files.push_back(entry.path());
  return files;
}

/// A directory belongs to one study. It passes on from a study that has no end, or no finished run.
void claim_directory(const StudyOptions& options) {
  const fs::path directory = directory_of(options), file = directory / "study.json";
  fs::create_directories(directory);
  const std::string wanted = manifest(options);
  if (!fs::exists(file)) {
    write_whole(file, wanted);
    return;
  }
  if (content(file) != wanted) {
    if (!files_of_runs(options, ".json").empty() && !fs::exists(refusal_of(options)))
      throw ScenarioError(
          directory.string() +
          ": holds the runs of another study (scenario, keys or options differ); allowed: the same "
          "study again, another --table, or remove the directory");
    const DirectoryLock lock(directory, false);
    for (const char* extension : {".json", ".log"})
      for (const fs::path& file_of_run : files_of_runs(options, extension)) fs::remove(file_of_run);
    write_whole(file, wanted);
  }
  fs::remove(refusal_of(options));
}

/// Remains of runs whose study was killed.
void remove_parts(const StudyOptions& options) {
  for (const fs::path& part : files_of_runs(options, ".part")) fs::remove(part);
}

/// Whether its report exists and is complete.
bool is_done(const StudyOptions& options, int run) {
  const fs::path file = file_of(options, run, ".json");
  return fs::exists(file) && Json::accept(content(file));
}

/// A run as a process of its own, which ends with this one, even if this one is killed; its messages go to a
/// file.
pid_t start(const StudyOptions& options, int run) {
  std::vector<std::string> arguments{options.executable.string(),
                                     "run",
                                     options.scenario,
                                     "--quiet",
                                     "--report",
                                     part_of(file_of(options, run, ".json")).string()};
  arguments.insert(arguments.end(), options.arguments.begin(), options.arguments.end());
  if (run == 0) arguments.insert(arguments.end(), {"--picture", picture_of(options).string() + "@0"});
  const std::vector<double> values = study_values(options, run);
  for (std::size_t i = 0; i < values.size(); ++i) {
    arguments.push_back("--set");
    arguments.push_back(options.keys[i].key + "=" + exact_text(values[i]));
  }
  std::vector<char*> argv;
  for (std::string& argument : arguments) argv.push_back(argument.data());
  argv.push_back(nullptr);
  const std::string log = file_of(options, run, ".log").string();
  const pid_t parent = getpid(), pid = fork();
  if (pid < 0) throw std::runtime_error(std::string("fork: ") + std::strerror(errno));
  if (pid == 0) {
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    if (getppid() != parent) _exit(126);  // the parent died earlier
    const int messages = open(log.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0644);
    if (messages >= 0) dup2(messages, STDERR_FILENO);
    execv(argv.front(), argv.data());
    _exit(127);
  }
  return pid;
}

/// Adds those notes in the messages of a run that no other run had.
void take_notes(const fs::path& log, std::vector<std::string>& notes) {
  std::ifstream in(log);
  for (std::string line; std::getline(in, line);)
    if (line.starts_with(kNoteOfRun) && std::find(notes.begin(), notes.end(), line) == notes.end())
      notes.push_back(line);
}

void add_row(const StudyOptions& options, int run, Table& table) {
  const Json report = Json::parse(content(file_of(options, run, ".json")));
  table.begin_row();
  table.set("run", std::to_string(run));
  const std::vector<double> values = study_values(options, run);
  for (std::size_t i = 0; i < values.size(); ++i) table.set(options.keys[i].key, values[i]);
  if (report.contains("verdict")) table.set("verdict", report["verdict"].get<std::string>());
  table.set("fault", report["fault"].is_null() ? "" : report["fault"].get<std::string>());
  if (report.contains("max_position_error"))
    table.set("max_position_error", report["max_position_error"].get<double>());
  table.set("computation_ratio", report["computation_ratio"].get<double>());
  if (report.contains("contacts")) {
    for (const Json& most : report["contacts"]["largest"]) {
      const std::string pair = most["base"].get<std::string>() + "|" + most["target"].get<std::string>();
      table.set(pair + ".normal_force", most["normal_force"].get<double>());
      table.set(pair + ".time", most["time"].get<double>());
    }
  }
  for (const auto& [name, consumer] : report["power"]["consumers"].items())
    table.set(name + ".electrical_energy", consumer["electrical_energy"].get<double>());
  if (report.contains("assertions"))
    for (const auto& [name, verdict] : report["assertions"].items())
      table.set(name, verdict["verdict"].get<std::string>());
}

std::vector<std::string> names_of_keys(const StudyOptions& options) {
  std::vector<std::string> names;
  for (const VariedKey& key : options.keys) names.push_back(key.key);
  return names;
}

std::string plotted_column(const StudyOptions& options, const Table& table) {
  if (!options.plot.empty()) {
    const auto& columns = table.columns();
    if (std::find(columns.begin(), columns.end(), options.plot) != columns.end()) return options.plot;
    throw ScenarioError("--plot: found '" + options.plot +
                        "'; allowed: a column of the table: " + list_names(columns));
  }
  const std::vector<std::string> changing = changing_columns(table, names_of_keys(options));
  return changing.empty() ? "computation_ratio" : changing.front();
}

/// Checks after the first finished run, not after all of them, that the table has the plotted columns. Pairs
/// with pressure are columns of their own, and they may differ from run to run.
void check_plotted_column(const StudyOptions& options, int done_run) {
  if (options.plot.find('|') != std::string::npos) return;
  Table table;
  add_row(options, done_run, table);
  plotted_column(options, table);
}

void write_results(const StudyOptions& options) {
  const Table table = study_table(options);
  std::ostringstream csv, plot, page;
  table.write_csv(csv);
  write_whole(options.table, csv.str());
  table.write_plot(plot, fs::path(options.scenario).stem().string(), options.keys.front().key,
                   plotted_column(options, table), options.keys.size() > 1 ? options.keys[1].key : "");
  fs::path svg = options.table;
  write_whole(svg.replace_extension(".svg"), plot.str());
  write_study_page(page, "Study of " + fs::path(options.scenario).stem().string(), table,
                   names_of_keys(options), study_runs(options), options.plot, content(picture_of(options)));
  fs::path html = options.table;
  write_whole(html.replace_extension(".html"), page.str());
}

std::string shell_word(const std::string& word) {
  std::string text = "'";
  for (const char c : word) text += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return text + "'";
}

/// The study's own command line.
std::string command_of(const StudyOptions& options) {
  std::string command =
      shell_word(options.executable.string()) + " study " + shell_word(fs::absolute(options.scenario));
  for (const std::string& argument : options.arguments) command += " " + shell_word(argument);
  for (const VariedKey& key : options.keys)
    command += " --vary " + shell_word(key.key + "=" + exact_text(key.from) + ":" + exact_text(key.to) + ":" +
                                       std::to_string(key.count));
  command += " --table " + shell_word(fs::absolute(options.table));
  if (!options.plot.empty()) command += " --plot " + shell_word(options.plot);
  return command;
}

}  // namespace

void write_slurm_job(const StudyOptions& options, const std::filesystem::path& directory) {
  constexpr int kMaxTasks = 1000;  // the default of Slurm's MaxArraySize is 1001
  claim_directory(options);
  fs::create_directories(directory);
  const int tasks = std::min(study_runs(options), kMaxTasks);
  const std::string name = fs::path(options.scenario).stem().string();
  const std::string here = fs::absolute(directory).lexically_normal().string();
  const std::string command = command_of(options);
  write_whole(directory / "study.sbatch",
              "#!/bin/sh\n#SBATCH --job-name=takt-" + name + "\n#SBATCH --array=0-" +
                  std::to_string(tasks - 1) + "\n#SBATCH --cpus-per-task=1\n#SBATCH --output=" + here +
                  "/task_%a.log\nexec " + command + " --jobs 1 --task \"$SLURM_ARRAY_TASK_ID/" +
                  std::to_string(tasks) + "\"\n");
  write_whole(directory / "table.sbatch",
              "#!/bin/sh\n#SBATCH --job-name=takt-" + name + "-table\n#SBATCH --output=" + here +
                  "/table.log\n# Does what tasks have left out, too.\nexec " + command + " --jobs 1\n");
  const fs::path submit = directory / "submit.sh";
  write_whole(submit,
              "#!/bin/sh\n# Again after an interruption: runs that are done are not repeated.\nset -e\n"
              "cd \"$(dirname \"$0\")\"\njob=$(sbatch --parsable \"$@\" study.sbatch)\n"
              "table=$(sbatch --parsable --dependency=\"afterany:$job\" \"$@\" table.sbatch)\n"
              "echo \"array job $job, table by job $table\"\n");
  fs::permissions(submit, fs::perms::owner_exec | fs::perms::group_exec | fs::perms::others_exec,
                  fs::perm_options::add);
}

std::pair<int, int> parse_task(const std::string& text) {
  const auto n = separated_numbers(text, "/");
  if (n && std::ranges::all_of(*n, is_count) && (*n)[0] < (*n)[1])
    return {static_cast<int>((*n)[0]), static_cast<int>((*n)[1])};
  throw ScenarioError("--task: found '" + text + "'; allowed: I/N with 0 <= I < N, e.g. 3/100");
}

VariedKey parse_varied_key(const std::string& text) {
  const std::size_t equals = std::min(text.find('='), text.size());
  const auto n = separated_numbers(std::string_view(text).substr(std::min(equals + 1, text.size())), "::");
  if (equals > 0 && n && is_count((*n)[2]) && (*n)[2] >= 1.0)
    return {text.substr(0, equals), (*n)[0], (*n)[1], static_cast<int>((*n)[2])};
  throw ScenarioError("--vary: found '" + text +
                      "'; allowed: key=from:to:n, e.g. contact.defaults.friction=0.3:0.6:7");
}

int study_runs(const StudyOptions& options) {
  std::int64_t runs = 1;
  for (const VariedKey& key : options.keys) {
    runs *= key.count;
    if (runs > kMaxRuns)
      throw ScenarioError("--vary: more than " + std::to_string(kMaxRuns) + " combinations");
  }
  return static_cast<int>(runs);
}

std::vector<double> study_values(const StudyOptions& options, int run) {
  std::vector<double> values(options.keys.size());
  for (std::size_t i = options.keys.size(); i-- > 0;) {
    values[i] = options.keys[i].value(run % options.keys[i].count);
    run /= options.keys[i].count;
  }
  return values;
}

Table study_table(const StudyOptions& options) {
  Table table;
  for (int run = 0; run < study_runs(options); ++run)
    if (is_done(options, run)) add_row(options, run, table);
  return table;
}

int run_study(const StudyOptions& options, std::ostream& progress) {
  claim_directory(options);
  const bool whole = options.tasks == 1;
  const DirectoryLock lock(directory_of(options), !whole);
  if (whole) remove_parts(options);
  std::vector<int> missing;
  int runs = 0;
  for (int run = options.task; run < study_runs(options); run += options.tasks, ++runs)
    // A study that was killed may have left the messages of a run whose report is complete.
    if (is_done(options, run))
      fs::remove(file_of(options, run, ".log"));
    else
      missing.push_back(run);
  const int before = runs - static_cast<int>(missing.size());
  if (before > 0) progress << before << " of " << runs << " runs were done before\n" << std::flush;
  std::map<pid_t, int> running;
  std::size_t next = 0;
  int done = before;
  std::optional<Progress> bar(std::in_place, !options.bar);
  std::vector<std::string> notes;
  const auto show = [&] {
    bar->at(done, runs, before, "runs");
    if (!bar->shows()) progress << done << " of " << runs << " runs\n" << std::flush;
  };
  bar->at(done, runs, before, "runs");
  std::string refused;
  for (int run = options.task, i = 0; i < runs && before > 0; run += options.tasks, ++i) {
    if (!is_done(options, run)) continue;
    check_plotted_column(options, run);
    break;
  }
  while (!running.empty() || (next < missing.size() && refused.empty())) {
    if (next < missing.size() && refused.empty() && static_cast<int>(running.size()) < options.jobs) {
      const int run = missing[next++];
      running[start(options, run)] = run;
      continue;
    }
    int status = 0;
    const pid_t pid = waitpid(-1, &status, 0);
    if (pid < 0 && errno == EINTR) continue;
    const auto found = running.find(pid);
    if (pid < 0) throw std::runtime_error(std::string("waitpid: ") + std::strerror(errno));
    if (found == running.end()) continue;
    const int run = found->second;
    running.erase(found);
    const int code = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
    if (code != 0 && code != 1 && code != 3) {
      refused = "run " + std::to_string(run) + " of the study (exit code " + std::to_string(code) +
                "): " + content(file_of(options, run, ".log"));
      write_whole(refusal_of(options), refused);
      continue;
    }
    fs::rename(part_of(file_of(options, run, ".json")), file_of(options, run, ".json"));
    take_notes(file_of(options, run, ".log"), notes);
    fs::remove(file_of(options, run, ".log"));
    if (++done == 1) {
      try {
        check_plotted_column(options, run);
      } catch (const ScenarioError& error) {
        refused = error.what();
      }
    }
    show();
  }
  bar.reset();
  for (const std::string& note : notes) progress << note << '\n';
  if (!refused.empty()) throw ScenarioError(refused);
  if (whole) write_results(options);
  return before;
}

}  // namespace takt

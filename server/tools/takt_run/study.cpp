// takt-run study: a scenario with every combination of the varied values.
#include "server/headless/study.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <iostream>
#include <memory>
#include <sstream>
#include <thread>
#include <tuple>

#include "idl/command_line/numbers.h"
#include "idl/common/text.h"
#include "server/tools/takt_run/commands.h"

namespace takt::tool {
namespace {

struct StudyArguments {
  ScenarioArguments scenario;
  std::vector<std::string> vary;
  std::string duration, program, table = "study.csv", plot, slurm, task;
  int jobs = static_cast<int>(std::max(1U, std::thread::hardware_concurrency()));
  bool quiet = false;
};

int study(const StudyArguments& a) {
  StudyOptions options;
  options.executable = std::filesystem::read_symlink("/proc/self/exe");
  options.scenario = a.scenario.file;
  options.table = a.table;
  options.plot = a.plot;
  options.jobs = a.jobs;
  ScenarioOptions first = a.scenario.options;
  for (const std::string& text : a.vary) {
    const VariedKey& key = options.keys.emplace_back(parse_varied_key(text));
    first.overrides.push_back(key.key + "=" + exact_text(key.value(0)));
  }
  read_scenario(a.scenario.file, first);  // an error is reported once, and leaves no directory of runs
  const auto pass = [&](const char* option, const std::string& value) {
    if (!value.empty()) options.arguments.insert(options.arguments.end(), {option, value});
  };
  for (const std::string& text : a.scenario.options.overrides) pass("--set", text);
  if (a.scenario.options.level_of_detail) pass("--lod", std::to_string(*a.scenario.options.level_of_detail));
  pass("--allow-fmus", a.scenario.allowed_fmus);
  for (const std::string& folder : a.scenario.packages) pass("--packages", std::filesystem::absolute(folder));
  pass("--duration", a.duration);
  pass("--program", a.program);
  if (!a.task.empty()) std::tie(options.task, options.tasks) = parse_task(a.task);
  const std::string runs = std::to_string(study_runs(options)) + " runs";
  if (!a.slurm.empty()) {
    write_slurm_job(options, a.slurm);
    if (!a.quiet) std::cout << a.slurm << ": " << runs << "; " << a.slurm << "/submit.sh\n";
    return kDone;
  }
  options.bar = !a.quiet;
  std::ostringstream unread;
  run_study(options, a.quiet ? static_cast<std::ostream&>(unread) : std::cerr);
  if (!a.quiet) std::cout << options.table.string() << ": " << runs << '\n';
  return kDone;
}

}  // namespace

void declare_study(CLI::App& app, int& result) {
  const auto arguments = std::make_shared<StudyArguments>();
  StudyArguments& a = *arguments;
  auto* command = app.add_subcommand("study", "simulate every combination of varied values");
  a.scenario.declare(*command);
  add_repeatable(*command, "--vary", a.vary, "KEY=FROM:TO:N", "N values of a key, both ends included");
  command->get_option("--vary")->required();
  const auto option = [&](const char* name, auto& value, const char* help) {
    return command->add_option(name, value, help);
  };
  option("--duration", a.duration, "simulated time of each run (s); default: the scenario's")
      ->type_name("FLOAT")
      ->check(command_line::positive());
  option("--program", a.program, "controller program in place of the scenario's");
  option("--table", a.table, "results (CSV); what is done is kept beside it")->capture_default_str();
  option("--plot", a.plot,
         "column that is drawn (SVG and page beside the table); default: what changes most");
  option("--jobs", a.jobs, "runs at once (default: one a core)")
      ->check(command_line::whole_number_from(1, 256));
  auto* slurm = option("--slurm", a.slurm, "write an array job for Slurm to this directory; run nothing");
  option("--task", a.task, "do runs I, I + N, ... only; without it the command writes the table")
      ->option_text("I/N")
      ->excludes(slurm);
  command->add_flag("--quiet", a.quiet, "print nothing but errors");
  command->footer(R"(
Examples:
  takt-run study cell.yaml --vary interaction.damping_ratio=0.5:1.5:11 --table damping.csv
  takt-run study cell.yaml --vary contact.defaults.friction=0.1:0.4:100 --slurm job; job/submit.sh)");
  command->callback([arguments, &result] { result = study(*arguments); });
}

}  // namespace takt::tool

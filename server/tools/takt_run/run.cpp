// takt-run run: one scenario to its end.
#include <CLI/CLI.hpp>
#include <chrono>
#include <iostream>
#include <memory>
#include <thread>

#include "idl/command_line/numbers.h"
#include "idl/command_line/package_folders.h"
#include "idl/common/lockstep.h"
#include "idl/common/parse.h"
#include "idl/common/text.h"
#include "server/fmu/fmu_library.h"
#include "server/geometry/convex/decomposition_cache.h"
#include "server/headless/csv_writer.h"
#include "server/headless/headless_run.h"
#include "server/headless/mcap_recording.h"
#include "server/headless/picture.h"
#include "server/headless/progress.h"
#include "server/headless/report.h"
#include "server/headless/run_summary.h"
#include "server/headless/study.h"
#include "server/messages/status_messages.h"
#include "server/runtime/loop/worker_pool.h"
#include "server/runtime/requests/event.h"
#include "server/scenario/note_sentences.h"
#include "server/scenario/scenario_builder.h"
#include "server/tools/takt_run/commands.h"

namespace takt::tool {
namespace {

struct RunArguments {
  ScenarioArguments scenario;
  McapRecordingOptions recording;
  std::string pace{to_string(Pace::free)};
  std::string program, report, html, junit, csv, mcap, mcap_compression = "zstd", picture_view;
  std::vector<std::string> pictures;
  std::optional<double> duration_s, csv_period_s, mcap_period_s;
  int threads = 1;
  bool tolerance = false, stage_times = false, quiet = false, json = false;
};

double monotonic_seconds() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

struct Picture {
  std::string file;
  std::uint64_t step = 0;
};

std::vector<Picture> requested_pictures(const RunArguments& a, double step_s, double duration_s) {
  std::vector<Picture> pictures;
  for (const std::string& text : a.pictures) {
    const std::size_t at = text.rfind('@');
    const auto time_s = at == std::string::npos ? std::nullopt : finite_number(text.substr(at + 1));
    if (!time_s || *time_s < 0.0 || *time_s > duration_s + 0.5 * step_s ||
        !std::string_view(text).substr(0, at).ends_with(".png"))
      throw ScenarioError("--picture: found '" + text +
                          "'; allowed: FILE.png@T with T from 0 s to the end of the run, " +
                          number_text(duration_s, 9) + " s");
    pictures.push_back({text.substr(0, at), period_boundary_step(1, *time_s, step_s)});
  }
  return pictures;
}

std::optional<PictureView> picture_view(const RunArguments& a) {
  if (a.picture_view.empty()) return {};
  const auto numbers = separated_numbers(a.picture_view, ",,:,,");
  PictureView view;
  if (numbers) view = {Vec3(numbers->data()), Vec3(numbers->data() + 3)};
  if (!numbers || (view.eye_W - view.target_W).head<2>().norm() < 1e-6)
    throw ScenarioError("--picture-view: found '" + a.picture_view +
                        "'; allowed: X,Y,Z:X,Y,Z in m, not straight from above, e.g. 0.9,1.6,1.7:0,0,0.8");
  return view;
}

/// The events of the last step, as takt-server sends them. Decisions at the initial state belong to the first step.
void record_events(McapRecording& recording, const Simulation& s) {
  if (s.step_index() == 0) return;
  report_step(s, [&](const EventRecord& event) { recording.record(to_message(event, s.description())); });
}

StepPacer make_pacer(const RunArguments& a) {
  if (a.recording.pace == Pace::free) return {};
  using Clock = std::chrono::steady_clock;
  return [begin = Clock::now(), factor = a.recording.factor](double time_s) {
    std::this_thread::sleep_until(
        begin + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(time_s / factor)));
  };
}

int run(const RunArguments& a) {
  const Scenario scenario = read_scenario(a.scenario.file, a.scenario.options);
  HeadlessOptions options;
  options.duration_s = a.duration_s.value_or(scenario.duration_s);
  options.program = a.program.empty() ? scenario.controller_program : std::filesystem::path(a.program);
  options.stage_times = a.stage_times;
  options.run_metrics = !a.quiet || a.json || !a.report.empty() || !a.html.empty();
  if (!(options.duration_s > 0.0))
    throw ScenarioError("--duration: found " + exact_text(options.duration_s) +
                        "; allowed: a number > 0 s, here or as duration_s in " + a.scenario.file);
  if (a.tolerance && !solver_has_error_control(scenario.initial_solver()))
    std::cerr << kNoteOfRun << "--tolerance has no effect on " << scenario.initial_solver()
              << ", which has a fixed step\n";

  std::optional<Progress> progress(std::in_place, a.quiet);
  const auto fmus = fmu_library(a.scenario.allowed_fmus);
  const PackageFolders packages = command_line::package_folders(a.scenario.packages);
  const auto cell = build_cell(
      scenario, {user_cache_directory(), &monotonic_seconds,
                 [&](const std::string& component, double part) { progress->at_import(component, part); },
                 fmus.get(), packages});
  progress.reset();
  for (const std::string& sentence : note_sentences(cell->import_notes))
    std::cerr << kNoteOfRun << sentence << '\n';
  std::optional<WorkerPool> pool;  // outlives the simulation
  Simulation simulation(cell);
  if (a.threads > 1) simulation.set_executor(&pool.emplace(a.threads));
  const double csv_period_s = a.csv_period_s.value_or(scenario.csv_period_s);
  std::optional<CsvWriter> csv;
  if (!a.csv.empty()) csv.emplace(a.csv, simulation, csv_period_s);
  std::optional<McapRecording> mcap;
  if (!a.mcap.empty()) {
    McapRecordingOptions recording = a.recording;
    recording.version = TAKT_VERSION;
    recording.period_s = a.mcap_period_s.value_or(csv_period_s);
    recording.compression = recording::compression_named(a.mcap_compression).value();
    mcap.emplace(a.mcap, simulation, recording);
  }
  const std::vector<Picture> pictures = requested_pictures(a, cell->step_s, options.duration_s);
  const std::optional<PictureView> view = picture_view(a);
  std::optional<RobotShapes> shapes;
  if (!pictures.empty()) shapes.emplace(scenario, cell->description, packages);
  progress.emplace(a.quiet, options.duration_s);
  StepObserver observer;
  if (csv || mcap || progress->shows() || !pictures.empty()) {
    observer = [&](const Simulation& s) {
      progress->at(s.time_s());
      if (csv) csv->record(s);
      if (mcap) {
        record_events(*mcap, s);
        mcap->record(s);
      }
      for (const Picture& picture : pictures)
        if (picture.step == s.step_index())
          write_picture(s.description(), *shapes, s.make_snapshot(), picture.file, view);
    };
  }
  const HeadlessResult result = run_headless(simulation, scenario, options, observer, make_pacer(a));
  progress.reset();
  if (csv) csv->close();
  if (mcap) {
    if (!simulation.fault().empty())
      mcap->record(to_message(fault_record(simulation), simulation.description()));
    mcap->close(simulation, result);
  }

  const RunInfo info{scenario.initial_solver(), cell->description.level_of_detail,
                     a.recording.pace,          cell->convex_imports,
                     cell->import_notes,        packages};
  const auto report = [&](std::ostream& out) {
    out << report_json(scenario, cell->description, info, result) << '\n';
  };
  if (!a.html.empty())
    write_file(a.html,
               [&](std::ostream& out) { write_html(out, scenario, cell->description, info, result); });
  if (!a.report.empty()) write_file(a.report, report);
  if (!a.junit.empty())
    write_file(a.junit, [&](std::ostream& out) {
      write_junit(out, scenario.name, result.wall_s, result.fault, result.assertions);
    });
  if (a.json)
    report(std::cout);
  else if (!a.quiet)
    print_summary(std::cout, scenario, cell->description, result);
  if (!result.fault.empty()) {
    std::cerr << "takt-run: " << result.fault << '\n';
    return kFailed;
  }
  return verdict(result) == "failed" ? kNotAsserted : kDone;
}

}  // namespace

void declare_run(CLI::App& app, int& result) {
  const auto arguments = std::make_shared<RunArguments>();
  RunArguments& a = *arguments;
  auto* command = app.add_subcommand("run", "simulate a scenario with its robot program, and report");
  a.scenario.declare(*command);
  const auto option = [&](const char* name, auto& value, const char* help) {
    return command->add_option(name, value, help);
  };
  const auto positive = command_line::positive();
  option("--duration", a.duration_s, "simulated time (s); default: the scenario's")->check(positive);
  option("--pace", a.pace, "free (as fast as possible) or realtime")
      ->check(CLI::IsMember({std::string(to_string(Pace::free)), std::string(to_string(Pace::realtime))}));
  option("--factor", a.recording.factor, "simulated seconds per second in realtime pace")->check(positive);
  option("--program", a.program, "controller program in place of the scenario's");
  add_threads(*command, a.threads);
  option("--report", a.report, "write the report to this file (JSON)");
  option("--html", a.html,
         "write the report as a page: verdict, picture, steps, energy, loads, margins, curves");
  option("--junit", a.junit, "write the verdicts on the scenario's assertions to this file (JUnit XML)");
  command->add_flag("--json", a.json, "print the report as JSON in place of words");
  option("--csv", a.csv, "write positions, forces and joints to this file");
  option("--csv-period", a.csv_period_s, "period of the rows (s)")->check(positive);
  option("--mcap", a.mcap, "record to this file (MCAP), as takt record does of a running cell");
  option("--mcap-period", a.mcap_period_s, "period of the instants (s)")->check(positive);
  option("--mcap-compression", a.mcap_compression, "zstd (smallest), lz4 or none")
      ->check(CLI::IsMember({"zstd", "lz4", "none"}));
  option("--mcap-pressures", a.recording.pressures, "record pressures of pairs too (level of detail 3)")
      ->delimiter(',')
      ->allow_extra_args(false)
      ->option_text("BASE-TARGET,... (* for any characters)");
  add_repeatable(*command, "--picture", a.pictures, "FILE.png@T", "a picture of the cell at the time T (s)");
  option("--picture-view", a.picture_view, "where pictures are taken from, and their middle (m)")
      ->option_text("X,Y,Z:X,Y,Z");
  for (const auto& [of, dependent] : {std::pair{"--csv", "--csv-period"},
                                      {"--mcap", "--mcap-period"},
                                      {"--mcap", "--mcap-compression"},
                                      {"--mcap", "--mcap-pressures"},
                                      {"--picture", "--picture-view"}})
    command->get_option(dependent)->needs(of);
  command->add_flag("--stage-times", a.stage_times, "measure the stages of a step");
  command->add_flag("--quiet", a.quiet, "print nothing but errors");
  command->footer(R"(
Examples:
  takt-run run cell.yaml --lod 2 --report run.json --html run.html
  takt-run run cell.yaml --set interaction.weight_feed_forward=false --json | jq .state_hash
  takt-run run cell.yaml --mcap run.mcap; takt view run.mcap
  takt-run run cell.yaml --picture cell.png@9.8)");
  command->callback([arguments, command, &result] {
    arguments->tolerance = command->count("--tolerance") > 0;
    arguments->recording.pace = enumerator_of<Pace>(arguments->pace).value();
    if (command->count("--factor") > 0 && arguments->recording.pace != Pace::realtime)
      throw ScenarioError("--factor: found in pace free, which has none; allowed: with --pace realtime");
    result = run(*arguments);
  });
}

}  // namespace takt::tool

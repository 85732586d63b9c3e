// takt-run: a scenario headless in one process, without DDS.
#include <takt_build_info.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <fstream>
#include <iostream>
#include <nlohmann/json.hpp>
#include <thread>
#include <tuple>

#include "idl/command_line/numbers.h"
#include "idl/command_line/output.h"
#include "server/geometry/convex/decomposition_cache.h"
#include "server/headless/comparison.h"
#include "server/headless/headless_run.h"
#include "server/headless/mcap_recording.h"
#include "server/headless/mesh_check.h"
#include "server/headless/picture.h"
#include "server/headless/progress.h"
#include "server/headless/report.h"
#include "server/headless/scenario_schema.h"
#include "server/headless/study.h"
#include "server/messages/status_messages.h"
#include "server/runtime/host/replay.h"
#include "server/runtime/loop/worker_pool.h"
#include "server/runtime/requests/event.h"
#include "server/scenario/scenario_builder.h"
#include "server/scenario/scenario_writer.h"
#include "server/simulation/model/state_hash.h"
#include "server/simulation/solver/integrator.h"

namespace {

struct Arguments {
  std::string scenario, solver, pace = "free", report, html, junit, csv, mcap, program, check_mesh, replay;
  takt::MeshCheckOptions mesh;
  std::vector<std::string> set, pictures, vary, compare, limits;
  std::string picture_view;
  std::string table = "study.csv", plot, slurm, task;
  std::string mcap_compression = "zstd", mcap_pressures;
  std::string write_scenario, scenario_keys;
  int jobs = 0;
  std::optional<int> lod;
  std::optional<double> step, tolerance, duration;
  std::optional<double> csv_period, mcap_period;
  double factor = 1.0;
  int threads = 1;
  bool stage_times = false, quiet = false, json = false;
};

void declare(CLI::App& app, Arguments& a) {
  app.set_version_flag("--version", std::string("takt-run ") + takt_build_info());
  CLI::Option* scenario = app.add_option("scenario", a.scenario, "Scenario file (YAML)");
  CLI::Option* check_mesh = app.add_option("--check-mesh", a.check_mesh,
                                           "Look at this mesh file (OBJ, STL, GLB) instead of running");
  scenario->excludes(check_mesh);
  app.add_option("--replay", a.replay,
                 "Simulate again what takt-server --log recorded, and compare; with a scenario file: that "
                 "one instead of the file that was recorded")
      ->excludes(check_mesh);
  app.add_option("--mesh-scale", a.mesh.scale, "With --check-mesh: lengths are multiplied by this")
      ->needs(check_mesh)
      ->check(takt::command_line::positive());
  app.add_option("--element-edge", a.mesh.element_edge_m,
                 "With --check-mesh: as if divided to this edge for contact (m)")
      ->needs(check_mesh)
      ->check(takt::command_line::not_negative());
  app.add_option("--lod", a.lod, "Level of detail of every process")
      ->check(takt::command_line::whole_number_from(1, 3));
  app.add_option("--solver", a.solver, "Solver: rk2, rk4, implicit, rosenbrock, cvode, esdirk, esdirk4, ida");
  app.add_option("--step", a.step, "Step size (s)")->check(takt::command_line::positive());
  app.add_option("--tolerance", a.tolerance, "Relative tolerance of solvers with error control")
      ->check(takt::command_line::positive());
  app.add_option("--duration", a.duration, "Simulated time (s); default: the scenario's")
      ->check(takt::command_line::positive());
  app.add_option("--pace", a.pace, "free: as fast as possible; realtime")
      ->check(CLI::IsMember({"free", "realtime"}));
  app.add_option("--factor", a.factor, "Simulated seconds per second in realtime pace")
      ->check(takt::command_line::positive());
  app.add_option("--program", a.program, "Controller program instead of the scenario's");
  app.add_option("--report", a.report, "Write the report (JSON) to this file");
  app.add_option("--html", a.html,
                 "Write the report as a page with plots: steps with their times and energy, largest loads, "
                 "margins, curves");
  app.add_option(
         "--compare", a.compare,
         "Two reports (JSON) of one scenario side by side, at two levels of detail for example: largest "
         "differences, and whether they count; --report writes all of them")
      ->expected(2)
      ->excludes(scenario)
      ->excludes(check_mesh);
  app.add_option(
         "--limit", a.limits,
         "With --compare: NAME=VALUE, what may differ; names and defaults are printed with the verdict")
      ->type_size(1)
      ->allow_extra_args(false);
  app.add_option("--junit", a.junit,
                 "Write the verdicts on the scenario's assertions to this file (JUnit XML)");
  app.add_option("--csv", a.csv, "Write positions, forces and joints to this file");
  app.add_option("--csv-period", a.csv_period, "Period of the rows (s); default: the scenario's")
      ->check(takt::command_line::positive());
  app.add_option(
      "--mcap", a.mcap,
      "Record to this file (MCAP), as takt record does of a running cell: takt view, export, plot, "
      "replay; Foxglove, PlotJuggler and rosbag2 open it");
  app.add_option("--mcap-period", a.mcap_period,
                 "Period of the recorded instants (s); default: as --csv-period")
      ->check(takt::command_line::positive());
  app.add_option("--mcap-compression", a.mcap_compression, "Of that file: zstd (smallest), lz4, none")
      ->check(CLI::IsMember({"zstd", "lz4", "none"}))
      ->capture_default_str();
  app.add_option("--mcap-pressures", a.mcap_pressures,
                 "Record too how these pairs press at level of detail 3, element by element: names "
                 "BASE-TARGET, * for any characters, separated by commas");
  app.add_option("--picture", a.pictures, "FILE.png@T: a picture of the cell at simulated time T (s)")
      ->type_size(1)
      ->allow_extra_args(false);
  app.add_option(
      "--picture-view", a.picture_view,
      "X,Y,Z:X,Y,Z: where pictures are taken from, and what is in their middle (m); default: all of "
      "the cell");
  app.add_option("--set", a.set, "key=value: replace a value of the scenario, e.g. parts.P.mass_kg=0.4")
      ->type_size(1)
      ->allow_extra_args(false);
  app.add_option("--threads", a.threads,
                 "Threads for the collision checks; the bits are the same with any number")
      ->check(takt::command_line::whole_number_from(1, 64))
      ->capture_default_str();
  CLI::Option* vary = app.add_option("--vary", a.vary,
                                     "key=from:to:n: n runs with values of this key (as for --set); with "
                                     "several: every combination");
  vary->type_size(1)->allow_extra_args(false);
  app.add_option("--table", a.table, "With --vary: the results as CSV; what is done is kept beside it")
      ->needs(vary)
      ->capture_default_str();
  app.add_option("--plot", a.plot, "With --vary: the column that is drawn (SVG beside the table)")
      ->needs(vary);
  app.add_option("--jobs", a.jobs, "With --vary: runs at once; default: one for each core")
      ->needs(vary)
      ->check(takt::command_line::whole_number_from(1, 256));
  CLI::Option* slurm =
      app.add_option("--slurm", a.slurm,
                     "With --vary: write an array job for Slurm into this directory instead of "
                     "running; submit.sh there submits it");
  slurm->needs(vary);
  app.add_option(
         "--task", a.task,
         "With --vary: I/N, do runs I, I + N, ... only, beside other such processes; the table is written "
         "by the same command without it")
      ->needs(vary)
      ->excludes(slurm);
  app.add_option("--write-scenario", a.write_scenario,
                 "Write the scenario, with --set and --lod, into this YAML file instead of running");
  app.add_option("--scenario-keys", a.scenario_keys,
                 "Print what can be written in scenario files: schema (JSON Schema), reference (Markdown)")
      ->check(CLI::IsMember({"schema", "reference"}));
  app.add_flag("--stage-times", a.stage_times, "Measure the stages of a step");
  app.add_flag("--quiet", a.quiet, "Print nothing but errors");
  auto* json = app.add_flag(
      "--json", a.json, "Print the report of a run as JSON in place of words (of --replay: what it found)");
  for (const char* other : {"--check-mesh", "--compare", "--vary"}) json->excludes(app.get_option(other));
  app.footer(
      "Examples:\n"
      "  takt-run config/scenarios/block_assembly.yaml\n"
      "  takt-run config/scenarios/block_assembly.yaml --step 0.005 --report run.json\n"
      "  takt-run config/scenarios/block_assembly.yaml --json | jq .state_hash\n"
      "  takt-run config/scenarios/block_assembly.yaml --set interaction.weight_feed_forward=false\n"
      "  takt-run config/scenarios/block_assembly.yaml --vary interaction.damping_ratio=0.5:1.5:11 --table "
      "d.csv\n"
      "  takt-run config/scenarios/block_assembly.yaml --mcap run.mcap; takt view run.mcap\n"
      "  takt-run config/scenarios/block_assembly.yaml --lod 2 --report 2.json --html 2.html\n"
      "  takt-run --compare 1.json 2.json --limit energy=0.1\n"
      "  takt-run --check-mesh part.stl --mesh-scale 0.001\n"
      "  takt-run --replay run.taktlog\n"
      "Exit code: 0 the run reached its end, 1 it ended early, a replay differs or a comparison finds what "
      "counts, 2 wrong arguments or "
      "scenario, or unusable mesh, 3 the run reached its end but not what the scenario demands "
      "(assertions).");
}

// Command-line values become overrides of the file, so that one check and one error text serve both.
takt::ScenarioOptions scenario_options(const Arguments& a) {
  takt::ScenarioOptions options;
  const auto number = [](double value) {
    std::ostringstream text;
    text.precision(17);
    text << value;
    return text.str();
  };
  options.overrides = a.set;
  if (!a.solver.empty()) options.overrides.push_back("solver.method=" + a.solver);
  if (a.step) options.overrides.push_back("solver.step_s=" + number(*a.step));
  if (a.tolerance) options.overrides.push_back("solver.tolerance=" + number(*a.tolerance));
  options.level_of_detail = a.lod;
  return options;
}

double monotonic_seconds() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

struct Picture {
  std::string file;
  std::uint64_t step = 0;
};

std::vector<Picture> requested_pictures(const Arguments& a, double step_s) {
  std::vector<Picture> pictures;
  for (const std::string& text : a.pictures) {
    const std::size_t at = text.rfind('@');
    double time_s = -1.0;
    if (at != std::string::npos && at > 0) {
      std::istringstream stream(text.substr(at + 1));
      if (!(stream >> time_s) || !stream.eof()) time_s = -1.0;
    }
    if (!(time_s >= 0.0)) {
      throw takt::ScenarioError("--picture: found '" + text +
                                "'; allowed: FILE.png@T with T in seconds, e.g. cell.png@9.8");
    }
    pictures.push_back({text.substr(0, at), takt::period_boundary_step(1, time_s, step_s)});
  }
  return pictures;
}

std::optional<takt::PictureView> picture_view(const Arguments& a) {
  if (a.picture_view.empty()) return {};
  takt::PictureView view;
  takt::Vec3 &e = view.eye_W, &t = view.target_W;
  char rest = '\0';
  if (std::sscanf(a.picture_view.c_str(), "%lf,%lf,%lf:%lf,%lf,%lf%c", &e.x(), &e.y(), &e.z(), &t.x(), &t.y(),
                  &t.z(), &rest) != 6 ||
      !e.allFinite() || !t.allFinite() || (e - t).head<2>().norm() < 1e-6) {
    throw takt::ScenarioError(
        "--picture-view: found '" + a.picture_view +
        "'; allowed: X,Y,Z:X,Y,Z in m, not straight from above, e.g. 0.9,1.6,1.7:0,0,0.8");
  }
  return view;
}

/// What happened in the last step, as takt-server tells it. What the initial state decided belongs to the
/// first step.
void record_events(takt::McapRecording& recording, const takt::Simulation& s) {
  if (s.step_index() == 0) return;
  takt::report_step(s, [&](const takt::EventRecord& event) {
    recording.record(takt::to_message(event, s.description()));
  });
}

takt::StepPacer make_pacer(const Arguments& a) {
  if (a.pace == "free") return {};
  const auto begin = std::chrono::steady_clock::now();
  return [begin, factor = a.factor](double time_s) {
    std::this_thread::sleep_until(begin + std::chrono::duration_cast<std::chrono::steady_clock::duration>(
                                              std::chrono::duration<double>(time_s / factor)));
  };
}

takt::McapRecordingOptions mcap_options(const Arguments& a, const takt::Scenario& scenario) {
  takt::McapRecordingOptions options;
  options.period_s = a.mcap_period.value_or(a.csv_period.value_or(scenario.csv_period_s));
  options.version = TAKT_VERSION;
  options.pace = a.pace;
  options.factor = a.factor;
  options.compression = takt::recording::compression_named(a.mcap_compression).value();
  options.pressures = a.mcap_pressures;
  return options;
}

int run(const Arguments& a) {
  const takt::Scenario scenario = takt::read_scenario(a.scenario, scenario_options(a));
  takt::HeadlessOptions options;
  options.duration_s = a.duration.value_or(scenario.duration_s);
  options.program = a.program.empty() ? scenario.controller_program : std::filesystem::path(a.program);
  options.stage_times = a.stage_times;
  options.run_metrics = a.json || !a.report.empty() || !a.html.empty();
  if (!(options.duration_s > 0.0)) {
    throw takt::ScenarioError("--duration: found " + std::to_string(options.duration_s) +
                              "; allowed: a number > 0 s, here or as duration_s in " + a.scenario);
  }
  if (a.tolerance && !takt::solver_has_error_control(scenario.initial_solver())) {
    std::cerr << "takt-run: note: --tolerance has no effect on " << scenario.initial_solver()
              << ", which has a fixed step\n";
  }

  std::optional<takt::Progress> progress(std::in_place, a.quiet);
  const auto cell = takt::build_cell(
      scenario, {takt::user_cache_directory(), &monotonic_seconds,
                 [&](const std::string& component, double part) { progress->at_import(component, part); }});
  progress.reset();
  for (const takt::ImportNote& note : cell->import_notes) {
    std::cerr << "takt-run: note: " << note.sentence << '\n';
  }
  std::optional<takt::WorkerPool> pool;  // outlives the simulation
  takt::Simulation simulation(cell);
  if (a.threads > 1) simulation.set_executor(&pool.emplace(a.threads));
  std::optional<takt::CsvWriter> csv;
  if (!a.csv.empty()) csv.emplace(a.csv, simulation, a.csv_period.value_or(scenario.csv_period_s));
  std::optional<takt::McapRecording> mcap;
  if (!a.mcap.empty()) mcap.emplace(a.mcap, simulation, mcap_options(a, scenario));
  const std::vector<Picture> pictures = requested_pictures(a, cell->step_s);
  const std::optional<takt::PictureView> view = picture_view(a);
  progress.emplace(a.quiet, options.duration_s);
  takt::StepObserver observer;
  if (csv || mcap || progress->shows() || !pictures.empty()) {
    observer = [&](const takt::Simulation& s) {
      progress->at(s.time_s());
      if (csv) csv->record(s);
      if (mcap) {
        record_events(*mcap, s);
        mcap->record(s);
      }
      for (const Picture& picture : pictures) {
        if (picture.step == s.step_index())
          takt::write_picture(s.description(), s.make_snapshot(), picture.file, view);
      }
    };
  }
  const takt::HeadlessResult result =
      takt::run_headless(simulation, scenario, options, observer, make_pacer(a));
  progress.reset();
  if (csv) csv->close();
  if (mcap) {
    if (!simulation.fault().empty())
      mcap->record(takt::to_message(takt::fault_record(simulation), simulation.description()));
    mcap->close();
  }

  const takt::RunInfo info{scenario.initial_solver(), cell->description.level_of_detail, a.pace,
                           cell->convex_imports, cell->import_notes};
  if (!a.html.empty()) {
    std::ofstream out(a.html);
    takt::write_html(out, scenario, cell->description, info, result);
    out.close();
    if (!out) throw std::runtime_error(a.html + ": cannot be written");
  }
  if (!a.report.empty()) {
    std::ofstream out(a.report);
    out << takt::report_json(scenario, cell->description, info, result) << '\n';
    out.close();
    if (!out) throw std::runtime_error(a.report + ": cannot be written");
  }
  if (!a.junit.empty()) {
    std::ofstream out(a.junit);
    takt::write_junit(out, scenario.name, result.wall_s, result.fault, result.assertions);
    out.close();
    if (!out) throw std::runtime_error(a.junit + ": cannot be written");
  }
  if (a.json)
    std::cout << takt::report_json(scenario, cell->description, info, result) << '\n';
  else if (!a.quiet)
    takt::print_summary(std::cout, scenario, cell->description, result);
  if (!result.fault.empty()) {
    std::cerr << "takt-run: " << result.fault << '\n';
    return 1;
  }
  return takt::verdict(result) == "failed" ? 3 : 0;
}

int study(const Arguments& a) {
  takt::read_scenario(a.scenario, scenario_options(a));  // what is wrong is told once, not by every run
  takt::StudyOptions options;
  options.executable = std::filesystem::read_symlink("/proc/self/exe");
  options.scenario = a.scenario;
  options.table = a.table;
  options.plot = a.plot;
  options.jobs = a.jobs > 0 ? a.jobs : static_cast<int>(std::max(1U, std::thread::hardware_concurrency()));
  for (const std::string& text : a.vary) options.keys.push_back(takt::parse_varied_key(text));
  const auto pass = [&](const std::string& option, const std::string& value) {
    options.arguments.push_back(option);
    options.arguments.push_back(value);
  };
  for (const std::string& text : scenario_options(a).overrides) pass("--set", text);
  if (a.lod) pass("--lod", std::to_string(*a.lod));
  if (a.duration) pass("--duration", std::to_string(*a.duration));
  if (!a.program.empty()) pass("--program", a.program);
  if (!a.task.empty()) std::tie(options.task, options.tasks) = takt::parse_task(a.task);
  if (!a.slurm.empty()) {
    takt::write_slurm_job(options, a.slurm);
    if (!a.quiet)
      std::cout << a.slurm << ": " << takt::study_runs(options) << " runs; " << a.slurm << "/submit.sh\n";
    return 0;
  }
  options.bar = !a.quiet;
  std::ostringstream nobody;
  takt::run_study(options, a.quiet ? static_cast<std::ostream&>(nobody) : std::cerr);
  if (!a.quiet) std::cout << options.table.string() << ": " << takt::study_runs(options) << " runs\n";
  return 0;
}

int compare(const Arguments& a) {
  takt::ComparisonLimits limits;
  for (const std::string& text : a.limits) takt::set_limit(limits, text);
  return takt::compare_files(std::cout, a.compare[0], a.compare[1], a.report, limits) ? 0 : 1;
}

int replay(const Arguments& a) {
  std::optional<takt::WorkerPool> pool;  // outlives the simulation
  takt::ReplayOptions options;
  if (a.threads > 1) options.executor = &pool.emplace(a.threads);
  options.load = [&](const takt::LogScenario& world) {
    return takt::load_logged_scenario(world, takt::user_cache_directory(), a.scenario);
  };
  const takt::ReplayResult result = takt::replay(a.replay, options);
  if (a.json) {
    std::cout << nlohmann::json{{"difference", result.difference},
                                {"early_end", result.early_end},
                                {"recorded_by", result.version},
                                {"cell", result.cell},
                                {"scenarios", result.scenarios},
                                {"steps", result.steps},
                                {"commands", result.commands},
                                {"requests", result.requests},
                                {"checkpoints", result.checkpoints},
                                {"last_step", result.step},
                                {"state_hash", takt::hash_text(result.state_hash)}}
                     .dump(2)
              << '\n';
    return result.difference.empty() ? 0 : 1;
  }
  if (!result.difference.empty()) {
    std::cerr << "takt-run: " << result.difference << '\n';
    return 1;
  }
  if (!a.quiet) {
    std::cout << "Recorded by " << result.version << ", cell '" << result.cell << "': " << result.scenarios
              << " scenarios, " << result.steps << " steps, " << result.commands << " commands, "
              << result.requests << " requests.\n";
    if (!result.early_end.empty()) std::cout << "Note: " << result.early_end << ".\n";
    std::cout << "The same bits at all " << result.checkpoints << " checkpoints; the last one: step "
              << result.step << ", state hash " << takt::hash_text(result.state_hash) << ".\n";
  }
  return 0;
}

int write_scenario(const Arguments& a) {
  const std::filesystem::path file = a.write_scenario;
  std::ofstream out(file);
  out << takt::write_scenario(takt::read_scenario(a.scenario, scenario_options(a)), file.parent_path());
  out.close();
  if (!out) throw std::runtime_error(a.write_scenario + ": cannot be written");
  return 0;
}

int do_what_is_wanted(const Arguments& a) {
  if (!a.scenario_keys.empty())
    return std::cout << (a.scenario_keys == "schema" ? takt::scenario_schema() : takt::scenario_reference()),
           0;
  if (!a.write_scenario.empty()) return write_scenario(a);
  if (!a.check_mesh.empty()) return takt::print_mesh_check(std::cout, a.check_mesh, a.mesh) ? 0 : 2;
  if (!a.compare.empty()) return compare(a);
  if (!a.replay.empty()) return replay(a);
  if (!a.vary.empty()) return study(a);
  return run(a);
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{"takt-run: simulate a scenario headless in one process"};
  Arguments arguments;
  declare(app, arguments);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    const int code = app.exit(error);
    return code == 0 ? 0 : 2;
  }
  if (arguments.scenario.empty() && arguments.check_mesh.empty() && arguments.replay.empty() &&
      arguments.compare.empty() && arguments.scenario_keys.empty()) {
    std::cerr << "takt-run: a scenario file is required; or --check-mesh FILE. Run with --help for more.\n";
    return 2;
  }
  try {
    return takt::command_line::with_output_written("takt-run", do_what_is_wanted(arguments));
  } catch (const std::exception& error) {
    std::cerr << "takt-run: " << error.what() << '\n';
    return 2;
  }
}

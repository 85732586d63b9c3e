// takt: look at a running cell and control it from the command line.
#include <takt_build_info.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "client_lib/tools/connection_options.h"
#include "client_lib/tools/takt/commands.h"
#include "idl/command_line/commands.h"
#include "idl/command_line/enumeration.h"
#include "idl/command_line/numbers.h"
#include "idl/command_line/output.h"

namespace {

constexpr const char* kExamples = R"(
Examples:
  takt list                              the cells on the domain
  takt status                            how the cell is doing: time, pace, real-time factor, faults
  takt watch                             a live line: time, real-time factor, the holder of each Part
  takt state --json                      positions, orientations, states, partners, signals of devices
  takt explain P                         what holds the Part P, by which rule, since when, what it touches
  takt pause; takt step 100; takt play
  takt load my.yaml; takt play           another scenario in the running server
  takt view                              the cell in the browser; takt view run.mcap: a recording
  takt record run.mcap                   everything, until Ctrl-C; takt replay, export and plot read it
  takt record run.csv --duration 10      10 s of simulated time
  takt check scenario.yaml               compare with the positions the scenario expects at its end
  takt from-cad gearbox.step -o gearbox  a STEP or GLB file as a cell
  takt --cell line2 --domain 3 status    another cell (or: TAKT_CELL=line2 TAKT_DOMAIN=3 takt status)
takt COMMAND --help shows examples of each command.

With --json every command writes one JSON document, those that follow something one a line; an error is
{"error": ..., "kind": ..., "result": ...}.

Exit codes: 0 ok; 1 refused or failed, or not as expected; 2 wrong usage; 3 no such cell, or it went away.)";

/// Runs the program of this name beside this one, in its place. Returns only if that program is missing.
int become(const std::string& program, const std::vector<std::string>& arguments) {
  std::error_code problem;
  const auto path = std::filesystem::read_symlink("/proc/self/exe", problem).parent_path() / program;
  std::vector<std::string> all{program};
  all.insert(all.end(), arguments.begin(), arguments.end());
  std::vector<char*> argv;
  for (std::string& one : all) argv.push_back(one.data());
  argv.push_back(nullptr);
  ::execv(path.c_str(), argv.data());
  std::fprintf(stderr,
               "takt: there is no program %s beside takt. It is built where OpenCASCADE is found "
               "(libocct-data-exchange-dev).\n",
               program.c_str());
  return takt::tool::kFailed;
}

/// Prints the mistake in the command line, or the requested help or version. Returns the exit code.
int answer(const CLI::App& app, const CLI::ParseError& error, bool json) {
  if (error.get_exit_code() == 0) return app.exit(error);
  const std::optional<std::string> word = takt::command_line::unknown_command(app);
  const std::string sentence = word ? takt::command_line::no_such_command(app, *word) : error.what();
  if (json) takt::tool::print_json(nlohmann::json{{"error", sentence}, {"kind", "usage"}});
  if (word)
    std::fprintf(stderr, "takt: %s\n", sentence.c_str());
  else
    app.exit(error);
  return takt::tool::kUsage;
}

int run(int argc, char** argv) {
  // Its options are those of that program.
  if (argc > 1 && std::string_view(argv[1]) == "from-cad")
    return become("takt-from-cad", {argv + 2, argv + argc});
  namespace numbers = takt::command_line;
  CLI::App app{"Look at a running takt cell and control it."};
  takt::command_line::wrap_help(app);
  app.footer(kExamples);
  app.set_version_flag("--version", std::string("takt ") + takt_build_info());
  app.require_subcommand(1);
  app.fallthrough();  // the common options may follow the command

  takt::tool::Common common;
  common.client.name = "takt";
  takt::tool::add_connection_options(app, common.client);
  auto* timeout = app.add_option("--timeout", common.timeout_s, "longest wait for an answer, s of wall time")
                      ->check(numbers::positive())
                      ->capture_default_str();
  app.add_option(
         "--secure", common.client.secure_directory,
         "auto (auto:observer): identities of this user, made at first use; or a directory with identity and "
         "permissions (environment: TAKT_SECURE)")
      ->check(CLI::ExistingDirectory | CLI::IsMember({"auto", "auto:controller", "auto:observer"}));
  app.add_flag("--json", common.json,
               "output for programs: JSON, one document per line where it follows something");

  int result = 0;
  const auto add = [&](const char* name, const char* description, auto action) {
    return app.add_subcommand(name, description)->callback([&result, action] { result = action(); });
  };
  add("list", "which cells are on the domain", [&] {
    if (timeout->count() == 0) common.timeout_s = 2.0;
    return takt::tool::list(common);
  });
  add("status", "how the cell is doing", [&] { return takt::tool::status(common); });
  add("state", "pose and holder of every component; joints, jaws, signals of devices",
      [&] { return takt::tool::state(common); });
  add("signals", "every signal by its name: value, unit, direction, whether it is forced, its wire",
      [&] { return takt::tool::signals(common); });

  app.add_subcommand("from-cad", "a STEP or GLB file as a cell: the program takt-from-cad")->callback([] {
    throw CLI::ValidationError(
        "from-cad", "options of takt before it have no effect; allowed: takt from-cad PRODUCT.step -o DIR");
  });

  std::string part;
  add("explain", "why a Part is held as it is (or what a Gripper or Ground holds)",
      [&] { return takt::tool::explain(common, part); })
      ->add_option("PART", part, "name of a component")
      ->required();

  const auto may_follow = [](CLI::App* command, takt::tool::FollowOptions& options) {
    command->add_flag("--watch", options.watch, "follow it");
    command->add_option("--until", options.until_s, "follow it up to this simulated time, s")
        ->check(numbers::not_negative());
  };
  takt::tool::FollowOptions power_options, contacts_options;
  may_follow(add("power", "what each robot draws (level of detail 2)",
                 [&] { return takt::tool::power(common, power_options); }),
             power_options);
  may_follow(add("contacts", "what presses upon what, and how (level of detail 3)",
                 [&] { return takt::tool::contacts(common, contacts_options); }),
             contacts_options);
  takt::tool::WatchOptions watch_options;
  add("watch", "follow time, pace and partners (one line that renews itself on a terminal)",
      [&] { return takt::tool::watch(common, watch_options); })
      ->add_option("--until", watch_options.until_s, "end at this simulated time, s")
      ->check(numbers::not_negative());

  takt::tool::EventsOptions events_options;
  add("events", "follow the events from now on", [&] { return takt::tool::events(common, events_options); })
      ->add_option("--count", events_options.count, "end after this many")
      ->check(numbers::whole_number_from(1));

  takt::tool::EchoOptions echo_options;
  auto* echo = add("echo", "samples of any topic, as JSON, one a line",
                   [&] { return takt::tool::echo(common, echo_options); });
  echo->add_option("TOPIC", echo_options.topic, "which")
      ->required()
      ->check(CLI::IsMember(takt::tool::echo_topics()));
  echo->add_option("ROBOT", echo_options.robot, "whose, of a topic that each robot has");
  echo->add_option("--count", echo_options.count, "end after this many")
      ->check(numbers::whole_number_from(1))
      ->capture_default_str();

  takt::tool::RecordOptions record_options;
  CLI::Option* record_period = nullptr;
  auto* record = add("record", "record what the cell sends (FILE.mcap), or states as a table (CSV)", [&] {
    if (record_options.file.ends_with(".mcap"))
      return takt::tool::record_mcap(
          common, record_options,
          record_period->count() > 0 ? std::optional(record_options.period_s) : std::nullopt);
    return common.json ? takt::tool::record_json(common, record_options)
                       : takt::tool::record_csv(common, record_options);
  });
  record
      ->add_option("FILE", record_options.file,
                   "file to write: FILE.mcap for all samples of all topics; else positions, joints, signals "
                   "of devices and partners as a table, '-' is standard output; with --json the "
                   "samples of instants and the events, one document a line")
      ->required();
  record->add_option("--duration", record_options.duration_s, "end after this much simulated time, s")
      ->check(numbers::not_negative());
  record->add_option("--until", record_options.until_s, "end at this simulated time, s")
      ->check(numbers::not_negative());
  record_period = record
                      ->add_option("--period", record_options.period_s,
                                   "simulated time between rows, s; for FILE.mcap: without it every step")
                      ->check(numbers::positive())
                      ->capture_default_str();

  record->add_option("--compression", record_options.compression, "of FILE.mcap: zstd (smallest), lz4, none")
      ->check(CLI::IsMember({"zstd", "lz4", "none"}))
      ->capture_default_str();
  record
      ->add_option("--pressures", record_options.pressures,
                   "for FILE.mcap: element by element, how these pairs press at level of detail 3: names "
                   "BASE-TARGET, * for any characters, separated by commas")
      ->delimiter(',')
      ->allow_extra_args(false);

  takt::tool::CheckOptions check_options;
  auto* check = add("check", "compare the present positions with those a scenario expects at its end",
                    [&] { return takt::tool::check(common, check_options); });
  check->add_option("SCENARIO", check_options.scenario_file, "scenario file (YAML) with a section 'expected'")
      ->required()
      ->check(CLI::ExistingFile);

  std::uint64_t steps = 1;
  add("step", "advance a paused cell", [&] { return takt::tool::step(common, steps); })
      ->add_option("N", steps, "number of steps")
      ->check(numbers::whole_number_from(1))
      ->capture_default_str();

  std::string pace;
  double factor = 1.0;
  auto* set_pace = add("pace", "how fast simulated time runs", [&] {
    return takt::tool::pace(common, takt::enumerator_of<takt::Pace>(pace).value(), factor);
  });
  set_pace->add_option("PACE", pace, "relation of simulated time to wall time")
      ->required()
      ->transform(CLI::IsMember(takt::command_line::words_of<takt::Pace>(), CLI::ignore_case));
  set_pace->add_option("--factor", factor, "simulated / wall time (realtime)")->check(numbers::positive());

  takt::tool::declare_requests(app, common, result);
  takt::tool::declare_scenario_and_entities(app, common, result);
  takt::tool::declare_view(app, common, result);
  takt::tool::declare_recordings(app, common, result);
  takt::tool::declare_completion(app, result);
  takt::tool::add_examples(app);

  app.parse_complete_callback([&] { common.client.timeout = takt::Seconds{common.timeout_s}; });
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return answer(app, error,
                  common.json || std::find(argv, argv + argc, std::string_view("--json")) != argv + argc);
  } catch (const std::exception& error) {
    return takt::tool::report_error(common.json, error);
  }
  return result;
}

}  // namespace

int main(int argc, char** argv) {
  std::signal(SIGXFSZ, SIG_IGN);  // a recording that may grow no further fails like one on a full disk
  try {
    const int code = takt::command_line::with_output_written("takt", run(argc, argv));
#ifndef TAKT_ENDS_WITH_DESTRUCTORS
    std::quick_exit(code);  // the destructor of Fast DDS's factory sleeps for 0.1 s
#endif
    return code;
  } catch (const std::exception& error) {  // of the environment: see ClientOptions
    std::fprintf(stderr, "takt: %s\n", error.what());
    return takt::tool::kUsage;
  }
}

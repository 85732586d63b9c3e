// takt-server: a scenario as a service. Arguments -> scenario -> simulation -> step loop with DDS at both
// ends.
#include <signal.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "server/dds/dds_adapter.h"
#include "server/dds/topic_names.h"
#include "server/geometry/decomposition_cache.h"
#include "server/runtime/run_loop.h"
#include "server/runtime/worker_pool.h"
#include "server/scenario/scenario_builder.h"
#include "server/scenario/scenario_reader.h"
#include "server/simulation/simulation.h"

namespace {

constexpr int kBadInput = 2;
constexpr int kFailed = 1;

struct Arguments {
  std::filesystem::path scenario;
  std::string cell = "cell";
  std::string pace = "realtime";
  double factor = 1.0;
  bool paused = false, pause_at_end = false, exit_at_end = false;
  std::uint32_t domain = 0;
  std::string profiles, profile = "takt_server", secure;
  int realtime_priority = 0;
  int threads = 1;
  std::vector<std::string> overrides;
  std::optional<int> level_of_detail;
};

void describe_arguments(CLI::App& app, Arguments& arguments) {
  app.set_version_flag("--version", std::string("takt-server ") + TAKT_VERSION);
  app.add_option("SCENARIO", arguments.scenario, "scenario file (YAML)")->required();
  app.add_option("--cell", arguments.cell, "name of this server: first level of every topic")
      ->capture_default_str();
  app.add_option(
         "--pace", arguments.pace,
         "realtime; free: as fast as possible; lockstep: waits for registered controllers (default realtime)")
      ->check(CLI::IsMember({"realtime", "free", "lockstep"}))
      ->option_text("realtime|free|lockstep");
  app.add_option("--factor", arguments.factor, "simulated seconds per second of wall time, for realtime")
      ->check(CLI::Range(0.001, 1000.0))
      ->capture_default_str();
  app.add_flag("--paused", arguments.paused, "start paused");
  app.add_flag("--pause-at-end", arguments.pause_at_end,
               "pause when the scenario's duration has been simulated");
  app.add_flag("--exit-at-end", arguments.exit_at_end, "end when the scenario's duration has been simulated");
  app.add_option("--domain", arguments.domain, "DDS domain")
      ->check(CLI::Range(0, 232))
      ->envname("TAKT_DOMAIN")
      ->capture_default_str();
  app.add_option("--profiles", arguments.profiles, "Fast DDS profiles (XML); without: this machine only")
      ->check(CLI::ExistingFile);
  app.add_option("--profile", arguments.profile, "participant profile to use of that file")
      ->capture_default_str();
  app.add_option("--secure", arguments.secure,
                 "directory with the identity and permissions of a server (docs/network.md)")
      ->check(CLI::ExistingDirectory)
      ->envname("TAKT_SECURE");
  app.add_option("--realtime-priority", arguments.realtime_priority,
                 "1 to 99: ask for SCHED_FIFO with this priority and for locked memory")
      ->check(CLI::Range(0, 99));
  app.add_option("--threads", arguments.threads,
                 "threads for the collision checks; the bits are the same with any number")
      ->check(CLI::Range(1, 64))
      ->capture_default_str();
  app.add_option("--lod", arguments.level_of_detail, "level of detail of every process");
  app.add_option("--set", arguments.overrides, "override a key of the scenario, e.g. solver.step_s=0.0005")
      ->option_text("KEY=VALUE ...")
      ->allow_extra_args(false);
}

takt::Pace pace_of(const std::string& name) {
  for (const takt::Pace pace : {takt::Pace::free, takt::Pace::lockstep}) {
    if (name == takt::to_string(pace)) return pace;
  }
  return takt::Pace::realtime;
}

takt::RunLoopOptions loop_options(const Arguments& arguments, double duration_s) {
  takt::RunLoopOptions options;
  options.pace = pace_of(arguments.pace);
  options.factor = arguments.factor;
  options.start_paused = arguments.paused;
  options.realtime_priority = arguments.realtime_priority;
  options.quit_at_end = arguments.exit_at_end;
  if (duration_s > 0.0 && (arguments.exit_at_end || arguments.pause_at_end)) options.pause_at_s = duration_s;
  return options;
}

/// Runs until a signal or the loop itself ends it.
int serve(const Arguments& arguments, const sigset_t& signals) {
  std::shared_ptr<const takt::CellModel> model;
  double duration_s = 0.0;
  try {
    takt::ScenarioOptions scenario_options;
    scenario_options.overrides = arguments.overrides;
    scenario_options.level_of_detail = arguments.level_of_detail;
    const takt::Scenario scenario = takt::read_scenario(arguments.scenario, scenario_options);
    duration_s = scenario.duration_s;
    auto named =
        std::make_shared<takt::CellModel>(*takt::build_cell(scenario, {takt::user_cache_directory()}));
    for (const takt::ImportNote& note : named->import_notes) {
      std::fprintf(stderr, "takt-server: note: %s\n", note.sentence.c_str());
    }
    named->description.cell = arguments.cell;
    model = named;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "takt-server: %s\n", error.what());
    return kBadInput;
  }
  std::optional<takt::WorkerPool> pool;  // outlives the simulation
  takt::Simulation simulation(model);
  if (arguments.threads > 1)
    simulation.set_executor(&pool.emplace(arguments.threads, arguments.realtime_priority));
  takt::RunLoop loop(simulation, loop_options(arguments, duration_s));
  takt::DdsAdapter adapter(loop, {"takt-server " + arguments.cell, arguments.domain, arguments.profiles,
                                  arguments.profile, arguments.secure});
  const pthread_t main_thread = pthread_self();
  loop.set_on_quit([main_thread] { pthread_kill(main_thread, SIGTERM); });
  loop.start();
  std::printf("takt-server: cell '%s' ready: scenario %s, pace %s, domain %u\n", arguments.cell.c_str(),
              simulation.description().scenario.c_str(), arguments.pace.c_str(), arguments.domain);
  std::fflush(stdout);

  int signal = 0;
  sigwait(&signals, &signal);
  loop.stop();
  adapter.stop();
  std::printf("takt-server: cell '%s' ended at %.3f s simulated time\n", arguments.cell.c_str(),
              simulation.time_s());
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  // All threads inherit this mask: the signals that end the server are taken by sigwait alone.
  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, SIGINT);
  sigaddset(&signals, SIGTERM);
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);

  Arguments arguments;
  CLI::App app("Simulates the robotic cell of a scenario as a service over DDS.", "takt-server");
  describe_arguments(app, arguments);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : kBadInput;
  }
  if (!takt::is_topic_level(arguments.cell)) {
    std::fprintf(stderr,
                 "takt-server: --cell '%s' cannot be part of a topic name; allowed are letters, digits and "
                 "underscores, "
                 "no digit first\n",
                 arguments.cell.c_str());
    return kBadInput;
  }
  try {
    return serve(arguments, signals);
  } catch (const takt::DdsError& error) {
    std::fprintf(stderr, "takt-server: %s\n", error.what());
    return kBadInput;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "takt-server: %s\n", error.what());
    return kFailed;
  }
}

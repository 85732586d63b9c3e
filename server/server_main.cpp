// takt-server: scenarios as a service. Arguments -> host of the cell (scenario, simulation, step loop) with
// DDS at both ends.
#include <signal.h>
#include <unistd.h>

#include <takt_build_info.h>

#include <CLI/CLI.hpp>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <functional>
#include <new>
#include <optional>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "idl/command_line/commands.h"
#include "idl/command_line/enumeration.h"
#include "idl/command_line/numbers.h"
#include "idl/command_line/package_folders.h"
#include "idl/transport/fastdds/server_participant.h"
#include "server/dds/dds_adapter.h"
#include "server/dds/end_deadline.h"
#include "server/dds/topic_names.h"
#include "server/fmu/fmu_library.h"
#include "server/geometry/convex/decomposition_cache.h"
#include "server/headless/progress.h"
#include "server/runtime/host/cell_host.h"
#include "server/runtime/host/supervisor.h"
#include "server/runtime/recording/session_store.h"
#include "server/simulation/step/simulation.h"

namespace {

constexpr int kBadInput = 2;
constexpr int kFailed = takt::kCrashed;

struct Arguments {
  std::filesystem::path scenario;
  std::string cell = "cell";
  std::string pace{takt::to_string(takt::Pace::realtime)};
  double factor = 1.0;
  bool paused = false, pause_at_end = false, exit_at_end = false;
  std::uint32_t domain = 0;
  std::string profiles, profile = "takt_server", secure;
  bool namespaced_clock_and_tf = false;
  int realtime_priority = 0;
  int threads = 1;
  std::filesystem::path snapshots;
  std::optional<double> snapshot_every_s;
  bool supervised = false, edit = false;
  std::filesystem::path log, recordings, scenarios, allowed_fmus;
  std::vector<std::string> overrides, packages;
  std::optional<int> level_of_detail;
};

/// Limits of the factor of the request set_pace.
double limit_of_factor(std::string_view which) {
  constexpr const takt::FieldInfo& factor = takt::field_info<takt::requests::SetPace>("factor");
  return std::stod(std::string(takt::annotation(factor.annotations, which)));
}

void describe_arguments(CLI::App& app, Arguments& arguments) {
  app.set_version_flag("--version", std::string("takt-server ") + takt_build_info());
  app.add_option("SCENARIO", arguments.scenario,
                 "scenario file (YAML); without one the server waits for the request load_scenario");
  app.add_option("--cell", arguments.cell, "name of this server: first level of every topic")
      ->envname("TAKT_CELL")
      ->capture_default_str();
  app.add_option("--pace", arguments.pace, "relation of simulated time to wall time")
      ->check(CLI::IsMember(takt::command_line::words_of<takt::Pace>()))
      ->capture_default_str();
  app.add_option("--factor", arguments.factor, "simulated seconds per second of wall time, for realtime")
      ->check(takt::command_line::number_from(limit_of_factor("min"), limit_of_factor("max")))
      ->capture_default_str();
  app.add_flag("--paused", arguments.paused, "start paused");
  app.add_flag("--pause-at-end", arguments.pause_at_end,
               "pause when the scenario's duration has been simulated");
  app.add_flag("--exit-at-end", arguments.exit_at_end, "end when the scenario's duration has been simulated");
  app.add_option("--domain", arguments.domain, "DDS domain")
      ->check(takt::command_line::whole_number_from(0, 232))
      ->envname("TAKT_DOMAIN")
      ->capture_default_str();
  auto* profiles =
      app.add_option("--profiles", arguments.profiles, "Fast DDS profiles (XML); without: this machine only")
          ->check(CLI::ExistingFile);
  app.add_option("--profile", arguments.profile, "participant profile to use of that file")
      ->needs(profiles)
      ->capture_default_str();
  app.add_option("--secure", arguments.secure,
                 "auto: identities of this user, made at first use; or a directory with the identity and "
                 "permissions of a "
                 "server (docs/network.md)")
      ->check(CLI::ExistingDirectory | CLI::IsMember({"auto"}))
      ->envname("TAKT_SECURE");
  app.add_flag("--namespaced-clock-and-tf", arguments.namespaced_clock_and_tf,
               "for ROS tools of several cells on one domain: clock, tf and tf_static below the cell's name, "
               "as /CELL/clock, instead of /clock");
  app.add_option("--realtime-priority", arguments.realtime_priority,
                 "1 to 99: ask for SCHED_FIFO with this priority and for locked memory")
      ->check(takt::command_line::whole_number_from(0, 99));
  app.add_option("--threads", arguments.threads,
                 "threads for the collision checks; the bits are the same with any number")
      ->check(takt::command_line::whole_number_from(1, 64))
      ->capture_default_str();
  app.add_option("--snapshots", arguments.snapshots,
                 "directory of snapshots (save_snapshot, restore_snapshot); those of this cell are in a "
                 "directory of its name below it");
  app.add_option(
         "--snapshot-every", arguments.snapshot_every_s,
         "wall time (s) between periodic snapshots, of which the newest 3 are kept; with --supervised "
         "0.5 unless given")
      ->check(takt::command_line::number_from(0.05, 86400.0));
  app.add_flag(
      "--supervised", arguments.supervised,
      "start again after a crash, from the newest periodic snapshot; gives up after 5 crashes in 60 s");
  app.add_option("--log", arguments.log,
                 "record to this file all that changes the simulation, for takt-run replay; an "
                 "existing file is replaced");
  app.add_option("--scenarios", arguments.scenarios,
                 "directory of the files that clients may load and spawn from (load_scenario, spawn_entity); "
                 "without: any that the server can read")
      ->check(CLI::ExistingDirectory);
  app.add_flag("--edit", arguments.edit,
               "clients may replace the file of the loaded scenario (save_scenario_text)");
  app.add_option("--allow-fmus", arguments.allowed_fmus,
                 "directory whose FMUs scenarios may run; an FMU is code that runs on this machine")
      ->check(CLI::ExistingDirectory);
  app.add_option("--packages", arguments.packages, takt::command_line::kPackagesHelp)
      ->option_text("DIR ...")
      ->check(CLI::ExistingDirectory)
      ->allow_extra_args(false);
  app.add_option("--recordings", arguments.recordings,
                 "directory of such files made by request (start_recording)");
  app.add_option("--lod", arguments.level_of_detail, "level of detail of every process")
      ->check(takt::command_line::whole_number_from(1, 3));
  app.add_option("--set", arguments.overrides, "override a key of the scenario, e.g. solver.step_s=0.0005")
      ->option_text("KEY=VALUE ...")
      ->allow_extra_args(false);
}

/// `progress` exists during a long import.
takt::HostOptions host_options(const Arguments& arguments, std::optional<takt::Progress>& progress) {
  takt::HostOptions options;
  options.cell = arguments.cell;
  options.loop.pace = takt::enumerator_of<takt::Pace>(arguments.pace).value();
  options.loop.factor = arguments.factor;
  if (arguments.paused) options.loop.state = takt::SimulationState::paused;
  options.loop.realtime_priority = arguments.realtime_priority;
  options.loop.quit_at_end = arguments.exit_at_end;
  options.end_at_duration = arguments.exit_at_end || arguments.pause_at_end;
  options.threads = arguments.threads;
  options.snapshots = arguments.snapshots;
  options.loop.save_every_s = arguments.snapshot_every_s.value_or(0.0);
  options.log = arguments.log;
  options.recordings = arguments.recordings;
  options.scenarios = arguments.scenarios;
  options.edit = arguments.edit;
  options.fmus = takt::fmu_library(arguments.allowed_fmus);
  options.packages = takt::command_line::package_folders(arguments.packages);
  options.version = std::string("takt-server ") + TAKT_VERSION;
  options.cache_directory = takt::user_cache_directory();
  options.on_note = [&progress](const std::string& sentence) {
    progress.reset();
    std::fprintf(stderr, "takt-server: note: %s\n", sentence.c_str());
  };
  options.on_import = [&progress](const std::string& component, double part) {
    if (!progress) progress.emplace(false);
    progress->at_import(component, part);
    if (part >= 1.0) progress.reset();
  };
  return options;
}

/// To the main thread: the scenario has been opened, or refused.
constexpr int kOpened = SIGUSR1;

/// Runs `open` in a thread of its own, so that a signal can end the server during an import. False after a
/// signal. Throws the exceptions of `open`.
bool open_until_signal(const std::function<void()>& open, takt::CellHost& host, const sigset_t& signals,
                       const std::atomic<bool>& ended_itself) {
  const pthread_t main_thread = pthread_self();
  std::exception_ptr failure;
  std::thread opening([&] {
    try {
      open();
    } catch (...) {
      failure = std::current_exception();
    }
    pthread_kill(main_thread, kOpened);
  });
  sigset_t awaited = signals;
  sigaddset(&awaited, kOpened);
  int number = 0;
  sigwait(&awaited, &number);
  const bool ended = number != kOpened && !ended_itself.load();
  if (ended) host.give_up();
  if (number != kOpened) {
    // The present stage of the import may take long without a check for the signal.
    constexpr timespec kPatience{3, 0};
    sigset_t opened;
    sigemptyset(&opened);
    sigaddset(&opened, kOpened);
    if (sigtimedwait(&opened, nullptr, &kPatience) != kOpened && ended) {
      std::printf("takt-server: ended while a scenario was being read\n");
      std::fflush(nullptr);
      ::_exit(0);
    }
  }
  opening.join();
  if (ended) return false;
  if (failure) std::rethrow_exception(failure);
  return true;
}

/// What went wrong, for the person at the terminal.
const char* reason(const std::exception& error) {
  if (dynamic_cast<const std::bad_alloc*>(&error) == nullptr) return error.what();
  return "there is not enough memory; a limit on the address space (ulimit -v) may be too low.";
}

takt::ParticipantOptions participant_options(const Arguments& arguments, takt::CellHost& host) {
  takt::ParticipantOptions options{std::string(takt::kServerParticipant) + arguments.cell, arguments.domain,
                                   arguments.profiles, arguments.profile, arguments.secure};
  options.on_stalled = [&host, again = arguments.supervised] {
    const std::string sentence = host.outbound().events.post(takt::events::DiscoveryStalled{});
    std::fprintf(stderr, "takt-server: %s\n", sentence.c_str());
    std::fflush(nullptr);
    if (again) ::_exit(takt::kCrashed);
  };
  return options;
}

/// Fast DDS may not return: then the cell has ended all the same, with what it records.
void stop(takt::CellHost& host, takt::DdsAdapter& adapter) {
  host.stop();
  const takt::EndDeadline deadline(
      std::chrono::seconds(10), "takt-server: Fast DDS does not end; the process ends without it.", kFailed);
  adapter.stop();
}

/// Runs until a signal or the loop itself ends it.
int serve(const Arguments& arguments, const sigset_t& signals, const std::string& crash) {
  std::optional<takt::Progress> progress;
  takt::CellHost host(host_options(arguments, progress));
  takt::DdsAdapter adapter(host, participant_options(arguments, host), arguments.namespaced_clock_and_tf);
  const pthread_t main_thread = pthread_self();
  std::atomic<bool> ended_itself{false};
  host.set_on_quit([main_thread, &ended_itself] {
    ended_itself.store(true);
    pthread_kill(main_thread, SIGTERM);
  });
  std::optional<takt::ScenarioSource> source;
  if (!arguments.scenario.empty()) {
    source.emplace(
        takt::ScenarioSource{arguments.scenario, {arguments.overrides, arguments.level_of_detail}});
  }
  const auto open = [&] {
    if (!crash.empty()) {
      host.resume(crash, source);
    } else if (source) {
      host.open(*source);
    } else {
      host.open_empty();
    }
  };
  try {
    if (!open_until_signal(open, host, signals, ended_itself)) {
      progress.reset();
      std::printf("takt-server: cell '%s' ended before its scenario was read\n", arguments.cell.c_str());
      stop(host, adapter);
      return 0;
    }
  } catch (const std::exception& error) {
    progress.reset();
    std::fprintf(stderr, "takt-server: %s\n", reason(error));
    return kBadInput;
  }
  progress.reset();
  const takt::RunLoop* loop = host.loop();
  const std::string what = loop == nullptr ? "no scenario" : "scenario " + loop->cell().scenario;
  std::printf("takt-server: cell '%s' ready: %s, pace %s, domain %u\n", arguments.cell.c_str(), what.c_str(),
              arguments.pace.c_str(), arguments.domain);
  std::fflush(stdout);

  if (!ended_itself.load()) {
    int number = 0;
    sigwait(&signals, &number);
  }
  stop(host, adapter);
  const takt::Simulation* simulation = host.simulation();
  if (simulation == nullptr) {
    std::printf("takt-server: cell '%s' ended without a scenario\n", arguments.cell.c_str());
  } else {
    std::printf("takt-server: cell '%s' ended at %.3f s simulated time\n", arguments.cell.c_str(),
                simulation->time_s());
  }
  return 0;
}

int serve_or_say_why(const Arguments& arguments, const sigset_t& signals, const std::string& crash) {
  try {
    return serve(arguments, signals, crash);
  } catch (const takt::DdsError& error) {
    std::fprintf(stderr, "takt-server: %s\n", error.what());
    return crash.empty() ? kBadInput : kFailed;  // a restart is tried again
  } catch (const std::exception& error) {
    std::fprintf(stderr, "takt-server: %s\n", reason(error));
    return kFailed;
  }
}

/// Of the supervisor, for snapshots without a stated directory. Its name contains the process id, so that a
/// later server can remove the directory of a killed one.
struct TemporaryDirectory {
  TemporaryDirectory() {
    const std::filesystem::path all = std::filesystem::temp_directory_path();
    const std::string kind = "takt_snapshots_";
    std::error_code unreadable;
    for (const auto& entry : std::filesystem::directory_iterator(all, unreadable)) {
      const std::string found = entry.path().filename().string();
      const pid_t of = found.starts_with(kind) ? std::atoi(found.c_str() + kind.size()) : 0;
      if (of > 0 && ::kill(of, 0) != 0 && errno == ESRCH)
        std::filesystem::remove_all(entry.path(), unreadable);
    }
    std::string name = (all / (kind + std::to_string(::getpid()) + "_")).string() + std::string(6, 'X');
    if (::mkdtemp(name.data()) == nullptr) throw std::runtime_error(name + " cannot be made");
    path = name;
    owner = ::getpid();
  }
  ~TemporaryDirectory() {
    if (::getpid() != owner) return;  // a child that ends
    std::error_code left_behind;
    std::filesystem::remove_all(path, left_behind);
  }
  std::filesystem::path path;
  pid_t owner = 0;
};

}  // namespace

int main(int argc, char** argv) {
  // All threads inherit this mask: the signals that end the server are taken by sigwait alone.
  sigset_t signals;
  sigemptyset(&signals);
  for (const int number : takt::ending_signals()) sigaddset(&signals, number);
  sigset_t blocked = signals;
  sigaddset(&blocked, kOpened);
  pthread_sigmask(SIG_BLOCK, &blocked, nullptr);
  // A log or snapshot that may grow no further (RLIMIT_FSIZE) fails like one on a full disk.
  ::signal(SIGXFSZ, SIG_IGN);

  Arguments arguments;
  CLI::App app("Simulates the robotic cell of a scenario as a service over DDS.", "takt-server");
  takt::command_line::wrap_help(app);
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
  if (arguments.scenario.empty()) {
    const char* of_scenario = !arguments.overrides.empty() ? "--set"
                              : arguments.level_of_detail  ? "--lod"
                                                           : nullptr;
    if (of_scenario != nullptr) {
      std::fprintf(stderr, "takt-server: %s concerns a scenario, but none was given\n", of_scenario);
      return kBadInput;
    }
  }
  if (arguments.snapshot_every_s && arguments.snapshots.empty()) {
    std::fprintf(stderr, "takt-server: --snapshot-every needs --snapshots DIR\n");
    return kBadInput;
  }
  if (!arguments.snapshots.empty()) {
    try {
      const takt::SessionStore store(arguments.snapshots, arguments.cell);
    } catch (const std::exception& error) {
      std::fprintf(stderr, "takt-server: %s\n", error.what());
      return kBadInput;
    }
  }
  if (!arguments.supervised) return serve_or_say_why(arguments, signals, "");
  std::optional<TemporaryDirectory> own;
  if (arguments.snapshots.empty()) arguments.snapshots = own.emplace().path;
  if (!arguments.snapshot_every_s) arguments.snapshot_every_s = 0.5;
  takt::SupervisorOptions options;
  options.on_note = [](const std::string& sentence) {
    std::printf("takt-server: supervisor: %s\n", sentence.c_str());
    std::fflush(stdout);
  };
  return takt::supervise(
      [&](const std::string& crash) { return serve_or_say_why(arguments, signals, crash); }, options);
}

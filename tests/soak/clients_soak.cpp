// Sixteen clients of one cell for minutes: two command robots at 1 kHz, fourteen watch at 250 Hz, each a
// process of its own, as is the server. Goals (docs/quality.md): no reliable sample is lost to a client that
// reads, every request is answered, commands take effect within 3 ms (p99), the loop keeps its miss rate.
// With --faults three more are among them: one that is frozen for half of the time, one that is killed
// repeatedly, one that floods the server with commands and requests. With --kills N it is another run:
// clients that watch or command are killed at random moments, four at a time, N in total.
#include <signal.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cinttypes>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <memory>
#include <random>
#include <sstream>

#include "client_lib/client.h"
#include "idl/common/stamp.h"
#include "server/runtime/monotonic_clock.h"
#include "tests/soak/bare_loop.h"
#include "tests/soak/soak_report.h"
#include "tests/support/child_process.h"

namespace takt::test {
namespace {

/// The worst of all reports.
struct Percentiles {
  double p50_s = 0.0, p99_s = 0.0, max_s = 0.0;
  void include(double p50, double p99, double max) {
    p50_s = std::max(p50_s, p50), p99_s = std::max(p99_s, p99), max_s = std::max(max_s, max);
  }
};

/// The server searches for stale files of dead clients every 20 s.
constexpr std::int64_t kStaleFilesGone_ns = 45'000'000'000;

struct Options {
  double minutes = 10.0;
  bool faults = false;
  int kills = 0;
  int realtime_priority = 0;
  unsigned seed = 1;
  // Of the programs that this one starts.
  std::string role, robot, cell, profiles, profile = "takt_client";
  int domain = 0;
  double seconds = 0.0;
};

void wait_until(std::int64_t when_ns) {
  system_monotonic_clock().sleep_until_ns(when_ns);
}

Client connect(const Options& options, const std::string& name, std::uint32_t strength = 1) {
  ClientOptions client;
  client.cell = options.cell;
  client.domain = options.domain;
  client.timeout = Seconds(60.0);
  client.liveliness_timeout = Seconds(60.0);
  client.name = name;
  client.ownership_strength = strength;
  client.profiles_file = options.profiles;
  client.profile = options.profile;
  return Client(client);
}

/// Calls `work` at this rate until the time is over.
template <typename Work>
void at_rate(double hertz, double seconds, Work work) {
  const std::int64_t begin = monotonic_now_ns();
  const auto period_ns = static_cast<std::int64_t>(1e9 / hertz);
  const auto count = static_cast<std::int64_t>(seconds * hertz);
  for (std::int64_t i = 0; i < count; ++i) {
    wait_until(begin + i * period_ns);
    work(static_cast<double>(i) / hertz);
  }
}

int watch(const Options& options) {
  Client cell = connect(options, "watcher");
  std::uint64_t states = 0, events = 0, missed = 0, newest = 0, last = 0;
  at_rate(250.0, options.seconds, [&](double) {
    try {
      const std::uint64_t step = cell.state().step;
      states += step != newest ? 1U : 0U;
      newest = step;
    } catch (const ClientError&) {  // the cell was not heard for long, as by one that was frozen
    }
    while (const auto event = cell.wait_for(takt::topics::event, Seconds(0.0))) {
      ++events;
      missed += event->missed_before;
      if (last != 0 && event->sequence_number != last + 1 + event->missed_before) ++missed;
      last = event->sequence_number;
    }
  });
  std::printf("result %" PRIu64 " %" PRIu64 " %" PRIu64 "\n", states, events, missed);
  return 0;
}

int command(const Options& options) {
  Client cell = connect(options, "commander", 10);
  std::vector<double> home;
  for (const auto& robot : cell.cell()->robots) {
    if (robot.name == options.robot)
      home = cell.state().robots[static_cast<std::size_t>(cell.cell()->find_robot(options.robot))].position;
  }
  std::uint64_t sent = 0;
  at_rate(1000.0, options.seconds, [&](double t) {
    std::vector<double> q = home, v(home.size(), 0.0);
    constexpr double kAmplitude = 0.02, kOmega = 2.0;
    q[0] += kAmplitude * (1.0 - std::cos(kOmega * t));
    v[0] = kAmplitude * kOmega * std::sin(kOmega * t);
    cell.send_joint_command(options.robot, q, v);
    ++sent;
  });
  std::printf("result %" PRIu64 " 0 0\n", sent);
  return 0;
}

/// Commands of a robot that others own, invalid commands, and requests without waiting.
int flood(const Options& options) {
  Client cell = connect(options, "flooder", 0);
  const std::vector<double> wrong(cell.cell()->robots.front().joints.size(), 100.0);
  const std::int64_t end = monotonic_now_ns() + static_cast<std::int64_t>(1e9 * options.seconds);
  std::uint64_t sent = 0;
  while (monotonic_now_ns() < end) {
    for (int i = 0; i < 50; ++i, ++sent) cell.send_joint_command(options.robot, wrong);
    (void)cell.get_state();
  }
  std::printf("result %" PRIu64 " 0 0\n", sent);
  return 0;
}

/// Over a line that loses, repeats and delays packets or is cut (network.sh): commands at 100 Hz, states,
/// events, requests; a line for each second of wall time. The stamp of the n-th command is n ms, so that each
/// state shows the newest applied command: of n commands at most n may be applied, and none after a newer
/// one.
int over_the_line(const Options& options) {
  Client cell = connect(options, "far", 10);
  const auto info = cell.cell();
  const std::string robot = info->robots[0].name;
  const std::vector<double> home = cell.state().robots[0].position;
  std::uint64_t sent = 0, states = 0, missed = 0, events = 0, answered = 0, unanswered = 0, newest = 0;
  std::uint64_t applied = cell.state().applied.front().count, number = 0;  // count, and number of the newest
  std::uint64_t twice = 0, old = 0, refused = 0;
  std::vector<std::int64_t> sent_ns{0};
  double slowest_s = 0.0, effect_s = 0.0;
  Status status = cell.status();
  const auto look_at_applied = [&](const AppliedCommand& now) {
    const auto newest_number =
        static_cast<std::uint64_t>(std::llround(1e3 * std::max(0.0, seconds_of(now.newest_stamp))));
    const std::uint64_t more = now.count - applied;
    const std::uint64_t most = newest_number > number ? newest_number - number : 0;
    if (newest_number < number) ++old;
    if (more > most) twice += more - most;
    if (newest_number > number && newest_number < sent_ns.size())
      effect_s = std::max(effect_s, 1e-9 * static_cast<double>(monotonic_now_ns() - sent_ns[newest_number]));
    applied = now.count;
    number = newest_number;
  };
  std::printf(
      "# time states commands_sent commands_applied events events_missed answered unanswered slowest_ms "
      "applied_twice applied_old refused effect_ms steps schedule_resets\n");
  at_rate(100.0, options.seconds, [&](double t) {
    std::vector<double> q = home;
    q[0] += 0.01 * std::sin(t);
    ++sent;
    sent_ns.push_back(monotonic_now_ns());
    try {
      cell.send_joint_command(robot, q, {}, 1e-3 * static_cast<double>(sent));
      const auto state = cell.wait_for(takt::topics::state, Seconds(0.0));
      if (state && state->step != newest) {
        ++states;
        look_at_applied(state->applied.front());
        newest = state->step;
      }
      while (const auto event = cell.wait_for(takt::topics::event, Seconds(0.0))) {
        ++events;
        missed += event->missed_before;
        if (event->code == "command_rejected" && event->subject == robot) ++refused;
      }
      if (sent % 10 == 0) cell.set_gripper("Gripper1", GripperAction::width, 100.0);
      if (const auto now = cell.wait_for(takt::topics::status, Seconds(0.0))) status = *now;
    } catch (const ClientError&) {  // the cell is out of reach
    }
    if (sent % 20 == 0) {
      const std::int64_t asked = monotonic_now_ns();
      try {
        (void)cell.call(takt::requests::GetState{}, Seconds(0.2));
        ++answered;
      } catch (const ClientError&) {
        ++unanswered;
      }
      slowest_s = std::max(slowest_s, 1e-9 * static_cast<double>(monotonic_now_ns() - asked));
    }
    if (sent % 100 == 0) {
      timespec now{};
      clock_gettime(CLOCK_REALTIME, &now);
      std::printf("%.3f", static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec));
      for (const std::uint64_t count : {states, sent, applied, events, missed, answered, unanswered})
        std::printf(" %" PRIu64, count);
      std::printf(" %.1f %" PRIu64 " %" PRIu64 " %" PRIu64 " %.1f %" PRIu64 " %" PRIu64 "\n", 1e3 * slowest_s,
                  twice, old, refused, 1e3 * effect_s, status.step, status.schedule_resets);
      std::fflush(stdout);
      states = 0;
      slowest_s = effect_s = 0.0;
    }
  });
  const Status last = cell.status();
  std::printf("# server: overruns %" PRIu64 " of %" PRIu64 " steps, schedule resets %" PRIu64
              ", fault '%s'\n",
              last.overruns, last.step, last.schedule_resets, last.fault.c_str());
  return 0;
}

struct Result {
  std::uint64_t a = 0, b = 0, c = 0;
  bool good = false;
};
Result result_of(ChildProcess& child) {
  Result result;
  const int code = child.wait();
  const auto at = child.text.rfind("result ");
  if (code != 0 || at == std::string::npos) {
    std::printf("%s\n", child.text.c_str());
    return result;
  }
  std::istringstream(child.text.substr(at + 7)) >> result.a >> result.b >> result.c;
  result.good = true;
  return result;
}

/// The command line of the server; names the cell.
std::vector<std::string> server_command(Options& options, const std::string& self) {
  const std::string bin = std::filesystem::path(self).parent_path().string();
  options.cell = "soak_" + std::to_string(getpid());
  options.domain = 100 + getpid() % 100;
  std::vector<std::string> server{bin + "/takt-server",
                                  std::string(TAKT_CONFIG_DIR) + "/scenarios/block_assembly.yaml",
                                  "--cell",
                                  options.cell,
                                  "--domain",
                                  std::to_string(options.domain),
                                  "--set",
                                  "duration_s=1000000"};
  if (options.realtime_priority > 0) {
    server.push_back("--realtime-priority");
    server.push_back(std::to_string(options.realtime_priority));
  }
  return server;
}

std::unique_ptr<ChildProcess> start_client(const Options& options, const std::string& self,
                                           const std::string& role, const std::string& robot) {
  return std::make_unique<ChildProcess>(
      std::vector<std::string>{self, "--role", role, "--robot", robot, "--cell", options.cell, "--domain",
                               std::to_string(options.domain), "--seconds", std::to_string(options.seconds)});
}

/// Each client lives for up to three seconds from the start of its process, so that some are killed ahead of
/// the discovery of the cell, some during it, most during their work.
int kill_clients(Options options, const std::string& self) {
  ChildProcess service(server_command(options, self));
  options.seconds = 1e6;
  Client cell = connect(options, "leader", 5);
  const auto steady = start_client(options, self, "command", "Robot1");
  struct Victim {
    std::unique_ptr<ChildProcess> process;
    std::int64_t dies_ns = 0;
  };
  std::vector<Victim> victims(4);
  std::mt19937 dice(options.seed);
  const std::int64_t begin = monotonic_now_ns(), warm_ns = begin + 10'000'000'000;
  wait_until(warm_ns);
  const Status first = cell.status();
  const Resources at_first = resources(service.pid());
  std::uint64_t kills = 0, requests = 0, events = 0, missed = 0, applied = 0, standing = 0;
  double slowest_reply_s = 0.0;
  Percentiles latency;
  Status last = first;
  std::int64_t next_look_ns = 0;
  while (kills < static_cast<std::uint64_t>(options.kills)) {
    const std::int64_t now = monotonic_now_ns();
    for (Victim& victim : victims) {
      if (victim.process && now < victim.dies_ns) continue;
      if (victim.process) {
        victim.process->signal(SIGKILL);
        (void)victim.process->wait();
        ++kills;
      }
      const bool commands = dice() % 2 == 0;
      victim.process = start_client(options, self, commands ? "command" : "watch", "Robot2");
      victim.dies_ns = monotonic_now_ns() + 1'000'000 * static_cast<std::int64_t>(dice() % 3000);
    }
    if (now >= next_look_ns) {
      next_look_ns = now + 250'000'000;
      cell.set_gripper("Gripper1", GripperAction::width, 100.0);  // refused, with an event for all
      const std::int64_t asked = monotonic_now_ns();
      (void)cell.get_state();
      ++requests;
      slowest_reply_s = std::max(slowest_reply_s, 1e-9 * static_cast<double>(monotonic_now_ns() - asked));
      while (const auto event = cell.wait_for(takt::topics::event, Seconds(0.0)))
        ++events, missed += event->missed_before;
      const Status present = cell.status();
      if (present.wall_time > last.wall_time && present.step <= last.step) ++standing;
      last = present;
      latency.include(last.command_latency_p50, last.command_latency_p99, last.command_latency_max);
    }
    wait_until(now + 5'000'000);
  }
  victims.clear();  // killed as well
  wait_until(monotonic_now_ns() + kStaleFilesGone_ns);
  last = cell.status();
  applied = cell.state().applied.front().count;
  const Resources at_last = resources(service.pid());
  const auto steps = static_cast<double>(last.step - first.step);
  Report report;
  report.line("clients killed", static_cast<double>(kills), "");
  report.line("wall time", last.wall_time - first.wall_time, "s");
  report.must_be_zero("server gone or at fault", cell.connected() && last.fault.empty() ? 0U : 1U);
  report.must_be_zero("reports without a step since the one before", standing);
  report.must_be_zero("events lost by a client that lived", missed);
  report.line("events received by it", static_cast<double>(events), "");
  report.line("requests answered", static_cast<double>(requests), "");
  report.line("slowest reply", 1e3 * slowest_reply_s, "ms");
  report.line("commands applied of the robot whose owner lived", static_cast<double>(applied), "");
  report.line("steps", steps, "");
  report.line("missed ticks", 100.0 * static_cast<double>(last.overruns - first.overruns) / steps, "%");
  report.line("schedule re-based", static_cast<double>(last.schedule_resets - first.schedule_resets),
              "times");
  report.line("step, p99", 1e6 * last.step_time_p99, "us");
  report.line("step, longest", 1e6 * last.step_time_max, "us");
  report.line("command to effect, p99 (worst of all reports)", 1e3 * latency.p99_s, "ms");
  report_growth(report, at_first, at_last);
  service.signal(SIGTERM);
  report.must_be_zero("exit code of the server", static_cast<std::uint64_t>(service.wait()));
  return report.missed() == 0 ? 0 : 1;
}

int lead(Options options, const std::string& self) {
  ChildProcess service(server_command(options, self));
  options.seconds = 60.0 * options.minutes;
  Client cell = connect(options, "leader", 5);
  const auto start = [&](const std::string& role, const std::string& robot) {
    return start_client(options, self, role, robot);
  };
  using Child = std::unique_ptr<ChildProcess>;
  const Resources before_clients = resources(service.pid());
  std::vector<Child> commanders, watchers;
  for (const char* robot : {"Robot1", "Robot2"}) commanders.push_back(start("command", robot));
  for (int i = 0; i < 14; ++i) watchers.push_back(start("watch", ""));
  Child frozen, killed, flooder;
  if (options.faults) {
    frozen = start("watch", "");
    killed = start("watch", "");
    flooder = start("flood", "Robot1");
  }
  // A common start of all programs is no steady state.
  const double warm_up_s = std::min(10.0, 0.2 * options.seconds);
  const std::int64_t begin = monotonic_now_ns();
  wait_until(begin + static_cast<std::int64_t>(1e9 * warm_up_s));
  const Status first = cell.status();
  const Resources at_first = resources(service.pid());
  BareLoop bare(options.realtime_priority);

  std::mt19937 dice(options.seed);
  std::uint64_t requests = 0, wrong = 0, kills = 0;
  double slowest_reply_s = 0.0;
  double next_kill_s = warm_up_s + 3.0;
  bool is_frozen = false;
  Percentiles step, wakeup_latency, latency;
  Status last = first;
  while (true) {
    const double t = 1e-9 * static_cast<double>(monotonic_now_ns() - begin);
    if (t > options.seconds - 1.0) break;
    // Each wrong command is an event for all clients, which must not be lost.
    cell.set_gripper("Gripper1", GripperAction::width, 100.0);
    ++wrong;
    const std::int64_t asked = monotonic_now_ns();
    (void)cell.get_state();
    ++requests;
    slowest_reply_s = std::max(slowest_reply_s, 1e-9 * static_cast<double>(monotonic_now_ns() - asked));
    while (cell.wait_for(takt::topics::event, Seconds(0.0))) {
    }
    last = cell.status();
    step.include(last.step_time_p50, last.step_time_p99, last.step_time_max);
    wakeup_latency.include(last.wakeup_latency_p50, last.wakeup_latency_p99, last.wakeup_latency_max);
    latency.include(last.command_latency_p50, last.command_latency_p99, last.command_latency_max);
    if (options.faults) {
      const bool freeze = t > 0.25 * options.seconds && t < 0.75 * options.seconds;
      if (freeze != is_frozen) frozen->signal(freeze ? SIGSTOP : SIGCONT);
      is_frozen = freeze;
      if (t > next_kill_s) {
        killed->signal(SIGKILL);
        (void)killed->wait();
        killed = start("watch", "");
        ++kills;
        next_kill_s = t + 1.0 + 0.001 * static_cast<double>(dice() % 9000);
      }
    }
    wait_until(asked + 50'000'000);
  }
  const BareLoop::Figures machine = bare.figures();
  const Resources at_last = resources(service.pid());
  const bool running = cell.connected() && last.fault.empty();

  std::printf("scheduling: %s\n", last.scheduling.c_str());
  Report report;
  std::uint64_t states = 0, events = 0, lost = 0, failed = 0, sent = 0;
  for (auto& child : watchers) {
    const Result result = result_of(*child);
    failed += result.good ? 0U : 1U;
    states += result.a, events += result.b, lost += result.c;
  }
  for (auto& child : commanders) {
    const Result result = result_of(*child);
    failed += result.good ? 0U : 1U;
    sent += result.a;
  }
  const double watched_s = options.seconds * static_cast<double>(watchers.size());
  const auto steps = static_cast<double>(last.step - first.step);
  const double wall_s = last.wall_time - first.wall_time;
  report.line("wall time of the measurement", wall_s, "s");
  report.must_be_zero("server gone, at fault, or a client failed", (running ? 0U : 1U) + failed);
  report.must_be_zero("events lost by fourteen watchers", lost);
  report.line("events received by them", static_cast<double>(events), "");
  report.line("different states seen by each", static_cast<double>(states) / watched_s, "Hz");
  report.line("commands sent", static_cast<double>(sent), "");
  report.line("commands applied", static_cast<double>(last.commands_applied - first.commands_applied), "");
  report.line("wrong commands sent by the leader", static_cast<double>(wrong), "");
  report.line("commands rejected", static_cast<double>(last.commands_rejected - first.commands_rejected), "");
  report.line("requests answered", static_cast<double>(requests), "");
  report.line("slowest reply", 1e3 * slowest_reply_s, "ms");
  report.line("steps", steps, "");
  report.line("missed ticks", 100.0 * static_cast<double>(last.overruns - first.overruns) / steps, "%",
              options.realtime_priority > 0 ? 0.1 : 1.0);
  report.line("missed by a loop that does nothing, beside it", machine.missed_percent, "%");
  report.line("longest lag of that loop", 1e3 * machine.longest_lag_s, "ms");
  report.line("schedule re-based", static_cast<double>(last.schedule_resets - first.schedule_resets),
              "times");
  report.line("simulated / wall time", (last.time - first.time) / wall_s, "");
  report.line("step, p99 (worst of all reports)", 1e6 * step.p99_s, "us", 500.0);
  report.line("step, longest", 1e6 * step.max_s, "us");
  report.line("wake-up, p99 (worst of all reports)", 1e6 * wakeup_latency.p99_s, "us");
  report.line("command to effect, p99 (worst of all reports)", 1e3 * latency.p99_s, "ms", 3.0);
  report.line("command to effect, longest", 1e3 * latency.max_s, "ms");
  report_growth(report, at_first, at_last);
  if (options.faults) {
    report.line("clients killed", static_cast<double>(kills), "");
    report.line("commands of the flood", static_cast<double>(result_of(*flooder).a), "");
    report.must_be_zero("the frozen client did not come back", result_of(*frozen).good ? 0U : 1U);
    killed.reset();
    wait_until(monotonic_now_ns() + kStaleFilesGone_ns);
    const Resources after_clients = resources(service.pid());
    report.must_be_zero("shared memory files after all clients, more than before them",
                        after_clients.shared_memory_files -
                            std::min(after_clients.shared_memory_files, before_clients.shared_memory_files));
  }
  service.signal(SIGTERM);
  const int code = service.wait();
  report.must_be_zero("exit code of the server", static_cast<std::uint64_t>(code));
  return report.missed() == 0 ? 0 : 1;
}

}  // namespace
}  // namespace takt::test

int main(int argc, char** argv) {
  using namespace takt::test;
  Options options;
  CLI::App app("Sixteen clients of one cell. Exit code 0: every goal was reached.");
  app.add_option("--minutes", options.minutes)->capture_default_str()->check(CLI::Range(0.05, 10000.0));
  app.add_flag("--faults", options.faults, "a frozen, a killed and a flooding client are among them");
  app.add_option("--kills", options.kills, "instead: so many clients are killed at random moments")
      ->check(CLI::Range(1, 1000000));
  app.add_option("--realtime-priority", options.realtime_priority,
                 "of the server: 1 to 99 asks for SCHED_FIFO");
  app.add_option("--seed", options.seed, "of when clients are killed")->capture_default_str();
  for (auto* option :
       {app.add_option("--role", options.role), app.add_option("--robot", options.robot),
        app.add_option("--cell", options.cell), app.add_option("--domain", options.domain),
        app.add_option("--seconds", options.seconds), app.add_option("--profiles", options.profiles),
        app.add_option("--profile", options.profile)})
    option->group("");
  CLI11_PARSE(app, argc, argv);
  try {
    if (options.role == "watch") return watch(options);
    if (options.role == "command") return command(options);
    if (options.role == "flood") return flood(options);
    if (options.role == "line") return over_the_line(options);
    const std::string self = std::filesystem::canonical("/proc/self/exe").string();
    return options.kills > 0 ? kill_clients(options, self) : lead(options, self);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 2;
  }
}

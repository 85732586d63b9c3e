// A supervised server that is killed repeatedly at random moments, with clients that survive: one commands a
// robot at 100 Hz, others watch. Goals (docs/quality.md): it resumes from a snapshot at most 1 s old, and
// within 3 s each client receives samples again and the commander's commands take effect.
#include <signal.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <memory>
#include <optional>
#include <random>
#include <stdexcept>
#include <vector>

#include "client_lib/client.h"
#include "server/runtime/monotonic_clock.h"
#include "tests/soak/soak_report.h"
#include "tests/support/child_process.h"

namespace takt::test {
namespace {

/// The supervisor gives up after the fifth crash in 60 s.
constexpr double kLeastLife_s = 15.5;

struct Options {
  int kills = 10;
  int watchers = 4;
  unsigned seed = 1;
};

/// The process that the supervisor says it has started.
pid_t wait_for_server(ChildProcess& supervisor) {
  const std::string words = "the server is process ";
  if (!supervisor.wait_for_output(words)) throw std::runtime_error(supervisor.text);
  supervisor.text.erase(0, supervisor.text.find(words) + words.size());
  if (!supervisor.wait_for_output("ready")) throw std::runtime_error(supervisor.text);
  return static_cast<pid_t>(std::stol(supervisor.text));
}

double seconds_since(std::int64_t begin_ns) {
  return 1e-9 * static_cast<double>(monotonic_now_ns() - begin_ns);
}

std::uint64_t applied(const State& state) {
  return state.applied.front().count;
}

/// One life of the server and the way into the next.
struct Restart {
  double lost_s = 0.0;     ///< simulated time by which the snapshot is older than the last state seen
  double seen_s = 0.0;     ///< from the kill until the last client saw the new epoch
  double applied_s = 0.0;  ///< from the kill until a command took effect again
};

class Cell {
 public:
  explicit Cell(const Options& options) : dice_(options.seed) {
    const std::string bin = std::filesystem::canonical("/proc/self/exe").parent_path().string();
    name_ = "restarts_" + std::to_string(getpid());
    domain_ = 100 + getpid() % 100;
    supervisor_ = std::make_unique<ChildProcess>(std::vector<std::string>{
        bin + "/takt-server", std::string(TAKT_CONFIG_DIR) + "/scenarios/block_assembly.yaml", "--cell",
        name_, "--domain", std::to_string(domain_), "--supervised", "--set", "duration_s=1000000"});
    server_ = wait_for_server(*supervisor_);
    commander_ = connect("commander");
    for (int i = 0; i < options.watchers; ++i) watchers_.push_back(connect("watcher"));
    robot_ = commander_->cell()->robots.front().name;
    home_ = commander_->state().robots.front().position;
  }

  Restart live_and_die() {
    const double life_s = kLeastLife_s + 1e-3 * static_cast<double>(dice_() % 2000);
    for (const std::int64_t begin = monotonic_now_ns(); seconds_since(begin) < life_s;) command();
    // Late clients get the report of a restart again.
    while (commander_->wait_for(takt::topics::event, Seconds(0.0))) {
    }
    const State before = commander_->state();
    kill(server_, SIGKILL);
    const std::int64_t killed = monotonic_now_ns();
    Restart restart;
    std::vector<bool> seen(watchers_.size(), false);
    bool commands_again = false;
    std::optional<std::uint64_t> applied_first;  // by the new server's first state
    while (!commands_again || std::count(seen.begin(), seen.end(), false) > 0) {
      if (seconds_since(killed) > 60.0)
        throw std::runtime_error("A client did not find the server again in 60 s.");
      command();
      const auto now = newer(*commander_, before.epoch);
      if (now && !applied_first) applied_first = applied(*now);
      if (now && !commands_again && applied(*now) > *applied_first) {
        commands_again = true;
        restart.applied_s = seconds_since(killed);
      }
      for (std::size_t i = 0; i < watchers_.size(); ++i) {
        if (seen[i] || !newer(*watchers_[i], before.epoch)) continue;
        seen[i] = true;
        restart.seen_s = seconds_since(killed);
      }
    }
    restart.lost_s = before.time - restored_time_s();
    server_ = wait_for_server(*supervisor_);
    return restart;
  }

  int end() {
    supervisor_->signal(SIGTERM);
    return supervisor_->wait();
  }
  Resources held() const { return resources(server_); }

 private:
  std::unique_ptr<Client> connect(const std::string& name) const {
    ClientOptions options;
    options.cell = name_;
    options.domain = domain_;
    options.timeout = Seconds(60.0);
    options.name = name;
    return std::make_unique<Client>(options);
  }
  /// The instant at which the new server resumes, from its event.
  double restored_time_s() const {
    const auto reported = commander_->wait_for(
        takt::topics::event, [](const auto& event) { return event.code == "restarted"; }, Seconds(10.0));
    const std::string words = "goes on at ";
    const std::size_t at = reported ? reported->message.find(words) : std::string::npos;
    if (at == std::string::npos) throw std::runtime_error("The server did not say where it goes on.");
    return std::stod(reported->message.substr(at + words.size()));
  }
  /// A state of a later epoch, if one is there.
  static std::optional<State> newer(const Client& client, std::uint32_t epoch) {
    try {
      State state = client.state();
      if (state.epoch > epoch) return state;
    } catch (const ClientError&) {  // it has detected the loss of the server
    }
    return std::nullopt;
  }
  /// One of 100 a second.
  void command() {
    next_ns_ = std::max(next_ns_ + 10'000'000, monotonic_now_ns());
    system_monotonic_clock().sleep_until_ns(next_ns_);
    std::vector<double> target = home_;
    target[0] += 1e-3 * static_cast<double>(++sent_ % 2);
    try {
      commander_->send_joint_command(robot_, target);
    } catch (const ClientError&) {
    }
  }

  std::mt19937 dice_;
  std::string name_, robot_;
  int domain_ = 0;
  std::unique_ptr<ChildProcess> supervisor_;
  pid_t server_ = -1;
  std::unique_ptr<Client> commander_;
  std::vector<std::unique_ptr<Client>> watchers_;
  std::vector<double> home_;
  std::int64_t next_ns_ = 0;
  std::uint64_t sent_ = 0;
};

int run(const Options& options) {
  Cell cell(options);
  const Resources first = cell.held();
  std::vector<Restart> all;
  for (int i = 0; i < options.kills; ++i) {
    all.push_back(cell.live_and_die());
    std::printf(
        "killed %d: %.3f s of simulated time lost, seen by all after %.3f s, commanded after %.3f s\n", i + 1,
        all.back().lost_s, all.back().seen_s, all.back().applied_s);
    std::fflush(stdout);
  }
  const auto worst = [&](double Restart::*figure) {
    double most = 0.0;
    for (const Restart& restart : all) most = std::max(most, restart.*figure);
    return most;
  };
  Report report;
  report.line("server killed", options.kills, "times");
  report.line("snapshot older than the last state, at most", worst(&Restart::lost_s), "s", 1.0);
  report.line("all clients see it again after, at most", worst(&Restart::seen_s), "s", 3.0);
  report.line("commands take effect again after, at most", worst(&Restart::applied_s), "s", 3.0);
  report_growth(report, first, cell.held());
  report.must_be_zero("exit code of the supervisor", static_cast<std::uint64_t>(cell.end()));
  return report.missed() == 0 ? 0 : 1;
}

}  // namespace
}  // namespace takt::test

int main(int argc, char** argv) {
  using namespace takt::test;
  Options options;
  CLI::App app("A supervised server that is killed again and again. Exit code 0: every goal was reached.");
  app.add_option("--kills", options.kills, "how often")->capture_default_str()->check(CLI::Range(1, 100000));
  app.add_option("--watchers", options.watchers, "clients beside the one that commands")
      ->capture_default_str()
      ->check(CLI::Range(1, 100));
  app.add_option("--seed", options.seed, "of when")->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  try {
    return run(options);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 2;
  }
}

// Forged packets against the clients of a cell: after one of each kind, how long until each client is served again.
// The clients: takt::Client in this process, takt record, takt-controller, and a client in Python.
#include <CLI/CLI.hpp>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <regex>
#include <thread>

#include "client_lib/raw_topics.h"
#include "tests/support/child_process.h"
#include "tests/support/forged_kinds.h"
#include "tests/support/service_cell.h"
#include "tests/support/test_domain.h"

namespace takt::test {
namespace {

namespace fs = std::filesystem;
using SteadyClock = std::chrono::steady_clock;

constexpr double kGoal_s = 2.0, kPatience_s = 20.0;

/// A directory of its own, gone at the end.
class Directory {
 public:
  Directory() {
    std::string name = fs::temp_directory_path() / ("takt_hostile_" + std::string(6, 'X'));
    if (mkdtemp(name.data()) == nullptr) throw std::runtime_error("no directory for files");
    path_ = name;
  }
  ~Directory() {
    std::error_code error;
    fs::remove_all(path_, error);
  }
  Directory(const Directory&) = delete;
  Directory& operator=(const Directory&) = delete;
  fs::path operator/(const std::string& name) const { return path_ / name; }
  void write(const std::string& name, const std::string& text) const { std::ofstream(path_ / name) << text; }

 private:
  fs::path path_;
};

/// A program that prints the simulated time again and again ("12.345 s"), and the newest time that it has printed.
class FollowingProgram {
 public:
  explicit FollowingProgram(const std::vector<std::string>& command)
      : program_(command), reader_([this] { read_all(); }) {}
  ~FollowingProgram() {
    program_.signal(SIGKILL);
    reader_.join();
  }
  FollowingProgram(const FollowingProgram&) = delete;
  FollowingProgram& operator=(const FollowingProgram&) = delete;
  double newest_s() const { return newest_s_; }
  bool ended() const { return ended_; }

 private:
  void read_all() {
    const std::regex time("([0-9]+\\.[0-9]{3}) s");
    while (program_.wait_for_output("\n")) {
      for (std::sregex_iterator i(program_.text.begin(), program_.text.end(), time), end; i != end; ++i)
        newest_s_ = std::stod((*i)[1]);
      program_.text.clear();
    }
    ended_ = true;
  }
  ChildProcess program_;
  std::atomic<double> newest_s_{0.0};
  std::atomic<bool> ended_{false};
  std::thread reader_;
};

/// A client: whether it has received something that the server sent after the simulated time `s`.
struct Served {
  std::string name;
  std::function<bool(double s)> beyond;
};

int run(const std::string& python_dir) {
  deliver_through_transports();
  const fs::path bin = fs::read_symlink("/proc/self/exe").parent_path();
  const Directory directory;
  directory.write("cell.yaml", service_scenario_text());
  directory.write("move.lua",
                  "period_s = 0.008\nroutine(\"Robot1\", function(r)\n  while true do\n"
                  "    r:move_joints({0.1, -1.5, 1.5, -1.5, -1.5, 0})\n"
                  "    r:move_joints({-0.1, -1.5, 1.5, -1.5, -1.5, 0})\n  end\nend)\n");
  directory.write("follow.py",
                  "import sys, takt\nclient = takt.Client(cell=sys.argv[1], domain=int(sys.argv[2]))\n"
                  "while True:\n  seen = client.state.step\n"
                  "  state = client.wait_for_state(lambda s: s.step > seen + 20, timeout=1e6)\n"
                  "  print(f'{state.time:.3f} s', flush=True)\n");
  const std::string cell = test_cell(), domain = std::to_string(test_domain());
  setenv("PYTHONPATH", python_dir.c_str(), 1);
  const std::vector<std::string> where{"--cell", cell, "--domain", domain};
  const auto program = [&](const std::string& name, std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), bin / name);
    arguments.insert(arguments.end(), where.begin(), where.end());
    return arguments;
  };
  ChildProcess server(program("takt-server", {directory / "cell.yaml"}));
  if (!server.wait_for_output("ready")) {
    std::printf("the server has not started: %s\n", server.text.c_str());
    return 2;
  }
  ClientOptions options;
  options.cell = cell;
  options.domain = static_cast<int>(test_domain());
  auto client = std::make_unique<Client>(options);
  client->set_pace(Pace::realtime);
  client->play();

  const fs::path recording = directory / "all.mcap";
  FollowingProgram record({bin / "takt", "--cell", cell, "--domain", domain, "record", recording});
  FollowingProgram controller(program("takt-controller", {directory / "move.lua"}));
  std::optional<FollowingProgram> python;
  if (!python_dir.empty())
    python.emplace(std::vector<std::string>{"/usr/bin/python3", directory / "follow.py", cell, domain});

  // Commands of the controller, as another client sees them.
  std::atomic<std::uint64_t> commands{0};
  std::atomic<client::RawTopics*> opener{nullptr};
  client::RawTopics topics(
      options,
      [&](const client::RawTopic& topic) {
        while (opener == nullptr) std::this_thread::yield();
        if (topic.name.ends_with("/commands")) opener.load()->open(topic.name, 10);
      },
      [&](const client::RawTopic&, std::string_view) { ++commands; });
  opener = &topics;
  WriterSpy spy(test_domain());
  const Victim victim(spy, cell);
  const ForeignSender stranger(test_domain());

  std::uint64_t commands_before = 0;
  std::uintmax_t bytes_before = 0;
  const auto bytes = [&] {
    std::error_code error;
    const auto size = fs::file_size(recording, error);
    return error ? std::uintmax_t{0} : size;
  };
  double newest_of_client_s = 0.0;
  std::vector<Served> all{
      {"takt::Client", [&](double s) { return newest_of_client_s > s; }},
      // It writes to the file once a second.
      {"takt record", [&](double) { return !record.ended() && bytes() > bytes_before; }},
      {"takt-controller", [&](double) { return !controller.ended() && commands > commands_before + 20; }}};
  if (python) all.push_back({"Python", [&](double s) { return python->newest_s() > s; }});

  /// Until each has received something newer; -1: not at all.
  const auto time_until_served = [&](double from_s) {
    std::vector<double> times(all.size(), -1.0);
    const auto begin = SteadyClock::now();
    const auto since = [&] { return std::chrono::duration<double>(SteadyClock::now() - begin).count(); };
    while (since() < kPatience_s &&
           std::any_of(times.begin(), times.end(), [](double t) { return t < 0.0; })) {
      try {
        if (!client) client = std::make_unique<Client>(options);
        const auto state = client->wait_for(
            topics::state, [&](const State& s) { return s.time > newest_of_client_s; }, Seconds{0.02});
        if (state && state->time < 1e6) newest_of_client_s = state->time;
      } catch (const ClientError&) {
        client.reset();  // the client of this soak gives up; a user's would have ended
        all.front().name = "takt::Client, lost and made again";
      }
      for (std::size_t i = 0; i < all.size(); ++i)
        if (times[i] < 0.0 && all[i].beyond(from_s)) times[i] = since();
    }
    return times;
  };

  int missed = 0;
  std::printf("%-34s", "time until served again, s");
  for (const Served& one : all) std::printf(" %15s", one.name.c_str());
  std::printf("\n");
  const auto drill = [&](const std::string& name, const std::function<void()>& act) {
    commands_before = commands;
    bytes_before = bytes();
    const double from_s = newest_of_client_s;
    act();
    const auto times = time_until_served(from_s + 0.05);
    std::printf("%-34s", name.c_str());
    for (const double time : times) {
      const bool good = time >= 0.0 && time <= kGoal_s;
      missed += good ? 0 : 1;
      time < 0.0 ? std::printf(" %15s", "NEVER") : std::printf(" %14.2f%s", time, good ? " " : "!");
    }
    std::printf("\n");
    std::fflush(stdout);
  };
  (void)time_until_served(0.0);
  (void)time_until_served(newest_of_client_s + 4.0);  // until the guards know the server's addresses
  drill("nothing", [] {});
  for (const ForgedKind& kind : forged_kinds()) {
    std::optional<State> newest;
    try {
      newest = client->state();
    } catch (const ClientError&) {
      newest.emplace();
    }
    drill(kind.name, [&] { stranger.send(kind.make(victim, *newest)); });
  }
  drill("300 participants for an hour", [&] {
    for (std::uint32_t i = 0; i < 300; ++i) stranger.announce(Forgery(invented_prefix(i)).announcement(3600));
  });
  const auto begin = SteadyClock::now();
  ChildProcess status({bin / "takt", "--cell", cell, "--domain", domain, "status"});
  const int code = status.wait();
  std::printf("takt status behind them: %s, %.2f s\n", code == 0 ? "found" : "NOT FOUND",
              std::chrono::duration<double>(SteadyClock::now() - begin).count());
  missed += code == 0 ? 0 : 1;
  server.signal(SIGKILL);
  std::printf(missed == 0 ? "all served again within %g s\n" : "goal of %g s MISSED %d times\n", kGoal_s,
              missed);
  return missed == 0 ? 0 : 1;
}

}  // namespace
}  // namespace takt::test

int main(int argc, char** argv) {
  CLI::App app(
      "Forged packets against the clients of a cell, on loopback. 0: all were served again within 2 s.");
  std::string python_dir;
  app.add_option("--python", python_dir, "directory of the Python module; without: no client in Python");
  CLI11_PARSE(app, argc, argv);
  return takt::test::run(python_dir);
}

#pragma once
// The subcommands of `takt`. Each returns the exit code of the process. Results go to standard output, as text or with
// --json as JSON; errors are thrown.
#include <cstdint>
#include <cstdio>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "client_lib/client.h"
#include "client_lib/recording/json_text.h"

namespace CLI {
class App;
}

namespace takt::tool {

// Exit codes.
inline constexpr int kOk = 0;
inline constexpr int kFailed = 1;  ///< refused by the server, or not as expected
inline constexpr int kUsage = 2;
inline constexpr int kNoCell = 3;  ///< no such cell answers, or it went away

struct Common {
  ClientOptions client;
  double timeout_s = 10.0;  ///< wall time
  bool json = false;
};

/// No cell of that name answers.
class NoCell : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// A client for one command. Throws NoCell.
class Session {
 public:
  explicit Session(const Common& common);
  Client* operator->() { return client_.get(); }
  Client& operator*() { return *client_; }

 private:
  std::unique_ptr<Client> client_;
};

/// Prints on standard error that the server has gone, for commands that follow a cell without an end.
void say_that_the_cell_has_gone();

/// The sentence of a reply, or all of it as JSON.
int report(const Common& common, const Reply& reply);
/// Prints a document on a line; with an indent, on many.
template <typename Document>
void print_json(const Document& document, int indent = -1) {
  std::printf("%s\n", recording::json_text(document, indent).c_str());
}
/// Prints an error on standard error, with `json` also on standard output. Returns its exit code.
int report_error(bool json, const std::exception& error);

/// Requests by name, and the commands that are one request: requests.cpp.
void declare_requests(CLI::App& app, const Common& common, int& result);
/// Commands about the scenario, its entities and snapshots: scenario_and_entities.cpp.
void declare_scenario_and_entities(CLI::App& app, const Common& common, int& result);
/// Examples at the end of each command's help: examples.cpp.
void add_examples(CLI::App& app);
/// `takt completion SHELL`: completion.cpp.
void declare_completion(CLI::App& app, int& result);
/// A running cell or a recording in the browser: view.cpp.
void declare_view(CLI::App& app, const Common& common, int& result);
/// What is done with recordings (MCAP): recordings.cpp.
void declare_recordings(CLI::App& app, const Common& common, int& result);

struct WatchOptions {
  std::optional<double> until_s;
};

struct RecordOptions {
  std::string file;
  std::optional<double> duration_s;
  std::optional<double> until_s;
  double period_s = 0.01;
  std::string compression = "zstd";    ///< of an MCAP file: zstd, lz4, none
  std::vector<std::string> pressures;  ///< pairs of which to record pressures (request watch_pressures)
};

struct CheckOptions {
  std::string scenario_file;
};

struct EventsOptions {
  std::optional<std::uint64_t> count;
};

struct EchoOptions {
  std::string topic;        ///< its id, one of echo_topics()
  std::string robot;        ///< of a topic that each robot has
  std::uint64_t count = 1;  ///< samples
};
/// The topics that clients read.
std::vector<std::string> echo_topics();

int list(const Common& common);
int echo(const Common& common, const EchoOptions& options);
int status(const Common& common);
int state(const Common& common);
int signals(const Common& common);
int explain(const Common& common, const std::string& part);
int watch(const Common& common, const WatchOptions& options);
int events(const Common& common, const EventsOptions& options);
int record_csv(const Common& common, const RecordOptions& options);
/// takt record with --json: states, contacts, power and events, one document a line.
/// Ends at the simulated time that the options say, or at a signal (SIGINT, SIGTERM). When the server goes
/// away before that time, it throws ClientError (lost); without such a time it goes on with the next server.
/// Each line has a `kind`. The last line, `end`, counts the written and the missed samples.
int record_json(const Common& common, const RecordOptions& options);
/// takt record FILE.mcap: every topic of the cell, as it is sent. `period_s`: of states, contacts, power and
/// joint states in simulated time; without: each sample.
int record_mcap(const Common& common, const RecordOptions& options, std::optional<double> period_s);

struct ReplayOptions {
  std::string file;
  double rate = 1.0;      ///< times as fast as recorded
  bool commands = false;  ///< commands too
};
int replay(const Common& common, const ReplayOptions& options);

int check(const Common& common, const CheckOptions& options);
/// Of `takt power` and `takt contacts`.
struct FollowOptions {
  bool watch = false;
  std::optional<double> until_s;
};

int power(const Common& common, const FollowOptions& options);
int contacts(const Common& common, const FollowOptions& options);
int step(const Common& common, std::uint64_t steps);
int pace(const Common& common, Pace pace, double factor);

}  // namespace takt::tool

#pragma once
// The subcommands of `takt`. Each returns the exit code of the process: 0 ok, 1 failed. What a person reads
// goes to standard output, errors are thrown.
#include <cstdint>
#include <optional>
#include <string>

#include "client_lib/client.h"

namespace takt::tool {

struct Common {
  client::ClientOptions client;
  double timeout_s = 10.0;  ///< wall time
  bool json = false;
};

struct WatchOptions {
  std::optional<double> until_s;
};

struct RecordOptions {
  std::string file;
  std::optional<double> duration_s;
  std::optional<double> until_s;
  double period_s = 0.01;
};

struct CheckOptions {
  std::string scenario_file;
};

struct EventsOptions {
  std::optional<std::uint64_t> count;
};

int list(const Common& common);
int status(const Common& common);
int state(const Common& common);
int explain(const Common& common, const std::string& part);
int watch(const Common& common, const WatchOptions& options);
int events(const Common& common, const EventsOptions& options);
int record(const Common& common, const RecordOptions& options);
int check(const Common& common, const CheckOptions& options);
struct PowerOptions {
  bool watch = false;
  std::optional<double> until_s;
};
struct ContactsOptions {
  bool watch = false;
  std::optional<double> until_s;
};
struct LodOptions {
  int level = 1;
  std::string process = "all";
};

int power(const Common& common, const PowerOptions& options);
int contacts(const Common& common, const ContactsOptions& options);
int level_of_detail(const Common& common, const LodOptions& options);
int step(const Common& common, std::uint64_t steps);
int set_state(const Common& common, client::SimulationState state);
int reset(const Common& common);
int pace(const Common& common, client::Pace pace, double factor);

}  // namespace takt::tool

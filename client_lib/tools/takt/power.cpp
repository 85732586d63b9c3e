// takt power: what the robots draw.
#include <algorithm>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "client_lib/tools/takt/commands.h"

namespace takt::tool {
namespace {

/// Following prints at most one block per so much simulated time.
constexpr double kInterval_s = 0.1;

nlohmann::json json_of(const client::Power& power) {
  nlohmann::json document{{"time", power.time_s}, {"step", power.step}, {"epoch", power.epoch}};
  document["consumers"] = nlohmann::json::object();
  for (const auto& c : power.consumers)
    document["consumers"][c.name] = {{"mechanical_power", c.mechanical_W},
                                     {"mechanical_total", c.mechanical_total_W},
                                     {"electrical_power", c.electrical_W},
                                     {"mechanical_energy", c.mechanical_energy_J},
                                     {"electrical_energy", c.electrical_energy_J}};
  return document;
}

void print(const Common& common, const client::Power& power) {
  if (common.json) {
    std::printf("%s\n", json_of(power).dump().c_str());
  } else {
    for (const auto& c : power.consumers)
      std::printf("%9.3f s  %-16s mechanical %9.2f W %10.2f J   electrical %9.2f W %10.2f J\n", power.time_s,
                  c.name.c_str(), c.mechanical_total_W, c.mechanical_energy_J, c.electrical_W,
                  c.electrical_energy_J);
  }
  std::fflush(stdout);
}

}  // namespace

int power(const Common& common, const PowerOptions& options) {
  Session session(common);
  Client& cell = *session;
  const bool follow = options.watch || options.until_s.has_value();
  const auto processes = cell.status().processes;
  if (std::all_of(processes.begin(), processes.end(), [](const auto& p) { return p.level_of_detail < 2; }))
    throw std::runtime_error(
        "No robot has a power: every process is at level of detail 1. 'takt lod 2' changes that.");
  // At the end of a motion the state stands and is repeated; only what is new is printed.
  double due_s = -1.0;
  std::uint32_t epoch = 0;
  for (bool first = true;;) {
    const auto sample = cell.wait_for_power(
        [&](const client::Power& p) {
          return first || p.epoch != epoch || p.time_s >= due_s - 1e-9 ||
                 (options.until_s && p.time_s >= *options.until_s - 1e-9);
        },
        client::Seconds{first ? common.timeout_s : 1.0e9});
    if (!sample) throw std::runtime_error("The cell has sent no power within the time allowed.");
    print(common, *sample);
    if (!follow || (options.until_s && sample->time_s >= *options.until_s - 1e-9)) return 0;
    first = false;
    epoch = sample->epoch;
    due_s = sample->time_s + kInterval_s;
  }
}

}  // namespace takt::tool

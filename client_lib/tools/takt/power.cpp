// takt power: what robots and devices draw.
#include <algorithm>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "client_lib/recording/json_text.h"
#include "client_lib/tools/takt/commands.h"
#include "client_lib/tools/takt/follow.h"

namespace takt::tool {
namespace {

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
    std::printf("%s\n", recording::json_text(json_of(power)).c_str());
  } else {
    for (const auto& c : power.consumers) {
      std::printf("%9.3f s  %-16s ", power.time_s, c.name.c_str());
      if (c.mechanical_W.empty())
        std::printf("%37s", "");  // devices have none
      else
        std::printf("mechanical %9.2f W %10.2f J   ", c.mechanical_total_W, c.mechanical_energy_J);
      std::printf("electrical %9.2f W %10.2f J\n", c.electrical_W, c.electrical_energy_J);
    }
  }
  std::fflush(stdout);
}

bool has_meter(const client::DeviceInfo& device) {
  const auto has = [&](const char* name) {
    return std::any_of(device.signals.begin(), device.signals.end(),
                       [&](const auto& signal) { return signal.name == name; });
  };
  return has("power") && has("energy");
}

}  // namespace

int power(const Common& common, const FollowOptions& options) {
  Session session(common);
  Client& cell = *session;
  const auto processes = cell.status().processes;
  const auto shown = cell.cell();
  if (std::all_of(processes.begin(), processes.end(), [](const auto& p) { return p.level_of_detail < 2; }) &&
      std::none_of(shown->devices.begin(), shown->devices.end(), has_meter))
    throw std::runtime_error(
        "Nothing has a power: no device draws any, and of robots there is none while every process is at "
        "level "
        "of detail 1. 'takt lod 2' changes that.");
  return follow<client::Power>(
      common, options, "power",
      [&](const auto& predicate, client::Seconds timeout) { return cell.wait_for_power(predicate, timeout); },
      [&](const client::Power& sample) { print(common, sample); });
}

}  // namespace takt::tool

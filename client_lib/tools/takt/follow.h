#pragma once
// The common part of `takt power` and `takt contacts`: one sample, or a sequence of samples.
#include <cstdint>
#include <stdexcept>
#include <string>

#include "client_lib/tools/takt/commands.h"

namespace takt::tool {

/// Prints the next sample. With `watch` or an end it prints the following ones too, at most one per 0.1 s of simulated
/// time. Repeated instants of a paused cell are left out. `print(sample)` writes it. Throws if no sample comes.
template <Message Type, typename Print>
int follow(const Common& common, const FollowOptions& options, const Client& cell, const Topic<Type>& topic,
           Print print) {
  constexpr double kInterval_s = 0.1, kTolerance_s = 1e-9;
  const auto ends = [&](const auto& s) {
    return options.until_s && s.time >= *options.until_s - kTolerance_s;
  };
  double due_s = -1.0;
  std::uint32_t epoch = 0;
  for (bool first = true;; first = false) {
    const auto sample = cell.wait_for(
        topic,
        [&](const auto& s) { return first || s.epoch != epoch || s.time >= due_s - kTolerance_s || ends(s); },
        Seconds{first ? common.timeout_s : 1.0e9});
    if (!sample)
      throw std::runtime_error("The cell has sent no " + std::string(topic.id) + " within the time allowed.");
    print(*sample);
    if (!(options.watch || options.until_s) || ends(*sample)) return kOk;
    epoch = sample->epoch;
    due_s = sample->time + kInterval_s;
  }
}

}  // namespace takt::tool

#pragma once
// The common part of `takt power` and `takt contacts`: one sample, or a sequence of samples.
#include <cstdint>
#include <optional>
#include <stdexcept>
#include <string>

#include "client_lib/tools/takt/commands.h"

namespace takt::tool {

/// Prints the next sample. With `watch` or an end it prints the following ones too, at most one per 0.1 s of simulated
/// time. Repeated instants of a paused cell are left out. `wait(predicate, timeout)` waits for a sample,
/// `print(sample)` writes it. Throws if no sample comes; `what` names the sample in the sentence.
template <typename Sample, typename Wait, typename Print>
int follow(const Common& common, const FollowOptions& options, const std::string& what, Wait wait,
           Print print) {
  constexpr double kInterval_s = 0.1, kTolerance_s = 1e-9;
  const auto ends = [&](const Sample& s) {
    return options.until_s && s.time >= *options.until_s - kTolerance_s;
  };
  double due_s = -1.0;
  std::uint32_t epoch = 0;
  for (bool first = true;; first = false) {
    const std::optional<Sample> sample = wait(
        [&](const Sample& s) {
          return first || s.epoch != epoch || s.time >= due_s - kTolerance_s || ends(s);
        },
        Seconds{first ? common.timeout_s : 1.0e9});
    if (!sample) throw std::runtime_error("The cell has sent no " + what + " within the time allowed.");
    print(*sample);
    if (!(options.watch || options.until_s) || ends(*sample)) return kOk;
    epoch = sample->epoch;
    due_s = sample->time + kInterval_s;
  }
}

}  // namespace takt::tool

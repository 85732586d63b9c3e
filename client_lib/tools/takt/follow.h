#pragma once
// What `takt power` and `takt contacts` share: one sample, or one after the other.
#include <cstdint>
#include <optional>
#include <stdexcept>
#include <string>

#include "client_lib/tools/takt/commands.h"

namespace takt::tool {

/// Prints the next sample; with `watch` or an end the following ones too, at most one per 0.1 s of simulated
/// time, and only new ones: at the end of a motion the state stands and is repeated. `wait(predicate,
/// timeout)` waits for a sample, `print(sample)` writes it. Throws when none comes; `what` names it in the
/// sentence.
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

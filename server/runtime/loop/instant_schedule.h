#pragma once
// Which instants a simulation in lockstep publishes beside those that controllers wait for: for observers some of each
// second of wall time and of simulated time, and for recorders those of a period of simulated time (request watch_instants).
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "takt_requests.h"

namespace takt {

/// For the loop's thread.
class InstantSchedule {
 public:
  static constexpr std::int64_t kObservers_ns = 10'000'000;  ///< longest wall time between two instants
  static constexpr double kObservers_s = 0.1;                ///< and longest simulated time
  static constexpr std::size_t kMostWatches = 64;

  InstantSchedule() { watches_.reserve(kMostWatches); }

  /// Beyond kMostWatches the watch that ends first is replaced.
  void watch(const requests::WatchInstants& request, double time_s, std::int64_t now_ns) {
    drop_ended(now_ns);
    if (watches_.size() == kMostWatches) watches_.erase(first_to_end());
    Watch watch{request.period, request.origin, 0.0,
                now_ns + static_cast<std::int64_t>(request.duration * 1e9)};
    watch.due_s = after(watch, time_s);
    watches_.push_back(watch);
  }
  /// Whether the instant is due. Call it for each instant.
  bool due(double time_s, std::int64_t now_ns) {
    bool due =
        now_ns - published_ns_ >= kObservers_ns || time_s >= published_s_ + kObservers_s - kTolerance_s;
    bool ended = false;
    for (Watch& watch : watches_) {
      ended = ended || watch.until_ns <= now_ns;
      if (time_s < watch.due_s - kTolerance_s) continue;
      due = true;
      watch.due_s = after(watch, time_s);
    }
    if (ended) drop_ended(now_ns);
    return due;
  }
  void published(double time_s, std::int64_t now_ns) {
    published_s_ = time_s;
    published_ns_ = now_ns;
  }
  /// The simulation is at another instant.
  void restart(double time_s) {
    published_s_ = time_s;
    for (Watch& watch : watches_) watch.due_s = after(watch, time_s);
  }

 private:
  static constexpr double kTolerance_s = 1e-9;  // far below any step and far above the rounding of times
  struct Watch {
    double period_s, origin_s, due_s;
    std::int64_t until_ns;
  };
  static double after(const Watch& watch, double time_s) {
    if (watch.period_s <= 0.0) return time_s;
    return watch.origin_s +
           (std::floor((time_s - watch.origin_s + kTolerance_s) / watch.period_s) + 1.0) * watch.period_s;
  }
  void drop_ended(std::int64_t now_ns) {
    std::erase_if(watches_, [&](const Watch& watch) { return watch.until_ns <= now_ns; });
  }
  std::vector<Watch>::iterator first_to_end() {
    return std::min_element(watches_.begin(), watches_.end(),
                            [](const Watch& a, const Watch& b) { return a.until_ns < b.until_ns; });
  }

  std::vector<Watch> watches_;
  std::int64_t published_ns_ = 0;
  double published_s_ = 0.0;
};

}  // namespace takt

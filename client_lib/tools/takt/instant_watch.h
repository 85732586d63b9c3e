#pragma once
// In lockstep a recording needs instants at which no controller answers: they are asked for as long as it lasts.
#include <algorithm>
#include <chrono>

#include "client_lib/client.h"

namespace takt::tool {

class InstantWatch {
 public:
  /// An instant in each period of simulated time, from `origin` on; period 0: every step. `cell` must outlive it.
  InstantWatch(Client& cell, Seconds period, Seconds origin = Seconds{0.0})
      : cell_(cell),
        request_{std::min(period.count(), kLongestPeriod_s), origin.count(), 3.0 * kRenewal.count()} {
    renew();
  }
  /// Call it every few seconds. Throws ClientError.
  void renew() {
    const auto now = std::chrono::steady_clock::now();
    if (now < due_) return;
    due_ = now + std::chrono::duration_cast<std::chrono::steady_clock::duration>(kRenewal);
    cell_.call(request_);
  }
  static constexpr Seconds kRenewal{5.0};

 private:
  static constexpr double kLongestPeriod_s = 3600.0;  // of the request
  Client& cell_;
  const requests::WatchInstants request_;
  std::chrono::steady_clock::time_point due_;
};

}  // namespace takt::tool

#pragma once
// In lockstep a recording needs instants at which no controller answers: they are asked for as long as it lasts.
#include <algorithm>
#include <chrono>

#include "client_lib/client.h"

namespace takt::tool {

class InstantWatch {
 public:
  /// Wall time between two requests. A watch lasts three times as long, so that a dead recorder leaves none behind.
  static constexpr Seconds kRenewal{5.0};

  /// An instant in each period of simulated time, from `origin` on; period 0: every step.
  InstantWatch(Seconds period, Seconds origin, Seconds renewal = kRenewal)
      : request_{std::min(period.count(), kLongestPeriod_s), origin.count(), 3.0 * renewal.count()},
        renewal_(renewal) {}

  bool due() const { return !unanswered_ && std::chrono::steady_clock::now() >= due_; }
  /// Asks after this wall time again.
  void postpone(Seconds wait) {
    due_ = std::chrono::steady_clock::now() +
           std::chrono::duration_cast<std::chrono::steady_clock::duration>(wait);
  }
  /// Another scenario or another server is to be asked.
  void restart() { due_ = {}, unanswered_ = false; }
  /// Asks if it is time to. Throws ClientError when the server is lost.
  void renew(Client& cell) {
    if (!due()) return;
    postpone(renewal_);
    try {
      cell.call(request_, kPatience);
    } catch (const ClientError& error) {
      // Without a scenario the server refuses; the next one is asked again. takt replay does not answer at all.
      if (error.kind() == ClientError::Kind::lost) throw;
      if (error.kind() == ClientError::Kind::timeout) unanswered_ = true;
    }
  }

 private:
  static constexpr double kLongestPeriod_s = 3600.0;  // of the request
  static constexpr Seconds kPatience{2.0};
  requests::WatchInstants request_;
  Seconds renewal_;
  bool unanswered_ = false;
  std::chrono::steady_clock::time_point due_;
};

}  // namespace takt::tool

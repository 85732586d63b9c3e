#include "server/runtime/loop/adaptive_dispatch.h"

#include <algorithm>

namespace takt {

int AdaptiveDispatch::choose() {
  const auto best = static_cast<std::size_t>(best_);
  const std::size_t other = 1 - best;
  if (way_ == best_ && stages_ >= wait_) {
    way_ = static_cast<int>(other);
    stages_ = 0;
    noted_[other] = 0;
  } else if (way_ != best_ && stages_ >= kTrial) {
    const bool better = cost_[other] < 0.98 * cost_[best];
    wait_ = better ? kFirstWait : std::clamp(2 * wait_, kFirstWait, kLongestWait);
    if (better) best_ = way_;
    way_ = best_;
    stages_ = 0;
  }
  ++stages_;
  return way_;
}

void AdaptiveDispatch::note(double time_per_work) {
  if (stages_ <= kWarm) return;
  const auto way = static_cast<std::size_t>(way_);
  // A mean, not a median: the occasional cost of a preempted helper counts.
  noted_[way] = std::min(noted_[way] + 1, 64);
  cost_[way] += (time_per_work - cost_[way]) / noted_[way];
}

}  // namespace takt

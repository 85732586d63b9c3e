#include "server/runtime/pacer.h"

#include <algorithm>
#include <cmath>

namespace takt {

void Pacer::anchor(double step_s, double factor) {
  period_ns_ = step_s / factor * 1e9;
  anchor_ns_ = clock_.now_ns();
  steps_since_anchor_ = 0;
  overrun_run_ = 0;
  figures_.lag_ns = 0;
}

std::int64_t Pacer::due_ns() const {
  return anchor_ns_ +
         static_cast<std::int64_t>(std::llround(static_cast<double>(steps_since_anchor_) * period_ns_));
}

std::int64_t Pacer::behind_ns() const {
  return std::max<std::int64_t>(clock_.now_ns() - due_ns(), 0);
}

Pacer::Result Pacer::wait(std::int64_t longest_sleep_ns) {
  const std::int64_t due = due_ns();
  std::int64_t now = clock_.now_ns();
  if (now < due) {
    const std::int64_t until = std::min(due, now + longest_sleep_ns);
    clock_.sleep_until_ns(until);
    if (until < due) return Result::not_due;
    now = clock_.now_ns();
    wakeup_latency_.record_ns(now - due);
  }
  ++steps_since_anchor_;
  figures_.lag_ns = std::max<std::int64_t>(now - due, 0);
  if (static_cast<double>(figures_.lag_ns) < period_ns_) {
    overrun_run_ = 0;
    return Result::due;
  }
  ++figures_.overruns;
  ++overrun_run_;
  figures_.max_consecutive_overruns = std::max(figures_.max_consecutive_overruns, overrun_run_);
  if (figures_.lag_ns <= kCatchUpLimit_ns) return Result::due;
  anchor_ns_ = now;
  steps_since_anchor_ = 1;
  ++figures_.schedule_resets;
  return Result::schedule_reset;
}

void Pacer::clear_figures() {
  figures_ = Figures{};
  overrun_run_ = 0;
  wakeup_latency_.clear();
}

}  // namespace takt

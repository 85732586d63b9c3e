#pragma once
// Holds the step loop to the wall clock: step n after the anchor is due at anchor + n * step / factor, an
// absolute schedule, so that errors of single wake-ups do not add up.
//
// A late step is followed by steps without waiting, as long as the lag stays within 50 ms. Beyond that the
// schedule is moved once so that the present step is due at once ("re-based"); this is counted and reported
// to the caller. No step is ever skipped and the step size never changes.
#include <cstdint>
#include <string_view>

#include "idl/common/histogram.h"
#include "server/runtime/monotonic_clock.h"
#include "takt_enumerations.h"

namespace takt {

class Pacer {
 public:
  static constexpr std::int64_t kCatchUpLimit_ns = 50'000'000;

  struct Figures {
    std::int64_t lag_ns = 0;     ///< of the newest step at its start; after a re-base: ahead of it
    std::uint64_t overruns = 0;  ///< steps that began a whole period or more behind schedule
    std::uint64_t max_consecutive_overruns = 0;  ///< most of them in a row
    std::uint64_t schedule_resets = 0;
  };

  explicit Pacer(MonotonicClock& clock) : clock_(clock) {}

  /// The next step is due at once; further ones every step_s / factor of wall time.
  void anchor(double step_s, double factor);

  enum class Result {
    not_due,         ///< slept for the allowed time, the step is not due: call again
    due,             ///< take the step
    schedule_reset,  ///< take the step; the lag exceeded the limit and the schedule was moved by lag_ns
  };
  /// Waits for the next step's time, at most `longest_sleep_ns`.
  Result wait(std::int64_t longest_sleep_ns);

  /// Time since the next step was due, the lag of simulated time behind the clock; 0: it is not due yet.
  std::int64_t behind_ns() const;

  const Figures& figures() const { return figures_; }
  const DurationHistogram& wakeup_latency() const { return wakeup_latency_; }
  void clear_figures();

 private:
  std::int64_t due_ns() const;

  MonotonicClock& clock_;
  double period_ns_ = 1e6;
  std::int64_t anchor_ns_ = 0;
  std::uint64_t steps_since_anchor_ = 0;
  std::uint64_t overrun_run_ = 0;
  Figures figures_;
  DurationHistogram wakeup_latency_;
};

}  // namespace takt

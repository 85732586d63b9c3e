#pragma once
// The status figures of a step loop: counted during the run, published ten times a second of wall time and
// with every change.
#include <array>
#include <cstdint>

#include "idl/common/fixed_string.h"
#include "idl/common/histogram.h"
#include "server/runtime/loop/command_intake.h"
#include "server/runtime/loop/lockstep_barrier.h"
#include "server/runtime/loop/loop_context.h"
#include "server/runtime/pacer.h"

namespace takt {

class StatusPublisher {
 public:
  /// All outlive it.
  StatusPublisher(LoopContext& loop, const Pacer& pacer, const LockstepBarrier& barrier,
                  const CommandIntake& intake)
      : loop_(loop), pacer_(pacer), barrier_(barrier), intake_(intake) {}

  void publish();
  void publish_if_due();
  /// When the next one is due (monotonic clock).
  std::int64_t due_ns() const { return due_ns_; }

  void set_scheduling(std::string_view text) { scheduling_.assign(text); }
  void set_contact_pairs(std::size_t count) { contact_pairs_ = static_cast<std::uint32_t>(count); }
  /// Counts a step with this computing time.
  void stepped(std::int64_t computed_ns) {
    step_time_.record_ns(computed_ns);
    computed_ns_ += computed_ns;
  }
  /// After a jump of the simulation to another instant: rates and step times start at zero.
  void restart();

 private:
  struct RateSample {
    std::int64_t wall_ns = 0;
    double time_s = 0.0;
    std::int64_t computed_ns = 0;
  };

  LoopContext& loop_;
  const Pacer& pacer_;
  const LockstepBarrier& barrier_;
  const CommandIntake& intake_;
  FixedString<256> scheduling_;
  std::int64_t due_ns_ = 0;
  std::int64_t computed_ns_ = 0;     ///< sum of the steps' computation times
  std::uint32_t contact_pairs_ = 0;  ///< in the newest instant published
  std::uint64_t lost_reported_ = 0;  ///< events
  DurationHistogram step_time_;
  std::array<RateSample, 11> rate_;
  std::size_t rate_count_ = 0;
};

}  // namespace takt

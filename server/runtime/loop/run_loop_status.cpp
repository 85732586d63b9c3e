// The figures of the step loop, ten times a second.
#include <algorithm>

#include "server/runtime/loop/run_loop.h"

namespace takt {
namespace {

constexpr std::int64_t kStatusInterval_ns = 100'000'000;

Quantiles quantiles(const DurationHistogram& histogram) {
  return {histogram.quantile_s(0.5), histogram.quantile_s(0.99), histogram.max_s()};
}

}  // namespace

void RunLoop::publish_status_if_due() {
  const std::int64_t now = monotonic_now_ns();
  if (now >= next_status_ns_) publish_status(now);
}

void RunLoop::publish_status(std::int64_t now_ns) {
  if (now_ns >= next_status_ns_) {
    next_status_ns_ = now_ns + kStatusInterval_ns;
    std::rotate(rate_.begin(), rate_.begin() + 1, rate_.end());
    rate_.back() = {now_ns, simulation_.time_s(), computed_ns_};
    rate_count_ = std::min(rate_count_ + 1, rate_.size());
  }
  if (output_.events.lost() > events_lost_told_) {
    EventRecord lost = event(EventCode::events_lost, Severity::warning);
    lost.a = static_cast<int>(output_.events.lost() - events_lost_told_);
    events_lost_told_ = output_.events.lost();
    emit(lost);
  }
  LoopStatus& status = output_.status.write_buffer();
  status.time_s = simulation_.time_s();
  status.step = simulation_.step_index();
  status.epoch = simulation_.epoch();
  status.state = state_;
  status.pace = pace_;
  status.pace_factor = factor_;
  status.wall_time_s = static_cast<double>(now_ns - output_.outbound->began_ns) * 1e-9;
  const RateSample& oldest = rate_[rate_.size() - std::max<std::size_t>(rate_count_, 1)];
  const double wall = static_cast<double>(now_ns - oldest.wall_ns) * 1e-9;
  const double simulated = simulation_.time_s() - oldest.time_s;
  const double computed = static_cast<double>(computed_ns_ - oldest.computed_ns) * 1e-9;
  status.real_time_factor = wall > 0.0 ? std::max(simulated, 0.0) / wall : 0.0;
  status.computation_ratio = simulated > 0.0 ? computed / simulated : 0.0;
  const bool on_schedule = pace_ == Pace::realtime && state_ == SimulationState::playing;
  status.lag_s = on_schedule ? static_cast<double>(pacer_.behind_ns()) * 1e-9 : 0.0;
  status.overruns = pacer_.figures().overruns;
  status.max_consecutive_overruns = pacer_.figures().max_consecutive_overruns;
  status.schedule_resets = pacer_.figures().schedule_resets;
  status.step_time = quantiles(step_time_);
  status.wakeup_latency = quantiles(pacer_.wakeup_latency());
  status.command_latency = quantiles(command_latency_);
  status.commands_applied = commands_applied_;
  status.commands_rejected = commands_rejected_;
  status.mpr_calls = simulation_.statistics().mpr_calls;
  status.mpr_skipped = simulation_.statistics().mpr_skipped;
  status.solver.assign(simulation_.solver().name);
  status.solver_steps = simulation_.statistics().solver.steps;
  status.solver_rejected_steps = simulation_.statistics().solver.rejected_steps;
  status.contact_pairs = contact_pairs_;
  status.contact_calls = simulation_.contact_counts();
  status.process_count =
      static_cast<std::uint32_t>(std::min(cell().processes.size(), status.process_levels.size()));
  for (std::size_t p = 0; p < status.process_count; ++p)
    status.process_levels[p] = simulation_.process_level(p);
  status.waiting_for = waiting_for_;
  status.waiting_count = waiting_count_;
  status.scheduling = scheduling_;
  status.fault.assign(faulted_ ? std::string_view(simulation_.fault()) : std::string_view());
  output_.status.publish();
  output_.news.post();
}

}  // namespace takt

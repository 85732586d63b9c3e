#include "server/runtime/loop/status_publisher.h"

#include <algorithm>

namespace takt {
namespace {

constexpr std::int64_t kInterval_ns = 100'000'000;

Quantiles quantiles(const DurationHistogram& histogram) {
  return {histogram.quantile_s(0.5), histogram.quantile_s(0.99), histogram.max_s()};
}

}  // namespace

void fill(LoopStatus& status, const Simulation& simulation) {
  status.time_s = simulation.time_s();
  status.step = simulation.step_index();
  status.epoch = simulation.epoch();
  const SimulationStatistics& statistics = simulation.statistics();
  status.mpr_calls = statistics.mpr_calls;
  status.mpr_skipped = statistics.mpr_skipped;
  status.solver.assign(simulation.solver().name);
  status.solver_steps = statistics.solver.steps;
  status.solver_rejected_steps = statistics.solver.rejected_steps;
  status.contact_calls = simulation.contact_counts();
  status.process_count = static_cast<std::uint32_t>(
      std::min(simulation.description().processes.size(), status.process_levels.size()));
  for (std::size_t p = 0; p < status.process_count; ++p)
    status.process_levels[p] = simulation.process_level(p);
}

void StatusPublisher::restart() {
  step_time_.clear();
  rate_count_ = 0;
}

void StatusPublisher::publish_if_due() {
  if (monotonic_now_ns() >= due_ns_) publish();
}

void StatusPublisher::publish() {
  const std::int64_t now_ns = monotonic_now_ns();
  const Simulation& simulation = loop_.simulation;
  LoopOutput& output = loop_.output;
  if (now_ns >= due_ns_) {
    due_ns_ = now_ns + kInterval_ns;
    std::rotate(rate_.begin(), rate_.begin() + 1, rate_.end());
    rate_.back() = {now_ns, simulation.time_s(), computed_ns_};
    rate_count_ = std::min(rate_count_ + 1, rate_.size());
  }
  if (output.events.lost() > lost_reported_) {
    loop_.emit(events::EventsLost{output.events.lost() - lost_reported_});
    lost_reported_ = output.events.lost();
  }
  LoopStatus& status = output.status.write_buffer();
  fill(status, simulation);
  status.state = loop_.state;
  status.pace = loop_.pace;
  status.pace_factor = loop_.factor;
  status.wall_time_s = static_cast<double>(now_ns - output.outbound->began_ns) * 1e-9;
  const RateSample& oldest = rate_[rate_.size() - std::max<std::size_t>(rate_count_, 1)];
  const double wall = static_cast<double>(now_ns - oldest.wall_ns) * 1e-9;
  const double simulated = simulation.time_s() - oldest.time_s;
  const double computed = static_cast<double>(computed_ns_ - oldest.computed_ns) * 1e-9;
  status.real_time_factor = wall > 0.0 ? std::max(simulated, 0.0) / wall : 0.0;
  status.computation_ratio = simulated > 0.0 ? computed / simulated : 0.0;
  const bool on_schedule = loop_.pace == Pace::realtime && loop_.plays();
  status.lag_s = on_schedule ? static_cast<double>(pacer_.behind_ns()) * 1e-9 : 0.0;
  status.overruns = pacer_.figures().overruns;
  status.max_consecutive_overruns = pacer_.figures().max_consecutive_overruns;
  status.schedule_resets = pacer_.figures().schedule_resets;
  status.step_time = quantiles(step_time_);
  status.wakeup_latency = quantiles(pacer_.wakeup_latency());
  status.command_latency = quantiles(intake_.latency());
  status.commands_applied = intake_.applied();
  status.commands_rejected = barrier_.refused();
  status.contact_pairs = contact_pairs_;
  const auto waiting = barrier_.waiting_for();
  std::copy(waiting.begin(), waiting.end(), status.waiting_for.begin());
  status.waiting_count = static_cast<std::uint32_t>(waiting.size());
  status.scheduling = scheduling_;
  status.fault.assign(loop_.faulted ? std::string_view(simulation.fault()) : std::string_view());
  output.status.publish();
  output.news.post();
}

}  // namespace takt

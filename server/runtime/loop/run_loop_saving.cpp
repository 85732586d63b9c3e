// States of the simulation saved between two steps, and one restored.
#include "server/runtime/loop/run_loop.h"
#include "server/runtime/monotonic_clock.h"
#include "server/runtime/recording/log_recorder.h"

namespace takt {

std::string RunLoop::save(SavedState& saved) {
  const std::string refusal = simulation_.save_state(saved.bytes);
  if (recorder_ != nullptr) recorder_->saved(simulation_);  // a refused one restarts solvers too
  if (!refusal.empty()) return refusal;
  // The hash of the model is computed once only.
  if (identity_.model == 0) identity_ = identity_of(simulation_);
  identity_.step = simulation_.step_index();
  identity_.time_s = simulation_.time_s();
  saved.identity = identity_;
  saved.state = state_;
  saved.pace = pace_;
  saved.factor = factor_;
  return {};
}

SavedState RunLoop::first_saved(Simulation& simulation, const RunLoopOptions& options) {
  SavedState saved;
  if (!(options.save_every_s > 0.0)) return saved;
  static_cast<void>(simulation.save_state(saved.bytes));  // for the size; saved again when it is due
  saved.identity = identity_of(simulation);
  return saved;
}

void RunLoop::save_if_due() {
  if (!(options_.save_every_s > 0.0) || !changed_since_save_ || faulted_) return;
  const std::int64_t now = monotonic_now_ns();
  if (now < next_save_ns_) return;
  next_save_ns_ = now + static_cast<std::int64_t>(options_.save_every_s * 1e9);
  changed_since_save_ = false;
  const std::string refusal = save(saved_.write_buffer());
  if (!refusal.empty() && !save_refused_) {  // told when it begins
    EventRecord refused = event(EventCode::save_refused, Severity::error);
    refused.text.assign(refusal);
    emit(refused);
  }
  save_refused_ = !refusal.empty();
  if (save_refused_) return;
  saved_.publish();
  saved_news_.post();
}

std::string RunLoop::restore(std::span<const std::byte> state) {
  const std::uint64_t step = simulation_.step_index();
  if (recorder_ != nullptr) recorder_->checkpoint(simulation_);
  const std::string refusal = simulation_.restore_state(state);
  if (!refusal.empty()) return refusal;
  if (recorder_ != nullptr) recorder_->restored(step, state);
  end_single_steps(ControlResult::failed, "The remaining steps were not taken: a snapshot was restored.");
  reset_loop_state(simulation_.step_index());
  ended_ = options_.pause_at_s && simulation_.time_s() >= *options_.pause_at_s - 0.5 * cell().step_s;
  if (state_ == SimulationState::stopped) set_state(SimulationState::paused);
  publish_instant();
  publish_status(monotonic_now_ns());
  return {};
}

}  // namespace takt

#include "server/runtime/loop/periodic_saver.h"

#include "server/runtime/monotonic_clock.h"

namespace takt {
namespace {

// Of the right size, so that saving allocates only for a state larger than all earlier ones.
SavedState first_saved(Simulation& simulation, bool wanted) {
  SavedState saved;
  if (!wanted) return saved;
  static_cast<void>(simulation.save_state(saved.bytes));  // for the size; saved again when it is due
  saved.identity = identity_of(simulation);
  return saved;
}

}  // namespace

PeriodicSaver::PeriodicSaver(LoopContext& loop, double every_s)
    : loop_(loop), every_s_(every_s), saved_(first_saved(loop.simulation, every_s > 0.0)) {}

std::string PeriodicSaver::save(SavedState& saved) {
  const std::string refusal = loop_.simulation.save_state(saved.bytes);
  loop_.record(LogSaved{});  // a refused one restarts solvers too
  if (!refusal.empty()) return refusal;
  // The hash of the model is computed once only.
  if (identity_.model == 0) identity_ = identity_of(loop_.simulation);
  identity_.step = loop_.simulation.step_index();
  identity_.time_s = loop_.simulation.time_s();
  saved.identity = identity_;
  saved.state = loop_.state;
  saved.pace = loop_.pace;
  saved.factor = loop_.factor;
  return {};
}

void PeriodicSaver::save_if_due() {
  if (!(every_s_ > 0.0) || !changed_ || loop_.faulted) return;
  const std::int64_t now = monotonic_now_ns();
  if (now < due_ns_) return;
  due_ns_ = now + static_cast<std::int64_t>(every_s_ * 1e9);
  changed_ = false;
  const std::string refusal = save(saved_.write_buffer());
  if (!refusal.empty() && !refused_)  // reported when it begins
    loop_.emit(events::PeriodicSnapshotRefused{FixedString<640>(refusal)});
  refused_ = !refusal.empty();
  if (refused_) return;
  saved_.publish();
  news_.post();
}

}  // namespace takt

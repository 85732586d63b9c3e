#include "server/runtime/loop/command_intake.h"

#include <utility>

namespace takt {

CommandIntake::CommandIntake(LoopContext& loop, LockstepBarrier& barrier)
    : loop_(loop),
      barrier_(barrier),
      buffer_(loop.cell()),
      waiting_(static_cast<std::size_t>(target_count(loop.cell()))) {
  incoming_.reserve(buffer_.capacity());
  batch_.reserve(waiting_.size());
}

void CommandIntake::collect() {
  const bool lockstep = loop_.pace == Pace::lockstep;
  // An appending thread wakes the loop afterwards. If steps are counted and not timed, a step must contain
  // every earlier command.
  buffer_.take_all(incoming_, lockstep || !loop_.plays());
  for (ReceivedCommand& received : incoming_) {
    if (lockstep && !barrier_.admits(received)) continue;
    waiting_[static_cast<std::size_t>(received.target)] = received;
  }
}

std::span<const Command> CommandIntake::take_batch() {
  batch_.clear();
  const bool lockstep = loop_.pace == Pace::lockstep;
  for (std::optional<ReceivedCommand>& received : waiting_) {
    if (!received) continue;
    const auto* controller = barrier_.controllers().owner(received->target);
    if (lockstep && controller != nullptr && controller->boundary_step != loop_.simulation.step_index())
      continue;
    Command& command = batch_.emplace_back(std::move(received->command));
    if (controller != nullptr) {
      if (auto* joints = std::get_if<JointCommand>(&command)) joints->period_s = controller->period_s;
      if (lockstep)
        std::visit([&](auto& c) { c.stamp = SimTime::from_seconds(loop_.simulation.time_s()); }, command);
    }
    latency_.record_ns(monotonic_now_ns() - received->received_ns);
    received.reset();
  }
  return batch_;
}

void CommandIntake::restart() {
  buffer_.forget();
  set_present(loop_.simulation.time_s());
  drop_all();
  latency_.clear();
}

}  // namespace takt

#include "server/runtime/loop/command_intake.h"

#include <utility>

namespace takt {

CommandIntake::CommandIntake(LoopContext& loop, LockstepBarrier& barrier)
    : loop_(loop),
      barrier_(barrier),
      buffer_(loop.cell()),
      waiting_(static_cast<std::size_t>(target_count(loop.cell()))),
      ahead_(target_count(loop.cell())),
      senders_(waiting_.size(), 0) {
  incoming_.reserve(buffer_.capacity());
  batch_.reserve(waiting_.size());
}

void CommandIntake::collect() {
  const bool lockstep = loop_.pace == Pace::lockstep;
  // An appending thread wakes the loop afterwards. If steps are counted and not timed, a step must contain
  // every earlier command.
  buffer_.take_all(incoming_, lockstep || !loop_.plays());
  for (ReceivedCommand& received : incoming_) {
    const auto target = static_cast<std::size_t>(received.target);
    if (const auto boundary = barrier_.boundary_ahead(received)) {
      senders_[target] = received.sender;
      ahead_.put(*boundary, std::move(received));
      continue;
    }
    if (lockstep && !barrier_.admits(received, senders_[target] == received.sender)) continue;
    senders_[target] = received.sender;
    // Its sender begins again here.
    ahead_.drop(received.target);
    waiting_[target] = std::move(received);
  }
}

bool CommandIntake::has(int target) const {
  if (waiting_[static_cast<std::size_t>(target)]) return true;
  const auto* controller = barrier_.controllers().owner(target);
  return controller != nullptr && controller->boundary_step == loop_.simulation.step_index() &&
         ahead_.has(target, controller->boundary);
}

void CommandIntake::drop(int target) {
  waiting_[static_cast<std::size_t>(target)].reset();
  ahead_.drop(target);
}

std::span<const Command> CommandIntake::take_batch() {
  batch_.clear();
  const bool lockstep = loop_.pace == Pace::lockstep;
  for (int target = 0; target < static_cast<int>(waiting_.size()); ++target) {
    std::optional<ReceivedCommand>& received = waiting_[static_cast<std::size_t>(target)];
    const auto* controller = barrier_.controllers().owner(target);
    const bool at_boundary =
        controller != nullptr && controller->boundary_step == loop_.simulation.step_index();
    if (at_boundary && !received) {
      received = ahead_.take(target, controller->boundary);
      if (received && lockstep && barrier_.refuses_beside_trajectory(*received)) received.reset();
    }
    if (!received || (lockstep && controller != nullptr && !at_boundary)) continue;
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
  drop_present();
  ahead_.drop_all();
  latency_.clear();
}

}  // namespace takt

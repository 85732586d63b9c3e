#include "server/runtime/loop/command_intake.h"

#include <utility>

namespace takt {

CommandIntake::CommandIntake(LoopContext& loop, LockstepBarrier& barrier, GoalMonitor& goals)
    : loop_(loop),
      barrier_(barrier),
      goals_(goals),
      buffer_(loop.cell()),
      waiting_(static_cast<std::size_t>(target_count(loop.cell()))),
      ahead_(target_count(loop.cell())),
      senders_(waiting_.size(), 0),
      newest_(waiting_.size()),
      repeats_(waiting_.size()),
      stops_(waiting_.size()) {
  incoming_.reserve(buffer_.capacity());
  batch_.reserve(waiting_.size());
  batch_goals_.reserve(waiting_.size());
}

void CommandIntake::collect() {
  const bool lockstep = loop_.pace == Pace::lockstep;
  buffer_.set_lockstep(lockstep);
  // An appending thread wakes the loop afterwards. If steps are counted and not timed, a step must contain
  // every earlier command.
  buffer_.take_all(incoming_, lockstep || !loop_.plays());
  for (ReceivedCommand& received : incoming_) {
    if (received.goal && received.goal->kind == MotionGoal::Kind::cancel) {
      cancel(received);
      continue;
    }
    const auto target = static_cast<std::size_t>(received.target);
    if (const auto boundary = barrier_.boundary_ahead(received)) {
      senders_[target] = received.sender;
      newest_[target] = stamp_of(received.command);
      ahead_.put(*boundary, std::move(received));
      continue;
    }
    if (lockstep && !is_admitted(received)) continue;
    if (!received.goal) {
      senders_[target] = received.sender;
      newest_[target] = stamp_of(received.command);
      // Its sender begins again here.
      ahead_.drop(received.target);
    }
    if (auto* signals = std::get_if<DeviceCommand>(&received.command); signals != nullptr && waiting_[target])
      if (const auto* earlier = std::get_if<DeviceCommand>(&waiting_[target]->command))
        add_other_signals(*earlier, *signals);
    discard(waiting_[target], received.goal ? GoalEnd::preempted : GoalEnd::replaced);
    waiting_[target] = std::move(received);
  }
}

bool CommandIntake::is_admitted(const ReceivedCommand& received) {
  const auto target = static_cast<std::size_t>(received.target);
  const bool known_sender = senders_[target] == received.sender;
  Repeats& repeats = repeats_[target];
  const SimTime stamp = stamp_of(received.command);
  const bool may_repeat = known_sender && repeats.left > 0 && stamp.given() && !(repeats.until < stamp);
  if (barrier_.admits(received, known_sender, may_repeat)) return true;
  if (may_repeat) --repeats.left;
  return false;
}

void CommandIntake::cancel(const ReceivedCommand& received) {
  const auto target = static_cast<std::size_t>(received.target);
  const std::uint64_t number = received.goal->number;
  if (waiting_[target] && waiting_[target]->goal && waiting_[target]->goal->number == number)
    return discard(waiting_[target], GoalEnd::cancelled);
  if (!goals_.runs(received.target, number)) return goals_.drop(*received.goal, GoalEnd::cancelled);
  goals_.cancel(received.target);
  stop(received.target);
}

void CommandIntake::discard(std::optional<ReceivedCommand>& waiting, GoalEnd end) {
  if (waiting && waiting->goal) goals_.drop(*waiting->goal, end);
  waiting.reset();
}

void CommandIntake::stop(int target) {
  const auto robots = static_cast<int>(loop_.cell().robots.size());
  std::optional<Command>& stop = stops_[static_cast<std::size_t>(target)];
  if (target < robots) {
    stop = TrajectoryCommand{target, {}, no_path_};
  } else if (const GripperSample& gripper = goals_.gripper(target - robots); gripper.part < 0) {
    stop = GripperCommand{
        .gripper = target - robots, .stamp = {}, .action = GripperAction::width, .width_m = gripper.width_m};
  }
}

bool CommandIntake::has(int target) const {
  if (waiting_[static_cast<std::size_t>(target)]) return true;
  const auto* controller = barrier_.controllers().owner(target);
  return controller != nullptr && controller->boundary_step == loop_.simulation.step_index() &&
         ahead_.has(target, controller->boundary);
}

std::span<const Command> CommandIntake::take_batch() {
  batch_.clear();
  batch_goals_.clear();
  const bool lockstep = loop_.pace == Pace::lockstep;
  for (int target = 0; target < static_cast<int>(waiting_.size()); ++target) {
    std::optional<ReceivedCommand>& received = waiting_[static_cast<std::size_t>(target)];
    std::optional<Command>& stop = stops_[static_cast<std::size_t>(target)];
    const auto* controller = barrier_.controllers().owner(target);
    const bool at_boundary =
        controller != nullptr && controller->boundary_step == loop_.simulation.step_index();
    if (at_boundary && !received) {
      received = ahead_.take(target, controller->boundary);
      if (received && lockstep && barrier_.refuses_beside_trajectory(*received)) received.reset();
    }
    if (received && !(lockstep && controller != nullptr && !at_boundary)) {
      Command& command = batch_.emplace_back(std::move(received->command));
      // The stamp of a goal is its start.
      if (controller != nullptr && !received->goal) {
        if (auto* joints = std::get_if<JointCommand>(&command)) joints->period_s = controller->period_s;
        if (lockstep)
          std::visit([&](auto& c) { c.stamp = SimTime::from_seconds(loop_.simulation.time_s()); }, command);
      }
      batch_goals_.push_back(std::move(received->goal));
      latency_.record_ns(monotonic_now_ns() - received->received_ns);
      received.reset();
      stop.reset();
    } else if (stop) {
      batch_.push_back(std::move(*stop));
      batch_goals_.emplace_back();
      stop.reset();
    }
  }
  return batch_;
}

void CommandIntake::restart() {
  // Goals that wait in the buffer end too.
  buffer_.take_all(incoming_);
  for (const ReceivedCommand& received : incoming_)
    if (received.goal) goals_.drop(*received.goal, GoalEnd::reset);
  buffer_.forget();
  set_present(loop_.simulation.time_s());
  for (auto& waiting : waiting_) discard(waiting, GoalEnd::reset);
  stops_.assign(stops_.size(), std::nullopt);
  ahead_.drop_all();
  for (std::size_t target = 0; target < repeats_.size(); ++target)
    repeats_[target] = {newest_[target], kMostLookahead};
  latency_.clear();
}

}  // namespace takt

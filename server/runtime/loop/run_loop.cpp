#include "server/runtime/loop/run_loop.h"

#include <algorithm>
#include <utility>

#include "server/runtime/loop/scheduling.h"
#include "server/runtime/recording/log_recorder.h"
#include "server/simulation/model/cell_model.h"

namespace takt {
namespace {

constexpr std::int64_t kLongestSleep_ns = 10'000'000;  // so that requests are heard at slow paces
constexpr std::int64_t kWaitInStatus_ns = 20'000'000;  // a wait this long is told in the status at once
constexpr std::int64_t kLateAfter_ns = 1'000'000'000;  // and this long in an event

}  // namespace

RunLoop::RunLoop(Simulation& simulation, RunLoopOptions options)
    : simulation_(simulation),
      options_(std::move(options)),
      buffer_(simulation.description()),
      output_(simulation.make_snapshot(),
              options_.outbound ? options_.outbound : std::make_shared<OutboundQueue>()),
      pacer_(options_.clock != nullptr ? *options_.clock : system_monotonic_clock()),
      pressures_(simulation.model()),
      registry_(target_count(simulation.description()), simulation.description().step_s),
      state_(options_.start_stopped  ? SimulationState::stopped
             : options_.start_paused ? SimulationState::paused
                                     : SimulationState::playing),
      pace_(options_.pace),
      factor_(options_.factor),
      pending_(static_cast<std::size_t>(target_count(simulation.description()))),
      saved_(first_saved(simulation, options_)) {
  incoming_.reserve(buffer_.capacity());
  batch_.reserve(pending_.size());
}

RunLoop::~RunLoop() {
  stop();
}

void RunLoop::start() {
  {
    const std::lock_guard lock(requests_mutex_);
    running_ = true;
  }
  thread_ = std::thread([this] { run(); });
}

void RunLoop::stop() {
  stop_.store(true);
  wakeup_.post();
  if (thread_.joinable()) thread_.join();
}

std::optional<Rejection> RunLoop::append(const Command& command, std::uint64_t sender,
                                         std::int64_t received_ns) {
  auto rejection = buffer_.append(command, sender, received_ns);
  if (!rejection) wakeup_.post();
  return rejection;
}

void RunLoop::snapshot_written(std::uint64_t number) {
  output_.newest_written.store(number, std::memory_order_release);
  wakeup_.post();
}

double RunLoop::wall_time_s() const {
  return static_cast<double>(monotonic_now_ns() - output_.outbound->began_ns) * 1e-9;
}

void RunLoop::run() {
  scheduling_.assign(obtain_scheduling(options_.realtime_priority));
  anchor();
  publish_instant();
  while (!stop_.load(std::memory_order_relaxed)) {
    if (hold_.load(std::memory_order_relaxed)) {
      park();
      continue;
    }
    if (requests_waiting_.load(std::memory_order_acquire)) execute_requests();
    if (hold_.load(std::memory_order_relaxed)) continue;
    answer_query();
    collect_commands();
    if (!may_step()) {
      output_.standing_at_boundary.store(true, std::memory_order_relaxed);
      publish_status_if_due();
      save_if_due();
      const std::int64_t now = monotonic_now_ns();
      if (queries_.empty()) wakeup_.wait_until_ns(std::min(next_status_ns_, now + kWaitInStatus_ns));
      continue;
    }
    output_.standing_at_boundary.store(false, std::memory_order_relaxed);
    if (pace_ == Pace::realtime && state_ == SimulationState::playing) {
      const Pacer::Result result = pacer_.wait(kLongestSleep_ns);
      if (result == Pacer::Result::not_due) {
        publish_status_if_due();
        continue;
      }
      if (result == Pacer::Result::rebased) {
        EventRecord rebased = event(EventCode::schedule_rebased, Severity::warning);
        rebased.x = static_cast<double>(pacer_.figures().lag_ns) * 1e-9;
        emit(rebased);
      }
      collect_commands();
    }
    take_step();
  }
  if (recorder_ != nullptr) recorder_->end_world(simulation_);
  refuse_what_waits();
  state_ = SimulationState::quitting;
  publish_status(monotonic_now_ns());
  if (quitting_.load() && on_quit_) on_quit_();
}

void RunLoop::collect_commands() {
  // Whoever is just appending wakes the loop afterwards. Only where steps are counted, not timed, a command
  // that was there before a step must be in it.
  buffer_.take_all(incoming_, pace_ == Pace::lockstep || state_ != SimulationState::playing);
  for (ReceivedCommand& received : incoming_) {
    const int target = received.target;
    if (pace_ == Pace::lockstep && !accept_in_lockstep(target, received)) continue;
    // One command per target and step: of several that came in, the newest is the sender's present will.
    pending_[static_cast<std::size_t>(target)] = {true, received};
  }
}

bool RunLoop::accept_in_lockstep(int target, ReceivedCommand& received) {
  const auto* controller = registry_.owner(target);
  const double step_s = cell().step_s;
  SimTime stamp = stamp_of(received.command);
  RejectionCode code = RejectionCode::invalid_request;
  double boundary_s = -1.0;
  if (controller == nullptr) {
    // While single-stepping the one who steps decides what goes in between; a running lockstep must not
    // depend on when a command happens to arrive.
    if (state_ != SimulationState::playing) return true;
  } else {
    boundary_s = static_cast<double>(controller->boundary_step) * step_s;
    const auto boundary = SimTime::from_seconds(boundary_s);
    // A zero stamp means "none" on the wire, and the boundary at t = 0.
    if (!stamp.given() && boundary.ns == 0) stamp = boundary;
    // Until its end a trajectory is what its controller has sent for every boundary; see
    // boundary_commands_present().
    if (stamp == boundary && !covered_by_trajectory(target, boundary_s)) return true;
    if (stamp == boundary) stamp = {};
    if (controller->boundary > 0) {
      const auto crossed = period_boundary_step(controller->boundary - 1, controller->period_s, step_s);
      // The answer to a state that was sent twice.
      if (stamp == SimTime::from_seconds(static_cast<double>(crossed) * step_s)) return false;
    }
    if (stamp.given()) code = stamp < boundary ? RejectionCode::stale : RejectionCode::out_of_range;
  }
  EventRecord rejected = event(EventCode::command_rejected, Severity::warning);
  rejected.a = target;
  rejected.b = static_cast<int>(code);
  rejected.x = stamp.seconds();
  rejected.y = boundary_s;
  rejected.sender = received.sender;
  emit(rejected);
  ++commands_rejected_;
  return false;
}

bool RunLoop::may_step() {
  waiting_count_ = 0;
  if (faulted_) return false;
  if (state_ != SimulationState::playing && single_steps_left_ == 0) {
    wait_began_ns_ = 0;
    return false;
  }
  return pace_ != Pace::lockstep || boundary_commands_present();
}

bool RunLoop::boundary_commands_present() {
  if (registry_.controllers().empty()) {
    if (single_steps_left_ > 0) return true;
    waiting_for_[0].assign("(no controller is registered)");
    waiting_count_ = 1;
    return false;
  }
  const std::uint64_t step = simulation_.step_index();
  std::optional<EventRecord> timeout;
  for (auto& controller : registry_.controllers()) {
    if (controller.boundary_step != step) continue;
    const auto missing = std::find_if(controller.targets.begin(), controller.targets.end(), [&](int target) {
      return !pending_[static_cast<std::size_t>(target)].present &&
             !covered_by_trajectory(target, simulation_.time_s());
    });
    if (missing == controller.targets.end()) continue;
    waiting_for_[waiting_count_++].assign(controller.name);
    if (auto ended = wait_for_controller(controller, *missing)) {
      if (timeout) emit(*timeout);  // each of them is named; the last one pauses
      timeout = ended;
    }
  }
  if (timeout) pause_with(*timeout);
  return waiting_count_ == 0;
}

bool RunLoop::covered_by_trajectory(int target, double time_s) const {
  if (static_cast<std::size_t>(target) >= cell().robots.size()) return false;
  return simulation_.trajectory_end_s(static_cast<std::size_t>(target)) > time_s + 0.5 * cell().step_s;
}

std::optional<EventRecord> RunLoop::wait_for_controller(ControllerRegistry::Controller& controller,
                                                        int missing_target) {
  const std::int64_t now = monotonic_now_ns();
  if (wait_began_ns_ == 0) {
    wait_began_ns_ = now;
    for (auto& each : registry_.controllers()) each.late_told = false;
    wait_in_status_ = false;
  }
  const std::int64_t waited = now - wait_began_ns_;
  if (waited >= kWaitInStatus_ns && !wait_in_status_) {
    wait_in_status_ = true;
    publish_status(now);
  }
  EventRecord late = event(EventCode::controller_late, Severity::warning);
  late.a = missing_target;
  late.x = simulation_.time_s();
  late.text.assign(controller.name);
  if (static_cast<double>(waited) >= controller.timeout_s * 1e9) {
    late.code = EventCode::controller_timeout;
    late.severity = Severity::error;
    late.y = controller.timeout_s;
    return late;
  }
  if (waited >= kLateAfter_ns && !controller.late_told) {
    controller.late_told = true;
    late.y = static_cast<double>(waited) * 1e-9;
    emit(late);
  }
  return std::nullopt;
}

void RunLoop::gather_batch() {
  batch_.clear();
  const std::uint64_t step = simulation_.step_index();
  for (std::size_t target = 0; target < pending_.size(); ++target) {
    Pending& pending = pending_[target];
    if (!pending.present) continue;
    const auto* controller = registry_.owner(static_cast<int>(target));
    const bool at_boundary = controller != nullptr && controller->boundary_step == step;
    if (pace_ == Pace::lockstep && controller != nullptr && !at_boundary) continue;
    Command& command = batch_.emplace_back(pending.received.command);
    if (controller != nullptr) {
      if (auto* joints = std::get_if<JointCommand>(&command)) joints->period_s = controller->period_s;
      if (pace_ == Pace::lockstep) {
        std::visit([&](auto& c) { c.stamp = SimTime::from_seconds(simulation_.time_s()); }, command);
      }
    }
    command_latency_.record_ns(monotonic_now_ns() - pending.received.received_ns);
    pending.present = false;
  }
}

void RunLoop::finish_boundaries(std::uint64_t step) {
  for (auto& controller : registry_.controllers()) {
    // Out of lockstep nobody waits at boundaries; they are kept up to date for when lockstep begins.
    while (controller.boundary_step <= step) registry_.advance(controller);
  }
  wait_began_ns_ = 0;
}

void RunLoop::take_step() {
  const std::uint64_t step = simulation_.step_index();
  gather_batch();
  const bool deadlines_count = pace_ != Pace::lockstep;
  simulation_.watch_deadlines(deadlines_count);
  if (recorder_ != nullptr) {
    recorder_->deadlines(simulation_, deadlines_count);
    recorder_->commands(simulation_, batch_);
  }
  const std::int64_t began = monotonic_now_ns();
  const bool advanced = simulation_.step(batch_);
  const std::int64_t ended = monotonic_now_ns();
  if (!advanced) {
    if (recorder_ != nullptr) recorder_->fault(simulation_);
    faulted_ = true;
    pause_with(fault_record(simulation_));
    return;
  }
  if (recorder_ != nullptr) recorder_->stepped(simulation_);
  step_time_.record_ns(ended - began);
  computed_ns_ += ended - began;
  commands_applied_ += batch_.size();
  finish_boundaries(step);
  buffer_.set_present(SimTime::from_seconds(simulation_.time_s()));
  for (const ConnectionChange& change : simulation_.connection_changes()) {
    EventRecord changed = event(EventCode::connection_changed, Severity::information);
    changed.time_s = change.time_s;
    changed.step = change.step;
    changed.a = change.part;
    changed.b = change.from;
    changed.c = change.to;
    emit(changed);
  }
  for (const MotionNotice& notice : simulation_.motion_notices())
    emit(motion_record(notice, simulation_.epoch()));
  for (const CollisionEvent& found : simulation_.collision_events())
    emit(collision_record(found, simulation_.epoch()));
  for (const WeakGrip& grip : simulation_.weak_grips()) emit(weak_grip_record(grip, simulation_.epoch()));
  for (const AlternatingForce& force : simulation_.alternating_forces())
    emit(alternating_force_record(force, simulation_.epoch()));
  publish_instant();
  if (single_steps_left_ > 0 && --single_steps_left_ == 0) {
    end_single_steps(ControlResult::ok, "The steps are done.");
  }
  if (options_.pause_at_s && !ended_ && simulation_.time_s() >= *options_.pause_at_s - 0.5 * cell().step_s) {
    ended_ = true;
    pause_with(event(EventCode::end_of_scenario, Severity::information));
    if (options_.quit_at_end) {
      quitting_.store(true);
      stop_.store(true);
    }
  }
  publish_status_if_due();
  changed_since_save_ = true;
  save_if_due();
}

void RunLoop::pause_with(EventRecord event) {
  emit(event);
  state_ = SimulationState::paused;
  wait_began_ns_ = 0;
  end_single_steps(ControlResult::failed, describe(event, cell()).message);
  publish_status(monotonic_now_ns());
}

void RunLoop::publish_instant() {
  PublishedSnapshot& published = output_.snapshots.write_buffer();
  simulation_.read_snapshot(published.snapshot);
  contact_pairs_ = static_cast<std::uint32_t>(published.snapshot.contacts.pressing().size() +
                                              published.snapshot.contacts.omitted);
  published.number = ++published_;
  output_.snapshots.publish();
  output_.news.post();
  if (options_.on_instant) options_.on_instant(simulation_);
  if (pace_ == Pace::lockstep) wait_until_written();
}

void RunLoop::wait_until_written() {
  while (output_.writer_attached.load(std::memory_order_relaxed) && !stop_.load(std::memory_order_relaxed) &&
         output_.newest_written.load(std::memory_order_acquire) < published_) {
    wakeup_.wait_until_ns(monotonic_now_ns() + kLongestSleep_ns);
  }
}

EventRecord RunLoop::event(EventCode code, Severity severity) const {
  EventRecord record;
  record.code = code;
  record.severity = severity;
  record.time_s = simulation_.time_s();
  record.step = simulation_.step_index();
  record.epoch = simulation_.epoch();
  return record;
}

void RunLoop::emit(const EventRecord& event) {
  output_.events.push(event);
  output_.news.post();
}

void RunLoop::anchor() {
  pacer_.anchor(cell().step_s, factor_);
}

}  // namespace takt

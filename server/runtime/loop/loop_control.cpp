#include "server/runtime/loop/loop_control.h"

#include <utility>

#include "server/runtime/loop/scheduling.h"

namespace takt {

LoopControl::LoopControl(Simulation& simulation, LoopOutput& output, const RunLoopOptions& options,
                         std::atomic<bool>& stop)
    : context{simulation, output, options.state, options.pace, options.factor},
      barrier(context),
      goals(simulation, output.goals),
      intake(context, barrier, goals),
      pacer(options.clock != nullptr ? *options.clock : system_monotonic_clock()),
      status(context, pacer, barrier, intake),
      saver(context, options.save_every_s),
      options_(options),
      stop_(stop) {
  missing_.reserve(static_cast<std::size_t>(target_count(context.cell())));
  for (requests::RegisterController controller : options.controllers) {
    std::erase_if(controller.targets,
                  [&](const std::string& target) { return find_target(context.cell(), target) < 0; });
    if (controller.targets.empty())
      context.emit(events::ControllerWithoutTargets{FixedString<128>(controller.name)});
    else
      (void)barrier.controllers().add(controller, 0, context.cell());
  }
}

void LoopControl::begin() {
  status.set_scheduling(obtain_scheduling(options_.realtime_priority));
  anchor();
  arrive();
}

bool LoopControl::may_step() {
  if (goals.take_news()) context.output.news.post();
  barrier.clear_waiting_for();
  if (context.faulted) return false;
  if (!context.plays() && single_steps_left_ == 0) {
    barrier.stop_waiting();
    return false;
  }
  if (context.pace != Pace::lockstep) return true;
  const auto verdict =
      barrier.check([this](int target) { return intake.has(target); }, single_steps_left_ > 0);
  if (verdict.timeout) {
    pause_with(*verdict.timeout);
  } else if (verdict.news_for_status) {
    status.publish();
  }
  return verdict.open;
}

void LoopControl::expect_commands() {
  if (context.pace != Pace::lockstep || !context.plays()) return;
  barrier.missing([this](int target) { return intake.has(target); }, missing_);
  intake.buffer().expect(SimTime::from_seconds(context.simulation.time_s()), missing_);
}

void LoopControl::take_step() {
  Simulation& simulation = context.simulation;
  const std::uint64_t step = simulation.step_index();
  const std::span<const Command> batch = intake.take_batch();
  goals.apply(batch, intake.batch_goals());
  const bool deadlines_count = context.pace != Pace::lockstep;
  simulation.watch_deadlines(deadlines_count);
  if (context.recorder != nullptr) {
    context.recorder->deadlines(simulation, deadlines_count);
    context.recorder->commands(simulation, batch);
  }
  const std::int64_t began = monotonic_now_ns();
  const bool advanced = simulation.step(batch);
  const std::int64_t ended = monotonic_now_ns();
  if (!advanced) {
    context.record(LogFault{});
    context.faulted = true;
    goals.restart();
    pause_with(fault_record(simulation).event);
    return;
  }
  if (context.recorder != nullptr) context.recorder->stepped(simulation);
  status.stepped(ended - began);
  intake.count_applied();
  barrier.crossed(step);
  intake.set_present(simulation.time_s());
  report_step(simulation, [this](const EventRecord& record) { context.emit(record); });
  goals.stepped([this](int target) { intake.stop(target); });
  if (goals.take_news()) context.output.news.post();
  arrive(instant_is_wanted(ended));
  if (single_steps_left_ > 0 && --single_steps_left_ == 0)
    end_single_steps({ControlResult::ok, "The steps are done."});
  if (!ended_ && at_the_end()) {
    ended_ = true;
    pause_with(events::EndOfScenario{});
    if (options_.quit_at_end) quit();
  }
  status.publish_if_due();
  saver.note_change();
  saver.save_if_due();
}

bool LoopControl::at_the_end() const {
  return options_.pause_at_s &&
         context.simulation.time_s() >= *options_.pause_at_s - 0.5 * context.cell().step_s;
}

void LoopControl::pause_with(const events::OfLoop& event) {
  const EventRecord record = context.record_of(event);
  context.emit(record);
  context.state = SimulationState::paused;
  publish_skipped_instant();
  barrier.stop_waiting();
  end_single_steps({ControlResult::failed, describe(record, context.cell()).message});
  status.publish();
}

void LoopControl::arrive(bool wanted) {
  if (options_.on_instant) options_.on_instant(context.simulation);
  instant_skipped_ = !wanted;
  if (wanted) publish_instant();
}

void LoopControl::publish_instant() {
  LoopOutput& output = context.output;
  Snapshot& snapshot = output.snapshots.write_buffer();
  context.simulation.read_snapshot(snapshot);
  status.set_contact_pairs(snapshot.contacts.count + snapshot.contacts.omitted);
  output.snapshots.publish();
  instant_skipped_ = false;
  instants_.published(context.simulation.time_s(), monotonic_now_ns());
  if (context.pace != Pace::lockstep || !output.instant_writer.write()) output.news.post();
}

/// In lockstep a controller waits for the instants at its boundaries, but for those that it has answered already. The last
/// of single steps precedes its reply.
bool LoopControl::instant_is_wanted(std::int64_t now_ns) {
  if (single_steps_left_ == 1) return true;
  if (context.pace != Pace::lockstep) return context.output.readers.any() || now_ns >= status.due_ns();
  const bool due = instants_.due(context.simulation.time_s(), now_ns);
  return due || barrier.is_waited_for([this](int target) { return intake.has(target); });
}

void LoopControl::set_state(SimulationState state) {
  if (context.state == state) return;
  context.state = state;
  publish_skipped_instant();
  barrier.stop_waiting();
  if (state == SimulationState::playing) {
    anchor();
    if (context.pace == Pace::lockstep) {
      for (int target = 0; target < target_count(context.cell()); ++target)
        if (barrier.controllers().owner(target) == nullptr) intake.drop(target);
    }
  }
  context.emit(events::StateChanged{state});
  status.publish();
}

void LoopControl::set_pace(Pace pace, double factor) {
  context.pace = pace;
  context.factor = factor;
  intake.drop_present();
  barrier.stop_waiting();
  anchor();
}

void LoopControl::quit() {
  quits.store(true);
  stop_.store(true);
}

void LoopControl::reset() {
  Simulation& simulation = context.simulation;
  end_single_steps({ControlResult::failed, "The remaining steps were not taken: the cell was reset."});
  const std::uint64_t step = simulation.step_index();
  if (context.recorder != nullptr) context.recorder->checkpoint(simulation);
  simulation.reset();
  if (context.recorder != nullptr) context.recorder->note(step, LogReset{});
  restart(0);
  context.emit(events::CellReset{});
  arrive();
  status.publish();
}

std::string LoopControl::restore(std::span<const std::byte> state) {
  Simulation& simulation = context.simulation;
  const std::uint64_t step = simulation.step_index();
  if (context.recorder != nullptr) context.recorder->checkpoint(simulation);
  const std::string refusal = simulation.restore_state(state);
  if (!refusal.empty()) return refusal;
  if (context.recorder != nullptr) context.recorder->restored(step, state);
  end_single_steps({ControlResult::failed, "The remaining steps were not taken: a snapshot was restored."});
  restart(simulation.step_index());
  ended_ = at_the_end();
  if (context.state == SimulationState::stopped) set_state(SimulationState::paused);
  arrive();
  status.publish();
  return {};
}

void LoopControl::restart(std::uint64_t step) {
  intake.restart();
  goals.restart();
  barrier.controllers().restart(step);
  barrier.stop_waiting();
  context.faulted = false;
  ended_ = false;
  pacer.clear_figures();
  status.restart();
  instants_.restart(context.simulation.time_s());
  anchor();
}

void LoopControl::begin_single_steps(std::uint64_t request, std::uint64_t count) {
  if (context.state == SimulationState::stopped) set_state(SimulationState::paused);
  single_steps_left_ = count;
  single_steps_request_ = request;
}

void LoopControl::end_single_steps(Refusal end) {
  if (single_steps_request_ == 0) return;
  ControlReply reply{single_steps_request_, end.result, std::move(end.message)};
  if (end.result == ControlResult::ok)
    reply.values =
        arguments_of(requests::StepResponse{context.simulation.step_index(), context.simulation.time_s()});
  context.reply(std::move(reply));
  single_steps_request_ = 0;
  single_steps_left_ = 0;
}

}  // namespace takt

// Control requests of the step loop: handed over by submit(), executed between two steps.
#include <algorithm>
#include <utility>

#include "idl/common/text.h"
#include "server/runtime/loop/run_loop.h"
#include "server/runtime/recording/log_recorder.h"
#include "server/runtime/requests/entity_requests.h"
#include "server/runtime/requests/explain_reply.h"

namespace takt {

namespace {
constexpr std::size_t kMaxQuestions = 64;
constexpr std::int64_t kLongestHeldSleep_ns = 20'000'000;
constexpr const char* kEnded = "The simulation of this scenario has ended; the request was not executed.";
}  // namespace

void RunLoop::submit(const ControlRequest& request) {
  auto parsed = parse(request, cell());
  if (auto* answer = std::get_if<ControlReply>(&parsed)) {
    output_.add_reply(std::move(*answer));
    return;
  }
  // What depends on the description alone does not concern the loop.
  if (const auto* list = std::get_if<GetEntities>(&std::get<ControlAction>(parsed))) {
    output_.add_reply(entities_reply(request.id, *list, cell()));
    return;
  }
  bool closed = false;
  {
    const std::lock_guard lock(requests_mutex_);
    closed = closed_;
    if (!closed) requests_.push_back({request.id, std::get<ControlAction>(std::move(parsed))});
    requests_waiting_.store(!closed, std::memory_order_release);
  }
  if (closed) {
    reply(request.id, ControlResult::incorrect_state, kEnded);
  } else {
    wakeup_.post();
  }
}

bool RunLoop::between_steps(const std::function<void()>& action) {
  std::unique_lock lock(requests_mutex_);
  if (!running_) return false;
  visit_ = &action;
  requests_waiting_.store(true, std::memory_order_release);
  wakeup_.post();
  visited_.wait(lock, [&] { return visit_ == nullptr || !running_; });
  return std::exchange(visit_, nullptr) == nullptr;
}

std::optional<SimulationState> RunLoop::hold() {
  std::optional<SimulationState> state;
  (void)between_steps([&] {
    hold_.store(true);
    state = state_;
  });
  return state;
}

void RunLoop::release() {
  hold_.store(false);
  wakeup_.post();
}

void RunLoop::park() {
  output_.standing_at_boundary.store(true, std::memory_order_relaxed);
  publish_status_if_due();
  wakeup_.wait_until_ns(std::min(next_status_ns_, monotonic_now_ns() + kLongestHeldSleep_ns));
}

void RunLoop::inherit_from(const RunLoop& other, SimulationState state) {
  begin_with(other.pace_, other.factor_);
  state_ = state;
  // Numbers of targets differ where a Part with a device of its own came or went; names stay.
  for (const ControllerRegistry::Controller& controller : other.registry_.controllers()) {
    RegisterController again{controller.name, controller.period_s, controller.timeout_s, {}};
    for (const int target : controller.targets)
      if (const int here = find_target(cell(), target_name(other.cell(), target)); here >= 0)
        again.targets.push_back(here);
    if (again.targets.empty()) {
      EventRecord removed = event(EventCode::controller_unregistered, Severity::warning);
      removed.text.assign(controller.name);
      emit(removed);
    } else {
      (void)registry_.add(again, 0, cell());
    }
  }
}

void RunLoop::refuse_what_waits() {
  end_single_steps(ControlResult::failed, "The remaining steps were not taken: the simulation has ended.");
  std::vector<PendingAction> requests;
  {
    const std::lock_guard lock(requests_mutex_);
    closed_ = true;
    running_ = false;
    requests.swap(requests_);
  }
  visited_.notify_all();
  for (const PendingAction& request : requests) reply(request.id, ControlResult::incorrect_state, kEnded);
  for (const Query& query : queries_) reply(query.id, ControlResult::incorrect_state, kEnded);
  queries_.clear();
}

void RunLoop::execute_requests() {
  std::vector<PendingAction> requests;
  const std::function<void()>* visit = nullptr;
  {
    const std::lock_guard lock(requests_mutex_);
    requests.swap(requests_);
    visit = visit_;
    requests_waiting_.store(false, std::memory_order_relaxed);
  }
  if (visit != nullptr) {
    (*visit)();
    {
      const std::lock_guard lock(requests_mutex_);
      visit_ = nullptr;
    }
    visited_.notify_all();
    if (hold_.load()) {  // they came together with hold(): those who come after it wait as well
      const std::lock_guard lock(requests_mutex_);
      requests_.insert(requests_.begin(), std::make_move_iterator(requests.begin()),
                       std::make_move_iterator(requests.end()));
      requests_waiting_.store(!requests_.empty(), std::memory_order_relaxed);
      return;
    }
  }
  changed_since_save_ = true;
  for (const PendingAction& request : requests) {
    const std::uint64_t id = request.id;
    if (std::holds_alternative<GetFeatures>(request.action)) {
      output_.add_reply(features_reply(id));
    } else if (std::holds_alternative<GetState>(request.action)) {
      execute_get_state(id);
    } else if (const auto* to_state = std::get_if<SetState>(&request.action)) {
      execute(id, *to_state);
    } else if (const auto* step = std::get_if<Step>(&request.action)) {
      execute(id, *step);
    } else if (const auto* reset = std::get_if<Reset>(&request.action)) {
      // A scenario with something spawned is exchanged by the host, which does not ask the loop.
      if (reset->spawned_only) {
        reply(id, ControlResult::ok, "Nothing was spawned or deleted.");
        continue;
      }
      do_reset();
      reply(id, ControlResult::ok, "The cell is back in its initial state.",
            {{"epoch", std::to_string(simulation_.epoch())}});
    } else if (const auto* to_pace = std::get_if<SetPace>(&request.action)) {
      execute(id, *to_pace);
    } else if (const auto* add = std::get_if<RegisterController>(&request.action)) {
      execute(id, *add);
    } else if (const auto* remove = std::get_if<UnregisterController>(&request.action)) {
      execute(id, *remove);
    } else if (const auto* level = std::get_if<SetLevelOfDetail>(&request.action)) {
      execute(id, *level);
    } else if (const auto* put = std::get_if<SetEntityState>(&request.action)) {
      execute(id, *put);
    } else if (const auto* attach = std::get_if<Attach>(&request.action)) {
      execute(id, *attach);
    } else if (const auto* detach = std::get_if<Detach>(&request.action)) {
      execute(id, *detach);
    } else if (const auto* part = std::get_if<ExplainPart>(&request.action)) {
      take_query({id, part->component, true});
    } else if (const auto* entity = std::get_if<GetEntityState>(&request.action)) {
      take_query({id, entity->component, false});
    }
  }
}

void RunLoop::reply(std::uint64_t id, ControlResult result, std::string message, TextArguments values) {
  output_.add_reply({id, result, std::move(message), std::move(values)});
}

void RunLoop::execute_get_state(std::uint64_t id) {
  reply(id, ControlResult::ok, "The simulation is " + std::string(to_string(state_)) + ".",
        {{"state", std::to_string(static_cast<int>(state_))},
         {"state_name", std::string(to_string(state_))},
         {"pace", std::string(to_string(pace_))},
         {"factor", exact_text(factor_)},
         {"time", exact_text(simulation_.time_s())},
         {"step", std::to_string(simulation_.step_index())},
         {"epoch", std::to_string(simulation_.epoch())},
         {"state_hash", std::to_string(simulation_.state_hash())},
         {"fault", faulted_ ? simulation_.fault() : std::string()}});
}

void RunLoop::execute(std::uint64_t id, const SetLevelOfDetail& action) {
  const std::string process =
      action.process < 0 ? "all processes" : cell().processes[static_cast<std::size_t>(action.process)].name;
  const std::string reason = simulation_.set_level_of_detail(action.process, action.level);
  if (!reason.empty()) {
    reply(id, ControlResult::failed, "The level of detail stays as it is: " + reason);
    return;
  }
  if (recorder_ != nullptr) recorder_->level_of_detail(simulation_, action.process, action.level);
  EventRecord changed = event(EventCode::level_of_detail_changed, Severity::information);
  changed.a = action.process;
  changed.b = action.level;
  emit(changed);
  publish_instant();
  publish_status(monotonic_now_ns());
  reply(id, ControlResult::ok,
        "The level of detail of " + process + " is now " + std::to_string(action.level) + ".",
        {{"level", std::to_string(action.level)}});
}

void RunLoop::take_query(const Query& query) {
  if (queries_.size() >= kMaxQuestions) {
    reply(query.id, ControlResult::failed,
          std::to_string(kMaxQuestions) +
              " questions are waiting already; at most one is answered before each step.");
    return;
  }
  queries_.push_back(query);
}

void RunLoop::answer_query() {
  if (queries_.empty()) return;
  const Query query = queries_.front();
  queries_.erase(queries_.begin());
  if (query.why) {
    output_.add_reply(explanation_reply(query.id, simulation_.explain(query.component), cell()));
  } else {
    output_.add_reply(entity_state_reply(query.id, query.component, simulation_.make_snapshot(), cell()));
  }
}

void RunLoop::execute(std::uint64_t id, const SetState& action) {
  const SimulationState before = state_;
  switch (action.state) {
    case SimulationState::stopped:
      do_reset();
      set_state(SimulationState::stopped);
      break;
    case SimulationState::playing:
      if (faulted_) {
        reply(id, ControlResult::incorrect_state,
              "The simulation has a fault and must be reset first: " + simulation_.fault());
        return;
      }
      end_single_steps(ControlResult::failed,
                       "The remaining steps were not taken one by one: the simulation was set playing.");
      set_state(SimulationState::playing);
      break;
    case SimulationState::paused:
      end_single_steps(ControlResult::failed,
                       "The remaining steps were not taken: the simulation was paused.");
      set_state(SimulationState::paused);
      break;
    case SimulationState::no_world:
    case SimulationState::loading_world:
      break;  // none that a request may ask for
    case SimulationState::quitting:
      set_state(SimulationState::quitting);
      quitting_.store(true);
      stop_.store(true);
      break;
  }
  reply(id, ControlResult::ok,
        "The simulation is " + std::string(before == state_ ? "already " : "now ") +
            std::string(to_string(state_)) + ".",
        {{"state", std::to_string(static_cast<int>(state_))}});
}

void RunLoop::execute(std::uint64_t id, const Step& action) {
  if (faulted_) {
    reply(id, ControlResult::incorrect_state,
          "The simulation has a fault and must be reset first: " + simulation_.fault());
  } else if (state_ == SimulationState::playing) {
    reply(id, ControlResult::incorrect_state,
          "Single steps are possible only while the simulation is paused; it is playing.");
  } else if (single_steps_left_ > 0) {
    reply(id, ControlResult::incorrect_state,
          "An earlier step request is still being worked on; " + std::to_string(single_steps_left_) +
              " steps are left.");
  } else {
    if (state_ == SimulationState::stopped) set_state(SimulationState::paused);
    single_steps_left_ = action.steps;
    single_steps_request_ = id;
  }
}

void RunLoop::execute(std::uint64_t id, const SetPace& action) {
  pace_ = action.pace;
  factor_ = action.pace == Pace::realtime ? action.factor : 1.0;
  for (Pending& pending : pending_) pending.present = false;
  wait_began_ns_ = 0;
  anchor();
  EventRecord changed = event(EventCode::pace_changed, Severity::information);
  changed.a = static_cast<int>(pace_);
  changed.x = factor_;
  emit(changed);
  publish_status(monotonic_now_ns());
  reply(id, ControlResult::ok, describe(changed, cell()).message,
        {{"pace", std::string(to_string(pace_))}, {"factor", exact_text(factor_)}});
}

void RunLoop::execute(std::uint64_t id, const RegisterController& action) {
  const std::string refusal = registry_.add(action, simulation_.step_index(), cell());
  if (!refusal.empty()) {
    reply(id, ControlResult::failed, refusal);
    return;
  }
  for (const int target : action.targets) pending_[static_cast<std::size_t>(target)].present = false;
  wait_began_ns_ = 0;
  EventRecord registered = event(EventCode::controller_registered, Severity::information);
  registered.text.assign(action.name);
  registered.x = action.period_s;
  emit(registered);
  const auto boundary_step = registry_.owner(action.targets.front())->boundary_step;
  reply(id, ControlResult::ok, describe(registered, cell()).message,
        {{"next_boundary_step", std::to_string(boundary_step)},
         {"next_boundary_time", exact_text(static_cast<double>(boundary_step) * cell().step_s)},
         {"epoch", std::to_string(simulation_.epoch())}});
}

void RunLoop::execute(std::uint64_t id, const UnregisterController& action) {
  if (!registry_.remove(action.name)) {
    reply(id, ControlResult::not_found, "There is no controller '" + action.name + "'.");
    return;
  }
  wait_began_ns_ = 0;
  EventRecord removed = event(EventCode::controller_unregistered, Severity::information);
  removed.text.assign(action.name);
  emit(removed);
  reply(id, ControlResult::ok, describe(removed, cell()).message);
}

void RunLoop::do_reset() {
  end_single_steps(ControlResult::failed, "The remaining steps were not taken: the cell was reset.");
  const std::uint64_t step = simulation_.step_index();
  if (recorder_ != nullptr) recorder_->checkpoint(simulation_);
  simulation_.reset();
  if (recorder_ != nullptr) recorder_->reset(step);
  reset_loop_state(0);
  emit(event(EventCode::reset, Severity::information));
  publish_instant();
  publish_status(monotonic_now_ns());
}

void RunLoop::reset_loop_state(std::uint64_t step) {
  buffer_.forget();
  buffer_.set_present_ns(stamp_ns(simulation_.time_s()));
  for (Pending& pending : pending_) pending.present = false;
  registry_.restart(step);
  faulted_ = false;
  ended_ = false;
  wait_began_ns_ = 0;
  pacer_.clear_figures();
  step_time_.clear();
  command_latency_.clear();
  rate_count_ = 0;
  anchor();
}

void RunLoop::set_state(SimulationState state) {
  if (state_ == state) return;
  state_ = state;
  wait_began_ns_ = 0;
  if (state == SimulationState::playing) {
    anchor();
    if (pace_ == Pace::lockstep) {
      for (std::size_t target = 0; target < pending_.size(); ++target) {
        if (registry_.owner(static_cast<int>(target)) == nullptr) pending_[target].present = false;
      }
    }
  }
  EventRecord changed = event(EventCode::state_changed, Severity::information);
  changed.a = static_cast<int>(state);
  emit(changed);
  publish_status(monotonic_now_ns());
}

void RunLoop::end_single_steps(ControlResult result, const std::string& message) {
  if (single_steps_request_ == 0) return;
  reply(single_steps_request_, result, message,
        {{"step", std::to_string(simulation_.step_index())}, {"time", exact_text(simulation_.time_s())}});
  single_steps_request_ = 0;
  single_steps_left_ = 0;
}

}  // namespace takt

#include "server/runtime/loop/request_executor.h"

#include <variant>

#include "server/runtime/requests/bit_changes.h"

namespace takt {
namespace {

template <typename Type>
const Outcome<Type>* answered(const Outcome<Type>& outcome) {
  return &outcome;
}
template <typename Type>
const Outcome<Type>* answered(const std::optional<Outcome<Type>>& answer) {
  return answer ? &*answer : nullptr;
}

}  // namespace

template <Request Type>
requires(request_info<Type>().changes ==
         RequestChanges::bits) Outcome<Type> RequestExecutor::execute(const Type& request) {
  if (std::is_same_v<Type, requests::SetEntityState> && (loop_.plays() || control_.single_steps_left() > 0))
    return Refusal{ControlResult::incorrect_state,
                   "A Part can be put elsewhere only while the simulation is paused or stopped."};
  const BitChange change = apply(request, loop_.simulation);
  if (const auto* reason = std::get_if<std::string>(&change)) return Refusal{ControlResult::failed, *reason};
  const auto* quiet = std::get_if<QuietChange>(&change);
  std::string sentence = quiet != nullptr ? quiet->sentence : report(std::get<events::OfLoop>(change));
  control_.publish_instant();
  if (request_info<Type>().renews_status) control_.status.publish();
  return sentence;
}

template <typename Type>
void RequestExecutor::execute_and_reply(std::uint64_t id, const Type& request) {
  constexpr const RequestInfo& info = request_info<Type>();
  if constexpr (info.phase == RequestPhase::loop || info.phase == RequestPhase::query) {
    const std::uint64_t step = loop_.simulation.step_index();
    executing_ = id;
    const auto answer = execute(request);
    const auto* outcome = answered<Type>(answer);
    if (outcome == nullptr) return;
    if (info.changes == RequestChanges::bits && outcome->ok() && loop_.recorder != nullptr)
      loop_.recorder->note(step, LogRequest{request});
    loop_.reply(outcome->reply(id));
  }
}

void RequestExecutor::execute(std::uint64_t id, const requests::Any& request) {
  const auto execute_one = [&]<typename Type>(const Type& typed) {
    if constexpr (request_info<Type>().phase != RequestPhase::query) {
      execute_and_reply(id, typed);
    } else if (queries_.size() < kMaxQueries) {
      queries_.push_back({id, request});
    } else {
      loop_.reply({id, ControlResult::failed,
                   std::to_string(kMaxQueries) +
                       " questions are waiting already; at most one is answered before each step."});
    }
  };
  std::visit(execute_one, request);
}

void RequestExecutor::answer_query() {
  if (queries_.empty()) return;
  const RequestInbox::Request query = std::move(queries_.front());
  queries_.pop_front();
  std::visit([&](const auto& typed) { execute_and_reply(query.id, typed); }, query.request);
}

void RequestExecutor::refuse(std::uint64_t id) {
  loop_.reply({id, ControlResult::incorrect_state,
               "The simulation of this scenario has ended; the request was not executed."});
}

void RequestExecutor::refuse_queries() {
  for (const RequestInbox::Request& query : queries_) refuse(query.id);
  queries_.clear();
}

std::string RequestExecutor::report(const events::OfLoop& event) {
  const EventRecord record = loop_.record_of(event);
  loop_.emit(record);
  return describe(record, loop_.cell()).message;
}

Refusal RequestExecutor::faulted() const {
  return {ControlResult::incorrect_state,
          "The simulation has a fault and must be reset first: " + loop_.simulation.fault()};
}

Outcome<requests::GetState> RequestExecutor::execute(const requests::GetState&) {
  const Simulation& simulation = loop_.simulation;
  return {"The simulation is " + std::string(to_string(loop_.state)) + ".",
          {loop_.state, loop_.pace, loop_.factor, simulation.time_s(), simulation.step_index(),
           simulation.epoch(), simulation.state_hash(), loop_.faulted ? simulation.fault() : std::string()}};
}

Outcome<requests::SetState> RequestExecutor::execute(const requests::SetState& request) {
  const SimulationState before = loop_.state;
  switch (request.state) {
    case SimulationState::stopped:
      control_.reset();
      break;
    case SimulationState::playing:
      if (loop_.faulted) return faulted();
      control_.end_single_steps(
          {ControlResult::failed,
           "The remaining steps were not taken one by one: the simulation was set playing."});
      break;
    case SimulationState::paused:
      control_.end_single_steps(
          {ControlResult::failed, "The remaining steps were not taken: the simulation was paused."});
      break;
    case SimulationState::quitting:
      control_.quit();
      break;
    case SimulationState::no_scenario:
    case SimulationState::loading_scenario:
      break;  // not used by requests
  }
  control_.set_state(request.state);
  return {"The simulation is " + std::string(before == loop_.state ? "already " : "now ") +
              std::string(to_string(loop_.state)) + ".",
          {loop_.state, loop_.simulation.step_index(), loop_.simulation.epoch()}};
}

RequestExecutor::Answer<requests::Step> RequestExecutor::execute(const requests::Step& request) {
  if (loop_.faulted) return faulted();
  if (loop_.plays())
    return Refusal{ControlResult::incorrect_state,
                   "Single steps are possible only while the simulation is paused; it is playing."};
  if (control_.single_steps_left() > 0)
    return Refusal{ControlResult::incorrect_state, "An earlier step request is still being worked on; " +
                                                       std::to_string(control_.single_steps_left()) +
                                                       " steps are left."};
  control_.begin_single_steps(executing_, request.steps);
  return std::nullopt;
}

Outcome<requests::Reset> RequestExecutor::execute(const requests::Reset& request) {
  // The host exchanges a scenario with spawned Parts without the loop.
  constexpr int kSpawnedOnly = 4;
  if (request.scope == kSpawnedOnly)
    return {"Nothing was spawned or deleted.", {loop_.simulation.epoch(), {}}};
  control_.reset();
  return {"The cell is back in its initial state.", {loop_.simulation.epoch(), {}}};
}

Outcome<requests::SetPace> RequestExecutor::execute(const requests::SetPace& request) {
  const bool has_factor = request.pace == Pace::realtime;
  control_.set_pace(request.pace, has_factor ? request.factor : 1.0);
  std::string sentence = report(events::PaceChanged{loop_.pace, has_factor ? loop_.factor : 0.0});
  control_.status.publish();
  return {std::move(sentence), {loop_.pace, loop_.factor}};
}

Outcome<requests::RegisterController> RequestExecutor::execute(const requests::RegisterController& request) {
  const CellDescription& cell = loop_.cell();
  if (request.targets.empty() || request.period < cell.step_s)
    return Refusal{ControlResult::failed, "A controller has a target at least, and a period of " +
                                              std::to_string(cell.step_s) + " s, one step, or more."};
  ControllerRegistry& controllers = control_.barrier.controllers();
  std::string refusal = controllers.add(request, loop_.simulation.step_index(), cell);
  if (!refusal.empty()) return Refusal{ControlResult::failed, std::move(refusal)};
  for (const std::string& target : request.targets) control_.intake.drop(find_target(cell, target));
  control_.barrier.stop_waiting();
  const auto boundary_step = controllers.owner(find_target(cell, request.targets.front()))->boundary_step;
  return {report(events::ControllerRegistered{FixedString<128>(request.name), request.period}),
          {boundary_step, static_cast<double>(boundary_step) * cell.step_s, loop_.simulation.epoch()}};
}

Outcome<requests::UnregisterController> RequestExecutor::execute(
    const requests::UnregisterController& request) {
  if (!control_.barrier.controllers().remove(request.name))
    return Refusal{ControlResult::not_found, "There is no controller '" + request.name + "'."};
  control_.barrier.stop_waiting();
  return report(events::ControllerUnregistered{FixedString<128>(request.name)});
}

Outcome<requests::WatchInstants> RequestExecutor::execute(const requests::WatchInstants& request) {
  control_.watch(request);
  return {"In lockstep these instants are sent too.", {}};
}

Outcome<requests::ExplainPart> RequestExecutor::execute(const requests::ExplainPart& request) {
  return explanation(loop_.simulation.explain(component(request.part)), loop_.cell());
}

Outcome<requests::GetEntityState> RequestExecutor::execute(const requests::GetEntityState& request) {
  return entity_state(component(request.entity), loop_.simulation.make_snapshot(), loop_.cell());
}

}  // namespace takt

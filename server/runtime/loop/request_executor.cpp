#include "server/runtime/loop/request_executor.h"

#include <optional>
#include <string>
#include <utility>
#include <variant>

#include "server/runtime/requests/entity_requests.h"
#include "server/runtime/requests/explain_reply.h"

namespace takt {

/// One request, as a visitor of its kinds.
struct RequestExecutor::Execution {
  /// Nothing: the reply is out, or follows later.
  using Answer = std::optional<Outcome>;

  LoopControl& control;
  LoopContext& loop;
  std::deque<Query>& queries;
  std::uint64_t id;

  Answer operator()(const GetFeatures&) {
    loop.output.outbound->add_reply(features_reply(id));
    return std::nullopt;
  }

  Answer operator()(const GetEntities& request) {
    loop.output.outbound->add_reply(entities_reply(id, request, loop.cell()));
    return std::nullopt;
  }

  Answer operator()(const GetState&) {
    const Simulation& simulation = loop.simulation;
    return Outcome{ControlResult::ok,
                   "The simulation is " + std::string(to_string(loop.state)) + ".",
                   {{"state", std::to_string(static_cast<int>(loop.state))},
                    {"state_name", std::string(to_string(loop.state))},
                    {"pace", std::string(to_string(loop.pace))},
                    {"factor", exact_text(loop.factor)},
                    {"time", exact_text(simulation.time_s())},
                    {"step", std::to_string(simulation.step_index())},
                    {"epoch", std::to_string(simulation.epoch())},
                    {"state_hash", std::to_string(simulation.state_hash())},
                    {"fault", loop.faulted ? simulation.fault() : std::string()}}};
  }

  Answer operator()(const SetState& request) {
    const SimulationState before = loop.state;
    switch (request.state) {
      case SimulationState::stopped:
        control.reset();
        break;
      case SimulationState::playing:
        if (loop.faulted) return faulted();
        control.end_single_steps(
            ControlResult::failed,
            "The remaining steps were not taken one by one: the simulation was set playing.");
        break;
      case SimulationState::paused:
        control.end_single_steps(ControlResult::failed,
                                 "The remaining steps were not taken: the simulation was paused.");
        break;
      case SimulationState::quitting:
        control.quit();
        break;
      case SimulationState::no_world:
      case SimulationState::loading_world:
        break;  // none that a request may ask for
    }
    control.set_state(request.state);
    return Outcome{ControlResult::ok,
                   "The simulation is " + std::string(before == loop.state ? "already " : "now ") +
                       std::string(to_string(loop.state)) + ".",
                   {{"state", std::to_string(static_cast<int>(loop.state))}}};
  }

  Answer operator()(const Step& request) {
    if (loop.faulted) return faulted();
    if (loop.plays())
      return Outcome{ControlResult::incorrect_state,
                     "Single steps are possible only while the simulation is paused; it is playing."};
    if (control.single_steps_left() > 0)
      return Outcome{ControlResult::incorrect_state, "An earlier step request is still being worked on; " +
                                                         std::to_string(control.single_steps_left()) +
                                                         " steps are left."};
    control.begin_single_steps(id, request.steps);
    return std::nullopt;
  }

  Answer operator()(const Reset& request) {
    // A scenario with something spawned is exchanged by the host, which does not ask the loop.
    if (request.spawned_only) return Outcome{ControlResult::ok, "Nothing was spawned or deleted."};
    control.reset();
    return Outcome{ControlResult::ok,
                   "The cell is back in its initial state.",
                   {{"epoch", std::to_string(loop.simulation.epoch())}}};
  }

  Answer operator()(const SetPace& request) {
    control.set_pace(request.pace, request.pace == Pace::realtime ? request.factor : 1.0);
    EventRecord changed = loop.event(EventCode::pace_changed, Severity::information);
    changed.a = static_cast<int>(loop.pace);
    changed.x = loop.factor;
    Outcome outcome =
        done(changed, {{"pace", std::string(to_string(loop.pace))}, {"factor", exact_text(loop.factor)}});
    control.status.publish();
    return outcome;
  }

  Answer operator()(const RegisterController& request) {
    ControllerRegistry& controllers = control.barrier.controllers();
    std::string refusal = controllers.add(request, loop.simulation.step_index(), loop.cell());
    if (!refusal.empty()) return Outcome{ControlResult::failed, std::move(refusal)};
    for (const int target : request.targets) control.intake.drop(target);
    control.barrier.stop_waiting();
    EventRecord registered = loop.event(EventCode::controller_registered, Severity::information);
    registered.text.assign(request.name);
    registered.x = request.period_s;
    const auto boundary_step = controllers.owner(request.targets.front())->boundary_step;
    return done(registered,
                {{"next_boundary_step", std::to_string(boundary_step)},
                 {"next_boundary_time", exact_text(static_cast<double>(boundary_step) * loop.cell().step_s)},
                 {"epoch", std::to_string(loop.simulation.epoch())}});
  }

  Answer operator()(const UnregisterController& request) {
    if (!control.barrier.controllers().remove(request.name))
      return Outcome{ControlResult::not_found, "There is no controller '" + request.name + "'."};
    control.barrier.stop_waiting();
    EventRecord removed = loop.event(EventCode::controller_unregistered, Severity::information);
    removed.text.assign(request.name);
    return done(removed);
  }

  Answer operator()(const SetLevelOfDetail& request) {
    const std::string reason = loop.simulation.set_level_of_detail(request.process, request.level);
    if (!reason.empty())
      return Outcome{ControlResult::failed, "The level of detail stays as it is: " + reason};
    loop.record(LogLevelOfDetail{request.process, request.level});
    EventRecord changed = loop.event(EventCode::level_of_detail_changed, Severity::information);
    changed.a = request.process;
    changed.b = request.level;
    loop.emit(changed);
    control.publish_instant();
    control.status.publish();
    const std::string process = request.process < 0
                                    ? "all processes"
                                    : loop.cell().processes[static_cast<std::size_t>(request.process)].name;
    const std::string level = std::to_string(request.level);
    return Outcome{ControlResult::ok,
                   "The level of detail of " + process + " is now " + level + ".",
                   {{"level", level}}};
  }

  Answer operator()(const ExplainPart& request) { return queue({id, request.component, true}); }

  Answer operator()(const GetEntityState& request) { return queue({id, request.component, false}); }

  Answer operator()(const SetEntityState& request) {
    if (loop.plays() || control.single_steps_left() > 0)
      return Outcome{ControlResult::incorrect_state,
                     "A Part can be put elsewhere only while the simulation is paused or stopped."};
    Simulation& simulation = loop.simulation;
    const ComponentSample now =
        simulation.make_snapshot().components[static_cast<std::size_t>(request.component)];
    const Pose X_WB{request.R_WB.value_or(now.q_WB.toRotationMatrix()), request.p_WB.value_or(now.p_WB)};
    const Twist V_WB{request.linear_velocity.value_or(now.V_WB.v),
                     request.angular_velocity.value_or(now.V_WB.w)};
    const std::string refusal = simulation.set_component_state(request.component, X_WB, V_WB);
    if (!refusal.empty()) return Outcome{ControlResult::failed, "It stays where it is: " + refusal};
    loop.record(LogEntityState{request.component, X_WB, V_WB});
    EventRecord set = loop.event(EventCode::entity_state_set, Severity::information);
    set.a = request.component;
    set.position_W = X_WB.p;
    Outcome outcome = done(set);
    control.publish_instant();
    return outcome;
  }

  Answer operator()(const Attach& request) {
    const std::string refusal = loop.simulation.attach(request.part, request.to);
    if (!refusal.empty()) return Outcome{ControlResult::failed, "It was not attached: " + refusal};
    loop.record(LogAttach{request.part, request.to});
    EventRecord attached = loop.event(EventCode::attached, Severity::information);
    attached.a = request.part;
    attached.b = request.to;
    return done(attached);
  }

  Answer operator()(const Detach& request) {
    const std::string refusal = loop.simulation.detach(request.part);
    if (!refusal.empty()) return Outcome{ControlResult::failed, "It was not detached: " + refusal};
    loop.record(LogDetach{request.part});
    EventRecord detached = loop.event(EventCode::detached, Severity::information);
    detached.a = request.part;
    return done(detached);
  }

  Answer queue(const Query& query) {
    constexpr std::size_t kMaxQueries = 64;
    if (queries.size() >= kMaxQueries)
      return Outcome{ControlResult::failed,
                     std::to_string(kMaxQueries) +
                         " questions are waiting already; at most one is answered before each step."};
    queries.push_back(query);
    return std::nullopt;
  }
  /// Emits the event; its sentence is the reply.
  Outcome done(const EventRecord& event, TextArguments values = {}) {
    loop.emit(event);
    return {ControlResult::ok, describe(event, loop.cell()).message, std::move(values)};
  }
  Outcome faulted() const {
    return {ControlResult::incorrect_state,
            "The simulation has a fault and must be reset first: " + loop.simulation.fault()};
  }
};

void RequestExecutor::execute(const RequestInbox::Request& request) {
  auto answer = std::visit(Execution{control_, control_.context, queries_, request.id}, request.action);
  if (answer) control_.context.output.outbound->add_reply(request.id, *std::move(answer));
}

void RequestExecutor::answer_query() {
  if (queries_.empty()) return;
  LoopContext& loop = control_.context;
  const Query query = queries_.front();
  queries_.pop_front();
  const Simulation& simulation = loop.simulation;
  loop.output.outbound->add_reply(
      query.explains
          ? explanation_reply(query.id, simulation.explain(query.component), loop.cell())
          : entity_state_reply(query.id, query.component, simulation.make_snapshot(), loop.cell()));
}

void RequestExecutor::refuse(std::uint64_t id) {
  control_.context.output.outbound->add_reply(
      id, {ControlResult::incorrect_state,
           "The simulation of this scenario has ended; the request was not executed."});
}

void RequestExecutor::refuse_queries() {
  for (const Query& query : queries_) refuse(query.id);
  queries_.clear();
}

}  // namespace takt

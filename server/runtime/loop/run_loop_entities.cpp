// Requests that take hold of a Part.
#include "server/runtime/loop/run_loop.h"
#include "server/runtime/recording/log_recorder.h"

namespace takt {

void RunLoop::execute(std::uint64_t id, const SetEntityState& action) {
  if (state_ == SimulationState::playing || single_steps_left_ > 0) {
    reply(id, ControlResult::incorrect_state,
          "A Part can be put elsewhere only while the simulation is paused or stopped.");
    return;
  }
  const auto index = static_cast<std::size_t>(action.component);
  const ComponentSample now = simulation_.make_snapshot().components[index];
  const Pose X_WB{action.R_WB.value_or(now.q_WB.toRotationMatrix()), action.p_WB.value_or(now.p_WB)};
  const Twist V_WB{action.linear_velocity.value_or(now.V_WB.v), action.angular_velocity.value_or(now.V_WB.w)};
  const std::string refusal = simulation_.set_component_state(action.component, X_WB, V_WB);
  if (!refusal.empty()) {
    reply(id, ControlResult::failed, "It stays where it is: " + refusal);
    return;
  }
  if (recorder_ != nullptr) recorder_->entity_state(simulation_, action.component, X_WB, V_WB);
  EventRecord set = event(EventCode::entity_state_set, Severity::information);
  set.a = action.component;
  set.position_W = X_WB.p;
  emit(set);
  publish_instant();
  reply(id, ControlResult::ok, describe(set, cell()).message);
}

void RunLoop::execute(std::uint64_t id, const Attach& action) {
  const std::string refusal = simulation_.attach(action.part, action.to);
  if (!refusal.empty()) {
    reply(id, ControlResult::failed, "It was not attached: " + refusal);
    return;
  }
  if (recorder_ != nullptr) recorder_->attach(simulation_, action.part, action.to);
  EventRecord attached = event(EventCode::attached, Severity::information);
  attached.a = action.part;
  attached.b = action.to;
  emit(attached);
  reply(id, ControlResult::ok, describe(attached, cell()).message);
}

void RunLoop::execute(std::uint64_t id, const Detach& action) {
  const std::string refusal = simulation_.detach(action.part);
  if (!refusal.empty()) {
    reply(id, ControlResult::failed, "It was not detached: " + refusal);
    return;
  }
  if (recorder_ != nullptr) recorder_->detach(simulation_, action.part);
  EventRecord detached = event(EventCode::detached, Severity::information);
  detached.a = action.part;
  emit(detached);
  reply(id, ControlResult::ok, describe(detached, cell()).message);
}

}  // namespace takt

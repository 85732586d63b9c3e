#include "server/runtime/requests/bit_changes.h"

#include "server/simulation/step/simulation.h"

namespace takt {
namespace {

Vec3 vec3(const takt_msgs::msg::Vector3& v) {
  return {v.x, v.y, v.z};
}

/// `reason`: of the simulation; empty: the change is made.
BitChange changed(const std::string& reason, const char* refused, const events::OfLoop& event) {
  if (reason.empty()) return event;
  return refused + (": " + reason);
}

}  // namespace

BitChange apply(const requests::SetLevelOfDetail& request, Simulation& simulation) {
  const int process = simulation.description().find_process(request.process);
  return changed(simulation.set_level_of_detail(process, request.level_of_detail),
                 "The level of detail stays as it is",
                 events::LevelOfDetailChanged{process, request.level_of_detail});
}

BitChange apply(const requests::SetEntityState& request, Simulation& simulation) {
  if (!request.position && !request.orientation && !request.linear_velocity && !request.angular_velocity)
    return "It stays where it is: a position, an orientation, a linear_velocity or an angular_velocity is "
           "needed.";
  const int part = simulation.description().find_component(request.entity);
  const ComponentSample now = simulation.make_snapshot().components[static_cast<std::size_t>(part)];
  Pose X_WB{now.q_WB.toRotationMatrix(), now.p_WB};
  Twist V_WB{now.V_WB};
  if (request.position) X_WB.p = vec3(*request.position);
  if (const auto& q = request.orientation)
    X_WB.R = Quat(q->w, q->x, q->y, q->z).normalized().toRotationMatrix();
  if (request.linear_velocity) V_WB.v = vec3(*request.linear_velocity);
  if (request.angular_velocity) V_WB.w = vec3(*request.angular_velocity);
  return changed(simulation.set_component_state(part, X_WB, V_WB), "It stays where it is",
                 events::EntityStateSet{part, {X_WB.p.x(), X_WB.p.y(), X_WB.p.z()}});
}

BitChange apply(const requests::Attach& request, Simulation& simulation) {
  const CellDescription& cell = simulation.description();
  const int part = cell.find_component(request.part), to = cell.find_component(request.to);
  return changed(simulation.attach(part, to), "It was not attached", events::Attached{part, to});
}

BitChange apply(const requests::Detach& request, Simulation& simulation) {
  const int part = simulation.description().find_component(request.part);
  return changed(simulation.detach(part), "It was not detached", events::Detached{part});
}

namespace {
std::string no_signal(const std::string& name, const CellDescription& cell) {
  return "There is no signal '" + name + "'; allowed: " + signals_there(cell, name) + ".";
}

/// The wire that keeps commands from this input: its own, of a gripper that of either input.
const SignalWire* wire_to_owner(const CellDescription& cell, SignalRef ref) {
  if (signal_owner(cell, ref.device).kind != SignalOwnerKind::gripper) return wire_to(cell, ref);
  const SignalWire* wire = wire_to(cell, {ref.device, static_cast<int>(GripperSignal::close)});
  return wire != nullptr ? wire : wire_to(cell, {ref.device, static_cast<int>(GripperSignal::set_width)});
}
}  // namespace

BitChange apply(const requests::ForceSignal& request, Simulation& simulation) {
  const CellDescription& cell = simulation.description();
  const auto ref = find_signal(cell, request.signal);
  if (!ref) return no_signal(request.signal, cell);
  if (std::string why = wrong_value(describe_signal(cell, *ref), request.value); !why.empty())
    return "It was not forced: the value of " + request.signal + " " + why + ".";
  return changed(simulation.force_signal(*ref, request.value), "It was not forced",
                 events::SignalForced{FixedString<256>(request.signal), request.value});
}

BitChange apply(const requests::ReleaseSignal& request, Simulation& simulation) {
  const CellDescription& cell = simulation.description();
  const events::SignalReleased done{FixedString<256>(request.signal)};
  if (request.signal == "all") {
    while (!simulation.forced_signals().empty())
      if (std::string why = simulation.release_signal(simulation.forced_signals().front().ref); !why.empty())
        return "It was not released: " + why;
    return done;
  }
  const auto ref = find_signal(cell, request.signal);
  if (!ref) return no_signal(request.signal, cell);
  return changed(simulation.release_signal(*ref), "It was not released", done);
}

BitChange apply(const requests::SetInputs& request, Simulation& simulation) {
  const CellDescription& cell = simulation.description();
  if (request.inputs.empty() || request.inputs.size() != request.values.size())
    return "No input was set: " + std::to_string(request.inputs.size()) + " inputs and " +
           std::to_string(request.values.size()) + " values; one value is needed for each input.";
  std::vector<InputValue> values;
  for (std::size_t i = 0; i < request.inputs.size(); ++i) {
    const auto ref = find_signal(cell, request.inputs[i]);
    if (!ref) return no_signal(request.inputs[i], cell);
    const SignalDescription signal = describe_signal(cell, *ref);
    if (!signal.commanded)
      return "No input was set: " + request.inputs[i] + " is an output; force_signal gives it a value.";
    if (const SignalWire* wire = wire_to_owner(cell, *ref))
      return "No input was set: " + signal_name(cell, wire->to) + " is wired to '" + wire->text +
             "'; force_signal gives it a value.";
    if (std::string why = wrong_value(signal, request.values[i]); !why.empty())
      return "No input was set: the value of " + request.inputs[i] + " " + why + ".";
    values.push_back({*ref, request.values[i]});
  }
  if (std::string why = simulation.set_inputs(values); !why.empty()) return "No input was set: " + why + ".";
  return QuietChange{counted(values.size(), "input is set.", "inputs are set.")};
}

}  // namespace takt

#include "server/devices/safety.h"

#include <algorithm>

#include "plant_models/state_bytes.h"
#include "server/simulation/step/cell_plant.h"

namespace takt {

namespace {
constexpr KindSignal kSignals[] = {
    commanded_flag("emergency_stop", "1 stops all motion"),
    commanded_flag("door_closed", "0 stops all motion"),
    commanded_flag("reset", "the change from 0 to 1 releases a cell that has no cause to stand"),
    commanded("speed_override", "%", 0.0, 100.0, "wanted share of the speed of all motion"),
    reported_flag("released", "motion is allowed"),
    reported("speed", "%",
             "present share of the speed, which follows `speed_override` in `override_ramp_s`")};
}  // namespace

void describe(Fields& f, ScenarioSafety& s) {
  f.field("override_ramp_s", s.override_ramp_s, positive("s"),
          "Time in which the speed override changes from 0 to 100 %, and as fast in parts of it.");
}

void build(const ScenarioSafety& s, DeviceBuilder& b) {
  Safety::Device device;
  device.override_ramp_s = s.override_ramp_s;
  device.device = b.add_signal_table(device, described(kSignals), {0.0, 1.0, 0.0, 100.0, 1.0, 100.0});
  b.mechanism<Safety>().devices.push_back(device);
}

DeviceType safety_type() {
  return device_type<ScenarioSafety>(DeviceType::Owner::cell, "safety", "Safety of the cell.",
                                     "Emergency stop, safety door and speed override.", false, kSignals);
}

void Safety::start(ComponentInteraction&) {
  states_.assign(states_.size(), {});
  notices_.clear();
}

void Safety::begin_step(StepControl& control) {
  notices_.clear();
  for (std::size_t i = 0; i < states_.size(); ++i) {
    State& state = states_[i];
    const Device& device = model_.devices[i];
    SignalTable& signals = signal_table(control.plant(), device.device);
    const bool cause = signals.value(emergency_stop) != 0.0 || signals.value(door_closed) == 0.0;
    const bool asked = signals.value(reset) != 0.0;
    const bool stops = cause || (state.stopped && (!asked || state.reset));
    if (stops != state.stopped) {
      DeviceNotice notice;
      notice.kind = stops ? DeviceNotice::Kind::motion_stopped : DeviceNotice::Kind::motion_released;
      notice.device = device.device;
      notices_.push_back(notice);
    }
    state.stopped = stops;
    state.reset = asked;
    const double most = control.step_s() / device.override_ramp_s;
    state.share += std::clamp(0.01 * signals.value(speed_override) - state.share, -most, most);
    signals.report(released, stops ? 0.0 : 1.0);
    signals.report(speed, 100.0 * state.share);
  }
  loaded(control.plant());
}

void Safety::loaded(CellPlant& plant) const {
  bool allowed = true;
  double share = 1.0;
  for (const State& state : states_) {
    allowed = allowed && !state.stopped;
    share = std::min(share, state.share);
  }
  plant.allow_motion(allowed);
  plant.set_speed_override(share);
}

void Safety::save(StateWriter& out) const {
  for (const State& state : states_) out.put(state.stopped), out.put(state.reset), out.put(state.share);
}

void Safety::load(StateReader& in) {
  notices_.clear();
  for (State& state : states_) {
    state.stopped = in.flag("'stopped'");
    state.reset = in.flag("'reset'");
    state.share = in.number(0.0, 1.0, "the speed override");
  }
}

}  // namespace takt

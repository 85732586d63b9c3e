#include "server/devices/signal_sensors.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "server/contact/holding/component_interaction.h"
#include "server/simulation/model/signals.h"
#include "server/simulation/step/cell_plant.h"

namespace takt {

namespace {

using Kind = SignalSensorParameters::Kind;

constexpr KindSignal kLimitSwitchSignals[] = {
    reported_flag("active", "the joint is beyond `position_rad`, after hysteresis and delays")};
constexpr KindSignal kForceSwitchSignals[] = {
    reported("force", "N | N m", "amount of the force or torque, with lag and noise"),
    reported_flag("reached", "`force` is beyond the threshold, after hysteresis and delays")};
constexpr KindSignal kTemperatureSignals[] = {
    reported("temperature", "degC", "of the part or furnace, with lag and noise"),
    reported_flag("reached", "`temperature` is at least `switch_degC`, after hysteresis and delays")};
constexpr KindSignal kPresenceSignals[] = {
    reported_flag("part_present", "`holder` holds a part, after the delays"),
    reported_count("part", "index of the first held part among the components, or -1")};

/// Adds the sensor; its source is found when all devices are built.
void add(const SignalSensorParameters& p, const std::string& place, std::vector<SignalDescription> signals,
         const std::vector<double>& initial, DeviceBuilder& b) {
  auto& model = b.mechanism<SignalSensors>();
  if (model.parts.empty())
    for (std::size_t c = 0; c < b.cell.components.size(); ++c)
      if (b.cell.components[c].type == ComponentType::part) model.parts.push_back(static_cast<int>(c));
  const int device = b.add_signal_table(p, std::move(signals), initial);
  model.sensors.push_back({p, device, {}});
  if (p.kind != Kind::signal) return;
  CellModel& cell = b.cell;
  b.when_built.emplace_back([&model, &cell, place, i = model.sensors.size() - 1] {
    const std::string& source = model.sensors[i].parameters.source;
    const auto found = find_signal(cell.description, source);
    if (!found)
      throw ScenarioError(place + ": found '" + source +
                          "'; allowed: " + signals_there(cell.description, source));
    model.sensors[i].source = *found;
  });
}

void describe_side(Fields& f, SwitchParameters& output) {
  const Choice<bool> sides{{{"above", false}, {"below", true}}};
  f.field("side", output.below, sides, "On which side of that value it is on.");
}

}  // namespace

void describe(Fields& f, ScenarioLimitSwitch& s) {
  f.field("robot", s.robot, f.name_of({"robots"}, "a robot"), "Robot or other machine with joints.",
          kRequired);
  f.field("joint", s.joint, Text{}, "Name of the joint.", kRequired);
  s.place_of_joint = f.place("joint");
  f.field("position_rad", s.output.threshold, NumberRange{.unit = "rad, m of prismatic joints"},
          "Position where it switches.", kRequired);
  describe_side(f, s.output);
  f.field("hysteresis_rad", s.output.hysteresis, not_negative("rad, m of prismatic joints"),
          "Way back until it goes off again.");
  describe_delays(f, s.output);
}

void build(const ScenarioLimitSwitch& s, DeviceBuilder& b) {
  SignalSensorParameters p;
  p.source = s.robot + "." + s.joint;
  p.output = s.output;
  add(p, s.place_of_joint, described(kLimitSwitchSignals), {0.0}, b);
}

DeviceType limit_switch_type() {
  return device_type<ScenarioLimitSwitch>(
      DeviceType::Owner::cell, "limit_switches", "Limit switches of joints.",
      "On while a joint is beyond a position.", false, kLimitSwitchSignals);
}

void describe(Fields& f, ScenarioForceSwitch& s) {
  f.field("signal", s.signal.name, Text{},
          "A force or torque, e.g. Gripper1.force, or force_z of a force-torque sensor; its amount counts.");
  s.signal.place = f.place("signal");
  f.field("component", s.component, f.name_of({"parts", "grounds"}, "a part or ground"),
          "Component whose contact force is measured: the amount of the resultant, without weight.");
  f.alternatives({"signal", "component"}, 1, 1, "", "both or neither of signal and component", "one of them");
  f.field("threshold_N", s.output.threshold, positive("N, N m of torques"),
          "Force or torque where it switches.", kRequired);
  f.field("hysteresis_N", s.output.hysteresis, not_negative("N, N m of torques"),
          "Below threshold - hysteresis it goes off.");
  describe(f, s.measuring, {"N, N m of torques", "noise_N", "resolution_N"});
  describe_delays(f, s.output);
}

void build(const ScenarioForceSwitch& s, DeviceBuilder& b) {
  SignalSensorParameters p;
  p.kind = s.component.empty() ? Kind::signal : Kind::contact_force;
  p.source = s.signal.name;
  p.component = b.cell.description.find_component(s.component);
  p.absolute = p.has_value = true;
  p.measuring = s.measuring;
  p.output = s.output;
  add(p, s.signal.place, described(kForceSwitchSignals), {0.0, 0.0}, b);
}

DeviceType force_switch_type() {
  return device_type<ScenarioForceSwitch>(DeviceType::Owner::cell, "force_switches", "Force switches.",
                                          "On while a force is beyond a threshold.", false,
                                          kForceSwitchSignals);
}

void describe(Fields& f, ScenarioTemperatureSensor& s) {
  f.field("of", s.of, Text{},
          "A part with `heat`, or another device with a signal `temperature`, e.g. a furnace.", kRequired);
  s.place_of_of = f.place("of");
  describe(f, s.measuring, {"K", "noise_K", "resolution_K"});
  f.field("switch_degC", s.switch_degC, kTemperature_degC,
          "`reached` is on from this temperature on; without it: it is always off.");
  f.field("hysteresis_K", s.output.hysteresis, not_negative("K"),
          "Colder by more than that it goes off again.");
  describe_delays(f, s.output);
}

void build(const ScenarioTemperatureSensor& s, DeviceBuilder& b) {
  SignalSensorParameters p;
  const bool part = b.cell.description.find_component(s.of) >= 0;
  p.source = (part ? part_device_name(s.of, device_type("heat")) : s.of) + ".temperature";
  p.has_value = true;
  p.measuring = s.measuring;
  p.switches = s.switch_degC.has_value();
  p.output = s.output;
  p.output.threshold = s.switch_degC.value_or(0.0);
  add(p, s.place_of_of, described(kTemperatureSignals), {0.0, 0.0}, b);
}

DeviceType temperature_sensor_type() {
  return device_type<ScenarioTemperatureSensor>(
      DeviceType::Owner::cell, "temperature_sensors", "Temperature sensors.",
      "Temperature of a part or furnace, with lag and noise.", false, kTemperatureSignals);
}

void describe(Fields& f, ScenarioPresenceSensor& s) {
  f.field("holder", s.holder, f.name_of({"parts", "grounds", "grippers"}, "a part, ground or gripper"),
          "What the part is held by: a gripper, or a ground or part that serves as fixture.", kRequired);
  describe_delays(f, s.output);
}

void build(const ScenarioPresenceSensor& s, DeviceBuilder& b) {
  SignalSensorParameters p;
  p.kind = Kind::held;
  p.component = b.cell.description.find_component(s.holder);
  p.output = s.output;
  add(p, "", described(kPresenceSignals), {0.0, -1.0}, b);
}

DeviceType presence_sensor_type() {
  return device_type<ScenarioPresenceSensor>(
      DeviceType::Owner::cell, "presence_sensors", "Sensors for a held part.",
      "On while a gripper, ground or part is the holder of a part, as `held by` of a state says.", false,
      kPresenceSignals);
}

SignalSensors::SignalSensors(const Model& model) : model_(model) {
  for (const Entry& entry : model.sensors)
    sensors_.push_back(
        {MeasuringFilter(entry.parameters.measuring), SwitchFilter(entry.parameters.output), -1});
}

void SignalSensors::start(ComponentInteraction&) {
  for (Sensor& sensor : sensors_) {
    sensor.measuring.reset();
    sensor.output.reset();
    sensor.held = -1;
  }
  all_ = true;
  starting_ = true;
}

bool SignalSensors::update(double h, const CellMotion&, CellPlant& plant, ComponentInteraction& interaction) {
  if (std::exchange(starting_, false)) return false;
  const bool holders = all_ || !interaction.changes().empty();
  for (std::size_t i = 0; i < sensors_.size(); ++i) {
    const auto& [p, device, source] = model_.sensors[i];
    Sensor& sensor = sensors_[i];
    SignalTable& signals = signal_table(plant, device);
    if (p.kind == Kind::held) {
      if (holders) {
        const auto found =
            std::find_if(model_.parts.begin(), model_.parts.end(),
                         [&, c = p.component](int id) { return interaction.partner(id) == c; });
        sensor.held = found == model_.parts.end() ? -1 : *found;
      }
      const bool on = sensor.output.sample_flag(sensor.held >= 0, h);
      signals.report(part_present, on ? 1.0 : 0.0);
      signals.report(part, on ? sensor.held : -1.0);
      continue;
    }
    double value = p.kind == Kind::signal
                       ? plant.signal_value(source)
                       : plant.system().update_wrenches()[static_cast<std::size_t>(p.component)].f.norm();
    if (p.absolute) value = std::abs(value);
    value = sensor.measuring.sample(value, h);
    const bool on = p.switches && sensor.output.sample(value, h);
    if (p.has_value) signals.report(measured, value);
    signals.report(p.has_value ? static_cast<int>(reached) : static_cast<int>(active), on ? 1.0 : 0.0);
  }
  all_ = false;
  return false;
}

void SignalSensors::save(StateWriter& out) const {
  for (const Sensor& sensor : sensors_) {
    sensor.measuring.save(out);
    sensor.output.save(out);
  }
  out.put(starting_);
}

void SignalSensors::load(StateReader& in) {
  for (Sensor& sensor : sensors_) {
    sensor.measuring.load(in);
    sensor.output.load(in);
  }
  starting_ = in.flag("'sensors start'");
  all_ = true;
}

}  // namespace takt

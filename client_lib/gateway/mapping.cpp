#include "client_lib/gateway/mapping.h"

#include <algorithm>

namespace takt::gateway {
namespace {

template <class List>
std::vector<std::string> names_of(const List& list) {
  std::vector<std::string> names;
  for (const auto& one : list) names.push_back(one.name);
  return names;
}

const Choice<TimeReference> kTimes{{{"wall", TimeReference::wall}, {"simulated", TimeReference::simulated}}};
const Choice<OnJump> kJumps{{{"ramp", OnJump::ramp}, {"refuse", OnJump::refuse}}};
const Choice<bool> kGripperOutputs{{{"switch", false}, {"width", true}}};
using Measure = InputMapping::Measure;
const Choice<Measure> kMeasures{{{"closed", Measure::closed},
                                 {"holding", Measure::holding},
                                 {"in_position", Measure::in_position},
                                 {"moving", Measure::moving},
                                 {"width", Measure::width},
                                 {"force", Measure::force}}};

/// Of a mapping of the cell: gripper, or device and signal.
template <class Element>
void describe_place(Fields& f, Element& e, const CellInfo& cell, bool commanded,
                    const std::vector<std::string>& others = {}) {
  f.field("gripper", e.gripper, NameOf{names_of(cell.grippers), "a gripper of the cell"}, "The gripper.");
  f.field("device", e.device, NameOf{names_of(cell.devices), "a device of the cell"},
          "The device, with its signal.");
  f.together("device", "signal");
  std::vector<std::string> places{"gripper", "device"};
  std::string allowed = "gripper, or device and signal";
  for (const std::string& other : others) {
    places.push_back(other);
    allowed += ", or " + other;
  }
  f.alternatives(places, 1, 1, "", "", allowed);
  std::vector<std::string> signals;
  if (const int device = e.device.empty() ? -1 : cell.find_device(e.device); device >= 0)
    for (const auto& signal : cell.devices[static_cast<std::size_t>(device)].signals)
      if (signal.commanded || !commanded) signals.push_back(signal.name);
  f.field(
      "signal", e.signal,
      NameOf{signals, commanded ? "a signal of the device that can be commanded" : "a signal of the device"},
      "The signal.");
  f.field("inverted", e.inverted, Flag{}, "Of a digital element: 1 means the opposite.");
  f.field("scale", e.scale, NumberRange{}, "Of a number: value in the cell = scale * element + offset.");
  f.field("offset", e.offset, NumberRange{}, "Of a number.");
}

template <class Element, class Describe>
void describe_elements(Fields& f, const char* key, std::vector<Element>& elements, const char* doc,
                       const IsElement& is_element, const char* allowed, const Describe& describe_element) {
  f.entries(
      key, elements, doc, "An element of the protocol.", 0, [] { return Element{}; },
      [&](Element& element) {
        if (f.reading() && !is_element(element.name)) f.fail("", "'" + element.name + "'", allowed);
        describe_element(element);
      });
}

}  // namespace

std::vector<double> RobotMapping::to_protocol(std::span<const double> cell_positions) const {
  std::vector<double> values(index.size());
  for (std::size_t i = 0; i < index.size(); ++i) values[i] = sign[i] * cell_positions[index[i]] + offset[i];
  return values;
}

std::vector<double> RobotMapping::to_cell(std::span<const double> protocol_positions) const {
  std::vector<double> values(index.size());
  for (std::size_t i = 0; i < index.size(); ++i)
    values[index[i]] = (protocol_positions[i] - offset[i]) / sign[i];
  return values;
}

std::vector<double> RobotMapping::rates_to_protocol(std::span<const double> cell_rates) const {
  std::vector<double> values(index.size(), 0.0);
  if (!cell_rates.empty())
    for (std::size_t i = 0; i < index.size(); ++i) values[i] = sign[i] * cell_rates[index[i]];
  return values;
}

std::vector<double> RobotMapping::rates_to_cell(std::span<const double> protocol_rates) const {
  std::vector<double> values(index.size());
  for (std::size_t i = 0; i < index.size(); ++i) values[index[i]] = protocol_rates[i] / sign[i];
  return values;
}

void describe_robot(Fields& f, RobotMapping& m, const CellInfo& cell, std::size_t count) {
  f.field("robot", m.robot, NameOf{names_of(cell.robots), "a robot of the cell"},
          "The robot that is controlled.", kRequired);
  std::vector<std::string> joints;
  if (const int robot = f.reading() ? cell.find_robot(m.robot) : -1; robot >= 0)
    joints = names_of(cell.robots[static_cast<std::size_t>(robot)].joints);
  f.check(count == 0 || joints.size() == count, "robot", std::to_string(joints.size()) + " joints",
          "a robot with " + std::to_string(count) + " joints");
  f.section("joints", "How the protocol's joints belong to those of the robot.", [&] {
    f.field("order", m.order,
            ListOf<NameOf>{{joints, "a joint of the robot"}, "a list of the robot's joints"},
            "The robot's joints in the order of the protocol; without it they have the same order.");
    f.field("sign", m.sign, Numbers{joints.size(), {.lower = -1.0, .upper = 1.0}},
            "1 or -1 for each joint of the protocol: its direction against the robot's.");
    f.field("offset", m.offset, Numbers{joints.size(), {.unit = "rad | m"}},
            "Of each joint of the protocol: its position where the robot's is 0.");
    if (!f.reading()) return;
    if (m.order.empty()) m.order = joints;
    if (m.sign.empty()) m.sign.assign(joints.size(), 1.0);
    if (m.offset.empty()) m.offset.assign(joints.size(), 0.0);
    f.check(std::all_of(m.sign.begin(), m.sign.end(), [](double s) { return s == 1.0 || s == -1.0; }), "sign",
            "another number", "1 or -1 for each joint");
    std::vector<std::string> sorted = m.order, wanted = joints;
    std::sort(sorted.begin(), sorted.end());
    std::sort(wanted.begin(), wanted.end());
    f.check(sorted == wanted, "order", std::to_string(m.order.size()) + " names",
            "each of the robot's " + std::to_string(joints.size()) + " joints once");
    m.index.clear();
    for (const std::string& name : m.order)
      m.index.push_back(
          static_cast<std::size_t>(std::find(joints.begin(), joints.end(), name) - joints.begin()));
  });
}

void describe_silence(Fields& f, SilenceMapping& m) {
  f.section("silence", "What happens when the controller sends nothing.", [&] {
    f.field("deadline_s", m.deadline_s, positive("s"), "Longest time between two commands.");
    f.field("action", m.action, choice_of<SafeAction>(),
            "hold: the robot keeps its last set-point; stop: it brakes.");
  });
}

void describe_resynchronisation(Fields& f, ResynchronisationOptions& m) {
  f.section("first_command", "The first command of a controller that connects.", [&] {
    f.field("on_jump", m.on_jump, kJumps,
            "ramp: the robot is led to the commanded positions; refuse: commands far from the robot are "
            "refused.");
    f.field("nearness_rad", m.nearness, positive("rad | m"),
            "Largest difference of one joint that is not refused.");
    f.field("ramp_speed_rad_per_s", m.ramp_speed, positive("rad/s | m/s"),
            "Speed at which a difference is removed.");
  });
}

void describe_time(Fields& f, TimeReference& m) {
  f.field("time", m, kTimes,
          "The time of deadlines and of the controller's cycle: wall, or the cell's simulated time.");
}

void describe_filter(Fields& f, double& filter_rad_per_s) {
  f.field("filter_rad_per_s", filter_rad_per_s, NumberRange{.lower = 0.0, .upper = 1000.0, .unit = "rad/s"},
          "Bandwidth of the filter that samples set-points for the steps of the cell; 0: each is sent as it "
          "comes. In lockstep there is no filter.");
}

void describe_output(Fields& f, OutputMapping& output, const CellInfo& cell,
                     const std::vector<std::string>& others) {
  describe_place(f, output, cell, true, others);
  f.field("as", output.sets_width, kGripperOutputs,
          "Of a gripper: switch: 1 closes and 0 opens it; width: the number is its width in m.");
}

void describe_input(Fields& f, InputMapping& input, const CellInfo& cell,
                    const std::vector<std::string>& others) {
  describe_place(f, input, cell, false, others);
  f.field("is", input.measure, kMeasures, "Of a gripper: what is read.");
  f.field("threshold", input.threshold, NumberRange{},
          "Of a digital element: it is 1 where the number is larger.");
}

void describe_outputs(Fields& f, std::vector<OutputMapping>& outputs, const CellInfo& cell,
                      const IsElement& is_element, const char* allowed) {
  describe_elements(f, "outputs", outputs, "Elements that the controller writes.", is_element, allowed,
                    [&](OutputMapping& output) { describe_output(f, output, cell); });
}

void describe_inputs(Fields& f, std::vector<InputMapping>& inputs, const CellInfo& cell,
                     const IsElement& is_element, const char* allowed) {
  describe_elements(f, "inputs", inputs, "Elements that the controller reads.", is_element, allowed,
                    [&](InputMapping& input) {
                      f.field("value", input.value, NumberRange{},
                              "A fixed number, for what the cell does not have, e.g. a program override.");
                      describe_input(f, input, cell, {"value"});
                    });
}

double number_of(const InputMapping& input, const State& state) {
  if (input.value) return *input.value;
  double number = 0.0;
  if (input.gripper.empty()) {
    number = state.signals(input.device).at(input.signal);
  } else {
    const GripperState& gripper = state.gripper(input.gripper);
    switch (input.measure) {
      case Measure::closed:
        number = gripper.closed ? 1.0 : 0.0;
        break;
      case Measure::holding:
        number = gripper.part >= 0 ? 1.0 : 0.0;
        break;
      case Measure::in_position:
        number = gripper.in_position ? 1.0 : 0.0;
        break;
      case Measure::moving:
        number = gripper.moving ? 1.0 : 0.0;
        break;
      case Measure::width:
        number = gripper.width;
        break;
      case Measure::force:
        number = gripper.force;
        break;
    }
  }
  return (number - input.offset) / input.scale;
}

bool digital(const InputMapping& input, const State& state) {
  return (number_of(input, state) > input.threshold) != input.inverted;
}

std::vector<std::string> targets_of(const std::string& robot, const std::vector<OutputMapping>& outputs) {
  std::vector<std::string> targets;
  if (!robot.empty()) targets.push_back(robot);
  for (const OutputMapping& output : outputs) {
    const std::string& target = output.gripper.empty() ? output.device : output.gripper;
    if (std::find(targets.begin(), targets.end(), target) == targets.end()) targets.push_back(target);
  }
  return targets;
}

}  // namespace takt::gateway

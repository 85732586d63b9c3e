#pragma once
// `wires` of a scenario: inputs of devices and grippers that follow other signals. The text of a wire is one of
//   SIGNAL, not SIGNAL, SIGNAL > NUMBER, SIGNAL < NUMBER, not SIGNAL > NUMBER, NUMBER * SIGNAL, NUMBER * SIGNAL + NUMBER.
#include <string>
#include <vector>

#include "server/devices/device_type.h"
#include "server/fields/rules.h"
#include "server/simulation/model/signals.h"

namespace takt {

using ScenarioWire = StatedWire;

/// A mapping of inputs to texts.
struct WireRule {
  static std::string allowed() {
    return "a mapping of inputs to signals, e.g. Gripper1.close: not Barrier1.clear";
  }
  static void read(const FieldValue& value, std::vector<ScenarioWire>& wires);
  static YAML::Node write(const std::vector<ScenarioWire>& wires);
  static KeyInfo info();
};

/// Puts the wires into the description, in an order in which a wire follows those that drive its source. Throws
/// ScenarioError for signals that do not exist, types that do not match, and circles.
void add_wires(const std::vector<ScenarioWire>& wires, CellDescription& cell);

}  // namespace takt

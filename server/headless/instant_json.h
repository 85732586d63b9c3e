#pragma once
// Instants of a run as JSON, for report and CSV: the messages of the wire with their names
// (client_lib/recording/message_json.h), and what only a run knows.
#include <nlohmann/json.hpp>

#include "idl/common/named_lists.h"
#include "server/messages/instant_messages.h"

namespace takt {

class InstantJson {
 public:
  /// The cell outlives this.
  explicit InstantJson(const CellDescription& cell);

  /// The members of CellState; `power` and `contacts` are those of Power and Contacts, where there is one. Robots have
  /// level_of_detail too, and from level 2 on flange_force and flange_torque (of gripper and load on the flange, about
  /// its origin, in W), base_force and base_torque (on the foundation, about the base's origin, in W); with motors, by
  /// joint, motor_current (A), gear_deflection (rad, motor side) and friction_mode (-1 and 1 sliding, 0 sticking).
  nlohmann::json of(const Snapshot& snapshot);
  /// As a takt_msgs/msg/Contact.
  nlohmann::json of(const ContactSample& sample) const;

 private:
  const CellDescription& cell_;
  Named lists_;
  InstantMessages messages_;
};

}  // namespace takt

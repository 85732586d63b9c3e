#pragma once
// The answer to Client::explain_part: why a Part is free, grasped, placed or assembled, as plain structs.
// Frames and units as in cell.h.
//
// The server looks from the Part along contacts to Grippers, to Grounds and to Parts of higher hierarchy,
// until nothing follows: each such way is a sequence, and the end of the best one holds the Part.
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "client_lib/cell.h"

namespace takt::client {

struct PartExplanation {
  /// A component named in this explanation.
  struct Named {
    ComponentType type = ComponentType::part;
    int hierarchy = 0;  ///< Parts
  };
  struct Contact {
    std::string a, b;
    bool measured = false;    ///< false: too many to measure all, or surfaces that do not press
    bool by_surface = false;  ///< surface contact acts: the distance is minus the largest penetration
    double distance_m = 0.0;  ///< negative: they overlap by so much
    Vector3 position_m;       ///< midway between the nearest points, or the deepest
    Vector3 normal;           ///< from a to b
  };
  struct Connection {
    std::string target;
    Vector3 force_N, moment_Nm;  ///< on the Part, about its centre of mass
    Vector3 feed_forward_N;      ///< the share of the force that carries weight
    double softening = 1.0;      ///< below 1: nothing holds the target, constants are reduced by this factor
  };
  /// Who presses upon the Part by surface contact.
  struct Pressing {
    std::string by;
    Vector3 force_N, torque_Nm;  ///< on the Part; torque about the centre of pressure
    Vector3 center_of_pressure_m;
    double normal_force_N = 0.0, friction_force_N = 0.0;
    double area_m2 = 0.0, largest_pressure_Pa = 0.0, largest_penetration_m = 0.0;
  };

  std::string part;
  ComponentType type = ComponentType::part;
  int hierarchy = 0;
  PartState state = PartState::fixed;
  std::string state_because;  ///< who makes the state so: the Gripper, the Ground, the Part assembled with
  std::string explanation;    ///< the whole in two or three sentences
  double time_s = 0.0;
  std::uint64_t step = 0;
  std::uint32_t epoch = 0;
  double decided_at_s = 0.0;  ///< time of the contacts: the beginning of the last step

  std::string partner;  ///< "": nothing holds the component
  /// nothing_reachable, only_end, end_type (Gripper before Ground before Part), shorter_sequence,
  /// present_partner (keeps it), lower_id; "" for what is not a Part.
  std::string rule;
  int contacts_to_partner = 0;
  std::string rival;  ///< who would hold it otherwise, or ""
  int contacts_to_rival = 0;
  double since_s = 0.0;  ///< when the partner became it
  std::uint64_t since_step = 0;
  std::string partner_before;  ///< "": nothing, or no change since the reset

  std::vector<std::vector<std::string>> sequences;  ///< from the Part to the end; those to the partner first
  std::uint64_t sequence_count = 0;                 ///< listed or not
  std::vector<Contact> contacts;                    ///< along the shortest sequence, then all others
  std::uint64_t contact_count = 0;
  std::vector<Connection> connections;
  bool surface_contact = false;  ///< it acts between the Part and others (level of detail 3)
  std::vector<Pressing> pressing;
  std::vector<std::string> held;  ///< Parts that this component holds
  std::uint64_t held_count = 0;
  std::map<std::string, Named> components;  ///< all that are named above

  std::string
      document;  ///< the same as JSON, as the server sent it (server/runtime/requests/explain_reply.h)
};

/// From the values of the reply to explain_part. Throws ClientError (refused) when they are none.
PartExplanation part_explanation(const std::map<std::string, std::string>& values);

}  // namespace takt::client

#pragma once
// What a scenario says about surface contact (level of detail 3). Plain structs; keys in the file are the
// member names, in the section `contact`.
#include <array>
#include <optional>
#include <string>
#include <vector>

#include "server/contact/surface/contact_law.h"
#include "server/contact/surface/contact_model.h"

namespace takt {

/// Parameters as far as somebody states them.
struct StatedContact {
  std::optional<double> youngs_modulus_Pa, poisson_ratio, layer_depth_m, areal_damping_Ns_per_m3,
      damping_depth_m, friction, friction_velocity_m_per_s, tangential_stiffness_ratio,
      tangential_damping_ratio;
  std::optional<FrictionLaw> friction_law;
};

/// Of components whose name fits.
struct ScenarioContactComponent {
  std::string name;  ///< or a pattern: * stands for any characters; a jaw is gripper/left_jaw
  std::string place;
  StatedContact stated;
  std::optional<double> element_edge_m;
  ContactRole role = ContactRole::by_rule;
};

/// Of pairs whose names fit; of several that fit, later ones add to and replace what earlier ones state.
struct ScenarioContactPair {
  std::array<std::string, 2> pair;
  std::string place;
  StatedContact stated;
  std::optional<PairForce> interaction;
  std::vector<std::array<double, 2>> friction_at_degC;  ///< (temperature, friction), ascending; may be empty
  std::string base;  ///< name (or pattern) of the side that carries the elements; empty: by rule
};

/// A parameter of a pair is what a pair entry states; else, of a pair with a Gripper, what `grippers` states;
/// else what its components state (both: the smaller number, of layer depths the larger one); else the
/// default.
struct ScenarioContact {
  bool given = false;  ///< the section is there: level of detail 3 can be switched to while running
  StatedContact defaults, grippers;
  std::vector<ScenarioContactComponent> components;
  std::vector<ScenarioContactPair> pairs;
  /// Elements are divided down to this edge; 0: the mesh's own triangles; none: default_element_edge_m().
  std::optional<double> element_edge_m;
  bool optimize_calls = true;
  bool parallel = false;
  SleepingParameters sleeping;
};

}  // namespace takt

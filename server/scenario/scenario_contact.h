#pragma once
// What a scenario says about surface contact (level of detail 3). Plain structs; the keys in the file are said by the
// table in contact_fields.cpp, in the section `contact`.
#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "server/contact/surface/contact_law.h"
#include "server/contact/surface/contact_model.h"

namespace takt {

class Fields;

/// Contact parameters as far as a scenario states them. What may be stated is a table in contact_fields.cpp.
class StatedContact {
 public:
  /// Of a parameter, if it is stated.
  template <class T>
  std::optional<T> value(T ContactParameters::*parameter) const;
  /// What is stated, and the defaults of all else.
  const ContactParameters& parameters() const { return parameters_; }
  /// What `other` states replaces what is stated here.
  void replace_by(const StatedContact& other);
  /// Of two components: where both state a parameter, the softer, weaker, more slippery side decides.
  static StatedContact joined(const StatedContact& a, const StatedContact& b);
  void state(FrictionLaw law);
  friend void describe(Fields& f, StatedContact& s);

 private:
  ContactParameters parameters_;
  std::uint32_t stated_ = 0;  ///< a bit for each row of the table
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
  std::optional<PairForce> force;
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
  bool cache_unmoved_pairs = true;
  bool parallel = false;
};

void describe(Fields& f, ScenarioContact& s);

}  // namespace takt

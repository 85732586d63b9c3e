#pragma once
// Surface contact (level of detail 3) in a scenario. Plain structs; the table in contact_fields.cpp defines
// the keys of the section `contact`.
#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "server/contact/surface/contact_law.h"
#include "server/contact/surface/contact_model.h"
#include "server/geometry/surface/contact_surface.h"

namespace takt {

class Fields;

/// Contact parameters as far as a scenario states them. The table in contact_fields.cpp lists them.
class StatedContact {
 public:
  /// Value of a parameter, if it is stated.
  template <class T>
  std::optional<T> value(T ContactParameters::*parameter) const;
  /// The stated values, with defaults for all others.
  const ContactParameters& parameters() const { return parameters_; }
  /// Stated values of `other` replace those of this object.
  void replace_by(const StatedContact& other);
  /// Of two components: if both state a parameter, the softer, weaker, more slippery side decides.
  static StatedContact joined(const StatedContact& a, const StatedContact& b);
  void state(FrictionLaw law);
  friend void describe(Fields& f, StatedContact& s);

 private:
  ContactParameters parameters_;
  std::uint32_t stated_ = 0;  ///< a bit for each row of the table
};

/// Entry for components whose name fits.
struct ScenarioContactComponent {
  std::string name;  ///< or a pattern: * stands for any characters; a jaw is gripper/left_jaw
  std::string place;
  StatedContact stated;
  std::optional<double> element_edge_m;
  std::optional<ContactResampling> resample;
  std::optional<double> field_spacing_m;
  ContactRole role = ContactRole::by_rule;
};

/// Entry for pairs whose names fit; of several entries for one pair, later ones add to and replace earlier
/// values.
struct ScenarioContactPair {
  std::array<std::string, 2> pair;
  std::string place;
  StatedContact stated;
  std::optional<PairForce> force;
  std::vector<std::array<double, 2>> friction_at_degC;  ///< (temperature, friction), ascending; may be empty
  std::string base;  ///< name (or pattern) of the side that carries the elements; empty: by rule
};

/// A parameter of a pair comes from the pair's entry; else, for a pair with a Gripper, from `grippers`; else
/// from its components (if both state it: the smaller number, of layer depths the larger one); else it is the
/// default.
struct ScenarioContact {
  bool given = false;  ///< the section exists: level of detail 3 is available during the run
  StatedContact defaults, grippers;
  std::vector<ScenarioContactComponent> components;
  std::vector<ScenarioContactPair> pairs;
  /// Elements are divided down to this edge; 0: the mesh's own triangles; unset: default_element_edge_m().
  std::optional<double> element_edge_m;
  ContactResampling resample = ContactResampling::automatic;
  std::optional<double> field_spacing_m;  ///< unset: default_field_spacing_m()
  bool cache_unmoved_pairs = true;
  bool parallel = false;
};

void describe(Fields& f, ScenarioContact& s);

}  // namespace takt

#pragma once
// Surface contact of a whole cell, as loaded: surfaces by component, laws by pair.
#include <memory>
#include <vector>

#include "server/contact/contact_law.h"
#include "server/geometry/contact_surface.h"

namespace takt {

/// What acts between two components whose processes have level of detail 3.
enum class PairForce : std::uint8_t {
  by_level,    ///< contact
  contact,     ///< contact, at level 3; the same as by_level, said explicitly
  substitute,  ///< the substitute force, at every level
};

struct ContactPairModel {
  int base = -1, target = -1;  ///< component ids: whose elements, whose surface
  ContactLaw law;
  PairForce force = PairForce::by_level;
};

struct ContactModel {
  bool enabled = false;  ///< surfaces and pairs have been made: level 3 is possible
  std::vector<std::shared_ptr<const ContactSurface>> surfaces;  ///< by component; null: none
  std::vector<ContactPairModel> pairs;                          ///< ordered by base, then target
  bool optimize_calls = true;  ///< a pair that has not moved is not evaluated again (thesis 4.5)
  bool parallel = false;       ///< pairs are evaluated by the executor, where there is one (thesis 4.5)
};

}  // namespace takt

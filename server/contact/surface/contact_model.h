#pragma once
// Surface contact of a whole cell, as loaded: surfaces by component, laws by pair.
#include <array>
#include <memory>
#include <vector>

#include "server/contact/surface/contact_law.h"
#include "server/geometry/surface/contact_surface.h"

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
  /// Coefficient of friction over the temperature (K, ascending) of the hotter of the two, in place of the
  /// law's: what holds by an adhesive lets go when it is hot. Empty: it does not depend on the temperature.
  std::vector<std::array<double, 2>> friction_at_K{};
  PairForce force = PairForce::by_level;
};

/// Parts that stand still in surface contact are left out of the system until something comes near
/// (simulation/calm_parts.h).
struct SleepingParameters {
  bool enabled = true;
  /// Calm: no point of a Part is faster than this. Bounds what is missed: a Part that would have gone on at
  /// this speed is 1 um behind after 10 s.
  double speed_m_per_s = 1e-7;
  double time_to_sleep_s = 0.05;  ///< calm for so long, and no less than two steps
};

struct ContactModel {
  bool enabled = false;  ///< surfaces and pairs have been made: level 3 is possible
  std::vector<std::shared_ptr<const ContactSurface>> surfaces;  ///< by component; null: none
  std::vector<ContactPairModel> pairs;                          ///< ordered by base, then target
  bool cache_unmoved_pairs = true;  ///< a pair that has not moved is not evaluated again (thesis 4.5)
  SleepingParameters sleeping;
  bool parallel = false;  ///< pairs are evaluated by the executor, where there is one (thesis 4.5)
};

}  // namespace takt

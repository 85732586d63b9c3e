#pragma once
// Surface contact of a whole cell, as loaded: surfaces by component, laws by pair.
#include <array>
#include <memory>
#include <vector>

#include "server/contact/surface/contact_law.h"
#include "server/geometry/surface/contact_surface.h"

namespace takt {

/// Force between two components whose processes have level of detail 3.
enum class PairForce : std::uint8_t {
  by_level,    ///< contact
  contact,     ///< contact at level 3, stated explicitly
  substitute,  ///< the substitute force, at every level
};

struct ContactPairModel {
  int base = -1, target = -1;  ///< component ids: whose elements, whose surface
  ContactLaw law;
  /// Replaces the law's coefficient of friction by a function of the temperature (K, ascending) of the hotter
  /// component: an adhesive bond releases when it is hot. Empty: independent of the temperature.
  std::vector<std::array<double, 2>> friction_at_K{};
  PairForce force = PairForce::by_level;
};

/// Parts at rest in surface contact are left out of the system until another component comes near
/// (simulation/step/threshold_sleeping.h).
struct SleepingParameters {
  bool enabled = true;
  /// A Part is at rest if no point of it is faster. It bounds the error: a Part that would have moved on at
  /// this speed is 1 um behind after 10 s.
  double speed_m_per_s = 1e-7;
  double time_to_sleep_s = 0.05;  ///< slower than that for so long, and no less than two steps
};

struct ContactModel {
  bool enabled = false;  ///< true: surfaces and pairs exist, so that level 3 is possible
  std::vector<std::shared_ptr<const ContactSurface>> surfaces;  ///< by component; nullptr: without surface
  std::vector<ContactPairModel> pairs;                          ///< ordered by base, then target
  bool cache_unmoved_pairs = true;  ///< a pair that has not moved is not evaluated again (thesis 4.5)
  SleepingParameters sleeping;
  bool parallel = false;  ///< pairs are evaluated by the executor, where there is one (thesis 4.5)
};

}  // namespace takt

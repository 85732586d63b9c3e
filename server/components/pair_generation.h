#pragma once
// Which components can interact, decided by their types alone (thesis 3.2.2, Fig. 3.4): the user never lists
// pairs.
#include <vector>

#include "server/components/component.h"

namespace takt {

enum class PairKind : std::uint8_t {
  none,    ///< never interact
  hold,    ///< Part with Part, Ground or Gripper: may carry a wrench
  report,  ///< Gripper with Ground: collision checks of robot programs; never a wrench
};

/// The 3 x 3 table.
constexpr PairKind pair_kind(ComponentType a, ComponentType b) {
  constexpr PairKind table[3][3] = {
      //             Part             Gripper            Ground
      /* Part    */ {PairKind::hold, PairKind::hold, PairKind::hold},
      /* Gripper */ {PairKind::hold, PairKind::none, PairKind::report},
      /* Ground  */ {PairKind::hold, PairKind::report, PairKind::none},
  };
  return table[static_cast<int>(a)][static_cast<int>(b)];
}

/// Wrenches are computed for the Base and balanced on the Target (thesis 2.2.2, 3.4.1).
struct ComponentPair {
  int base = -1;
  int target = -1;
  PairKind kind = PairKind::none;
};

/// All pairs that can interact, ordered by (base, target). In a hold pair the Part is the Base; of two Parts
/// the one with the lower hierarchy, then the lower id. In a report pair the Gripper is the Base.
std::vector<ComponentPair> generate_pairs(const std::vector<Component>& components);

}  // namespace takt

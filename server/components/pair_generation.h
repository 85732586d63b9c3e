#pragma once
// Which components can interact, decided by their types alone (thesis 3.2.2, Fig. 3.4): the user never lists
// pairs.
#include <vector>

#include "server/components/component.h"
#include "server/components/pair_table.h"

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

/// The pairs that can interact, ordered by base, then target.
class ComponentPairs {
 public:
  /// In ascending order. All pairs of a base are of the same kind: a Part's hold, a Gripper's report.
  void add(const ComponentPair& pair) {
    table_.add(pair.base, pair.target);
    kinds_.resize(static_cast<std::size_t>(pair.base) + 1, pair.kind);
    kinds_.back() = pair.kind;
  }
  void shrink_to_fit() { table_.shrink_to_fit(); }
  std::size_t size() const { return table_.size(); }
  ComponentPair operator[](std::size_t pair) const {
    const int base = table_.base(pair);
    return {base, table_.target(pair), kinds_[static_cast<std::size_t>(base)]};
  }
  PairIterator<ComponentPairs> begin() const { return {*this, 0}; }
  PairIterator<ComponentPairs> end() const { return {*this, size()}; }
  const PairTable& table() const { return table_; }
  PairKind kind_of_base(int base) const { return kinds_[static_cast<std::size_t>(base)]; }

 private:
  PairTable table_;
  std::vector<PairKind> kinds_;  ///< by base
};

/// Whether the first of two components that can interact is the Base.
bool base_first(const std::vector<Component>& components, int a, int b);

/// All pairs that can interact. In a hold pair the Part is the Base; of two Parts
/// the one with the lower hierarchy, then the lower id. In a report pair the Gripper is the Base.
ComponentPairs generate_pairs(const std::vector<Component>& components);

}  // namespace takt

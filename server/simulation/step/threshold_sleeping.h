#pragma once
// Threshold sleeping: groups of Parts at rest in surface contact are left out of the system until another
// component comes near, so that a stack at rest costs no time.
//
// A group consists of Parts whose bounds touch, or may soon touch, or that a substitute force connects. It
// falls asleep when no point of any of its Parts has been faster than SleepingParameters::speed_m_per_s for
// SleepingParameters::time_to_sleep_s, and no other mobile component (an awake Part, a Gripper) is near.
// States and springs of the stick law stay unchanged, to the bit. A group wakes as a whole, with its states:
//  - before a step in which a moving component might reach one of its Parts,
//  - when a substitute force on one of its Parts changes,
//  - with a reset and with a change of levels of detail.
// Everything is decided between accepted steps from the states alone, so it is the same in every run.
//
// The error is the suppressed motion below that speed. For decaying motion it is the speed times the time
// constant; for lasting motion, such as creeping by the regularised friction law, at most the speed times the
// time asleep (1 um in 10 s with the default; faster creeping stays awake).
#include <vector>

#include "idl/common/disjoint_sets.h"
#include "server/contact/holding/component_interaction.h"
#include "server/contact/surface/contact_interaction.h"
#include "server/simulation/step/exact_sleeping.h"

namespace takt {

class StateReader;
class StateWriter;

class ThresholdSleeping {
 public:
  /// All arguments must outlive it. Sleeping Parts are stored in `exact`, whose list of awake Parts counts.
  ThresholdSleeping(const std::vector<Component>& components, const SleepingParameters& parameters,
                    double step_s, ContactInteraction& contacts, ExactSleeping& exact);

  /// Wakes all Parts, after a reset or a change of levels, once the pairs with surface contact are chosen.
  /// The caller wakes `exact` too.
  void wake_all();
  /// Before a step: by component, the Grounds that move in it, or whose surface does. Empty: none.
  void set_moving_grounds(const std::vector<char>& moving) { moving_grounds_ = moving; }
  /// Before a step, at its poses: wakes groups with a Part that `exact` has woken, and groups within reach
  /// of a moving component. True if the awake Parts changed.
  bool wake_reached(const CellMotion& motion);
  /// After a step, at its poses and twists. True if the awake Parts changed.
  bool fall_asleep(const ComponentInteraction& interaction, const CellMotion& motion);

  void save(StateWriter& out) const;
  /// `exact` and the contacts must be loaded first.
  void load(StateReader& in);

 private:
  void leave_parked();
  bool asleep(int component) const;
  bool moves(int component) const;
  bool may_meet(const PairContact& pair, const CellMotion& motion, double steps) const;
  double speed_m_per_s(int component, const CellMotion& motion) const;
  void find_groups(const ComponentInteraction& interaction, const CellMotion& motion);

  const std::vector<Component>& components_;
  SleepingParameters parameters_;
  double step_s_;
  int steps_;  ///< that a Part must have been slow
  ContactInteraction& contacts_;
  ExactSleeping& exact_;
  std::vector<int> slow_steps_;       ///< by place: steps since its speed was above the limit
  std::vector<int> group_;            ///< by place: of sleeping Parts, the first place of its group; else -1
  DisjointSets near_;                 ///< places, while groups are found
  std::vector<char> kept_up_;         ///< by root: a Part of the group is not at rest, or a component is near
  std::vector<char> may_sleep_;       ///< by place: surface contact acts on it
  std::vector<char> asleep_;          ///< by component
  std::vector<char> moving_grounds_;  ///< by component; or empty
  int sleeping_ = 0;                  ///< Parts
};

}  // namespace takt

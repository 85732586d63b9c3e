#pragma once
// Parts that stand still in surface contact are left out of the system, group by group, until something comes
// near: a stack at rest costs nothing.
//
// A group are Parts whose bounds are, or may soon be, together, or that a substitute force connects. It falls
// asleep when no point of any of its Parts has been faster than SleepingParameters::speed_m_per_s for
// SleepingParameters::time_to_sleep_s, and nothing else that may move (an awake Part, a Gripper) is near. States and
// springs of the stick law stay as they are, to the bit. A group wakes as a whole, with the states it had:
//  - before a step in which anything that moves might reach one of its Parts,
//  - when a substitute force on one of its Parts changes,
//  - with a reset and with a change of levels of detail.
// Everything is decided between accepted steps from the states alone, so it is the same in every run.
//
// What is lost: the motion that would have gone on below that speed. Of decaying motion this is the speed
// times its time constant; of motion that goes on, such as creeping by the regularised friction law, at most
// the speed times the time asleep (1 um in 10 s with the default; faster creeping stays awake).
#include <span>
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
  /// All outlive it. Who sleeps is kept in `resting`, whose list of awake Parts counts.
  ThresholdSleeping(const std::vector<Component>& components, const SleepingParameters& parameters,
                    double step_s, ContactInteraction& contacts, ExactSleeping& resting);

  /// Everybody is awake: after a reset or a change of levels, once it is known where surface contact acts.
  /// The caller wakes `resting` too.
  void wake_all();
  /// Before a step, at its poses: wakes groups with a Part that `resting` has woken, and those that something
  /// may reach. True if the awake Parts changed.
  bool wake_reached(const CellMotion& motion);
  /// After a step, at its poses and twists. True if the awake Parts changed.
  bool fall_asleep(const ComponentInteraction& interaction, const CellMotion& motion);

  void save(StateWriter& out) const;
  /// `resting` and the contacts must be loaded already.
  void load(StateReader& in);

 private:
  bool asleep(int component) const;
  bool moves(int component) const;
  bool may_meet(std::size_t pair, const CellMotion& motion, double steps) const;
  double speed_m_per_s(int component, const CellMotion& motion) const;
  void find_groups(const ComponentInteraction& interaction, const CellMotion& motion);

  const std::vector<Component>& components_;
  SleepingParameters parameters_;
  double step_s_;
  int steps_;  ///< that a Part must have been calm
  ContactInteraction& contacts_;
  ExactSleeping& resting_;
  std::vector<int> calm_;        ///< by place: steps since it was faster
  std::vector<int> group_;       ///< by place: of those asleep, the first place of its group; else -1
  DisjointSets near_;            ///< places, while groups are found
  std::vector<char> kept_up_;    ///< by root: somebody in the group is not calm, or something is near
  std::vector<char> may_sleep_;  ///< by place: surface contact acts on it
  std::vector<char> asleep_;     ///< by component
  int sleeping_ = 0;             ///< Parts
};

}  // namespace takt

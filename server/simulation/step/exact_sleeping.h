#pragma once
// Exact sleeping: finds the Parts that the next step may leave out without changing a bit.
//
// With a one-step solver, the next states of a Part are a function of its own states, its connections, and
// the states of the Parts it is connected with (directly or through others: its group), as long as no Gripper
// is connected with any of them, and no Ground that moves. So if one step left all states of a group unchanged,
// bit for bit, the next step would do the same, and so on until a connection of the group changes. Unlike the
// sleeping of physics engines this has no threshold: a moving Part never sleeps.
#include <span>
#include <vector>

#include "idl/common/disjoint_sets.h"
#include "server/contact/holding/component_interaction.h"

namespace takt {

class StateReader;
class StateWriter;

class ExactSleeping {
 public:
  /// `parts`: component ids of the Parts, in the order of their segments of the state vector.
  ExactSleeping(const std::vector<Component>& components, std::vector<int> parts);

  void wake_all();
  /// After the decision on the connections of a step: wakes the groups, old and new, of Parts with a changed
  /// connection. True if the awake Parts changed.
  bool wake_changed(const ComponentInteraction& interaction);
  /// Discrete, before a step and after wake_changed(): by component, the Grounds that move in it. Wakes the groups of Parts
  /// that are connected with one. True if the awake Parts changed.
  bool wake_carried(const ComponentInteraction& interaction, const std::vector<char>& moving_grounds);
  /// After a step: `before` and `after` are the whole state vector. True if the awake Parts changed.
  bool rest_unchanged(const ComponentInteraction& interaction, std::span<const double> before,
                      std::span<const double> after);

  /// For another rule of sleeping (threshold_sleeping.h): sets whether the Part at this place is left out;
  /// call list_awake() after the last one.
  void set_asleep(std::size_t place, bool asleep) { asleep_[place] = asleep ? 1 : 0; }
  bool is_asleep(std::size_t place) const { return asleep_[place] != 0; }
  void list_awake();
  /// A parked Part is out of the cell: it is left out until it is brought in, whatever wakes others. Call
  /// list_awake() after the last change.
  void set_parked(std::size_t place, bool parked) {
    parked_count_ += parked ? 1 : 0;
    parked_count_ -= parked_[place] != 0 ? 1 : 0;
    parked_[place] = asleep_[place] = parked ? 1 : 0;
  }
  bool is_parked(std::size_t place) const { return parked_[place] != 0; }
  bool any_parked() const { return parked_count_ > 0; }
  /// Place of a component, or -1 if it is not a Part.
  int place_of(int component) const { return index_of_[static_cast<std::size_t>(component)]; }
  const std::vector<int>& parts() const { return parts_; }

  void save(StateWriter& out) const;
  /// `interaction` must be loaded first.
  void load(StateReader& in, const ComponentInteraction& interaction);

  /// Component ids, ascending; and their places in the state vector.
  std::span<const int> awake() const { return awake_; }
  std::span<const int> awake_indices() const { return awake_indices_; }

 private:
  void rebuild_groups(const ComponentInteraction& interaction);

  const std::vector<Component>& components_;
  std::vector<int> parts_;
  std::vector<int> index_of_;  ///< by component: place in parts_, or -1
  DisjointSets groups_;        ///< of places
  /// By lowest place of a group: a Gripper holds the group, or a state changed.
  std::vector<char> holds_awake_;
  std::vector<char> asleep_;          ///< by place
  std::vector<char> moving_grounds_;  ///< by component, in this step; or empty
  std::vector<char> parked_;          ///< by place
  std::size_t parked_count_ = 0;
  std::vector<int> awake_, awake_indices_;
  bool groups_valid_ = false;
};

}  // namespace takt

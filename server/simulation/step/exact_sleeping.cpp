#include "server/simulation/step/exact_sleeping.h"

#include <algorithm>
#include <cstring>
#include <utility>

#include "plant_models/mechanics/rigid_body.h"
#include "plant_models/state_bytes.h"

namespace takt {

ExactSleeping::ExactSleeping(const std::vector<Component>& components, std::vector<int> parts)
    : components_(components),
      parts_(std::move(parts)),
      index_of_(components.size(), -1),
      groups_(parts_.size()),
      holds_awake_(parts_.size(), 0),
      asleep_(parts_.size(), 0),
      parked_(parts_.size(), 0) {
  for (std::size_t i = 0; i < parts_.size(); ++i)
    index_of_[static_cast<std::size_t>(parts_[i])] = static_cast<int>(i);
  awake_.reserve(parts_.size());
  awake_indices_.reserve(parts_.size());
  wake_all();
}

void ExactSleeping::wake_all() {
  std::copy(parked_.begin(), parked_.end(), asleep_.begin());
  groups_valid_ = false;
  list_awake();
}

void ExactSleeping::save(StateWriter& out) const {
  for (const char asleep : asleep_) out.put(asleep != 0);
}

void ExactSleeping::load(StateReader& in, const ComponentInteraction& interaction) {
  for (char& asleep : asleep_) asleep = in.flag("'asleep'") ? 1 : 0;
  rebuild_groups(interaction);  // they follow from the connections
  list_awake();
}

void ExactSleeping::list_awake() {
  awake_.clear();
  awake_indices_.clear();
  for (std::size_t i = 0; i < parts_.size(); ++i) {
    if (asleep_[i] != 0) continue;
    awake_.push_back(parts_[i]);
    awake_indices_.push_back(static_cast<int>(i));
  }
}

void ExactSleeping::rebuild_groups(const ComponentInteraction& interaction) {
  groups_.reset();
  for (std::size_t i = 0; i < parts_.size(); ++i) {
    for (const PairConnection& pair : interaction.connections_of(parts_[i])) {
      const int other = index_of_[static_cast<std::size_t>(pair.connection.partner)];
      if (other >= 0) groups_.join(i, static_cast<std::size_t>(other));
    }
  }
  groups_valid_ = true;
}

bool ExactSleeping::wake_changed(const ComponentInteraction& interaction) {
  if (interaction.disturbed().empty()) return false;
  bool woken = false;
  const auto wake_groups = [&] {
    // A group wakes as a whole: its Parts exert forces on each other.
    std::fill(holds_awake_.begin(), holds_awake_.end(), 0);
    for (const int component : interaction.disturbed()) {
      const int place = index_of_[static_cast<std::size_t>(component)];
      if (place < 0) continue;
      holds_awake_[static_cast<std::size_t>(groups_.root(place))] = 1;
    }
    for (std::size_t i = 0; i < parts_.size(); ++i) {
      if (asleep_[i] == 0 || parked_[i] != 0 || holds_awake_[groups_.root(i)] == 0) continue;
      asleep_[i] = 0;
      woken = true;
    }
  };
  if (groups_valid_) wake_groups();  // groups of the old connections
  rebuild_groups(interaction);
  wake_groups();
  if (woken) list_awake();
  return woken;
}

bool ExactSleeping::wake_carried(const ComponentInteraction& interaction,
                                 const std::vector<char>& moving_grounds) {
  moving_grounds_ = moving_grounds;
  if (std::find(moving_grounds_.begin(), moving_grounds_.end(), 1) == moving_grounds_.end()) return false;
  if (awake_.size() == parts_.size()) return false;
  if (!groups_valid_) rebuild_groups(interaction);
  std::fill(holds_awake_.begin(), holds_awake_.end(), 0);
  for (std::size_t i = 0; i < parts_.size(); ++i)
    for (const PairConnection& pair : interaction.connections_of(parts_[i]))
      if (moving_grounds_[static_cast<std::size_t>(pair.connection.partner)] != 0)
        holds_awake_[static_cast<std::size_t>(groups_.root(static_cast<int>(i)))] = 1;
  bool woken = false;
  for (std::size_t i = 0; i < parts_.size(); ++i) {
    if (asleep_[i] == 0 || holds_awake_[static_cast<std::size_t>(groups_.root(static_cast<int>(i)))] == 0)
      continue;
    asleep_[i] = 0;
    woken = true;
  }
  if (woken) list_awake();
  return woken;
}

bool ExactSleeping::rest_unchanged(const ComponentInteraction& interaction, std::span<const double> before,
                                   std::span<const double> after) {
  if (!groups_valid_) rebuild_groups(interaction);
  for (const int i : awake_indices_) holds_awake_[static_cast<std::size_t>(groups_.root(i))] = 0;
  for (const int i : awake_indices_) {
    const auto place = static_cast<std::size_t>(i);
    const std::span<const PairConnection> connections = interaction.connections_of(parts_[place]);
    const bool carried =
        std::any_of(connections.begin(), connections.end(), [this](const PairConnection& pair) {
          const auto partner = static_cast<std::size_t>(pair.connection.partner);
          return components_[partner].type == ComponentType::gripper ||
                 (!moving_grounds_.empty() && moving_grounds_[partner] != 0);
        });
    const std::size_t first = place * RigidBody::kStates;
    if (carried || std::memcmp(&before[first], &after[first], RigidBody::kStates * sizeof(double)) != 0)
      holds_awake_[groups_.root(place)] = 1;
  }
  bool rested = false;
  for (const int i : awake_indices_) {
    const auto place = static_cast<std::size_t>(i);
    if (holds_awake_[groups_.root(place)] != 0) continue;
    asleep_[place] = 1;
    rested = true;
  }
  if (rested) list_awake();
  return rested;
}

}  // namespace takt

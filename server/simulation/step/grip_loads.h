#pragma once
// Compares the friction between jaws and Part with the load of a gripper, at levels of detail 1 and 2, where
// substitute forces hold every gripped Part. (By surface contact, a Part that is too heavy slips.)
//
// Each jaw presses with F along y of G. The load is the force of the gripper's connections, weight and
// inertia: L_y along y, L_t across. A load along y unloads one jaw by the amount that it adds to the other,
// so that both together press with 2 F - |L_y|, and mu (2 F - |L_y|) >= L_t requires F >= (L_t / mu + |L_y|)
// / 2. Torques about the pads are neglected; they would require more.
// pads are left out: they ask for more.
#include <cstdint>
#include <span>
#include <vector>

#include "server/contact/holding/component_interaction.h"
#include "server/simulation/model/cell_model.h"
#include "server/simulation/model/snapshot.h"
#include "server/simulation/step/cell_plant.h"
#include "server/simulation/step/grasping.h"

namespace takt {

class StateReader;
class StateWriter;

class GripLoads {
 public:
  explicit GripLoads(const CellModel& model);

  void reset();
  /// After the connections of a step have been decided. Does not allocate.
  void update(double t, std::uint64_t step, const CellMotion& motion, const ComponentInteraction& interaction,
              const Grasping& grasping, const CellPlant& plant);
  /// Load of a gripper at the last update; part -1: no gripped Part, or surface contact.
  const GripLoad& load(std::size_t gripper) const { return loads_[gripper]; }
  /// Grips found too weak in the last update.
  std::span<const WeakGrip> weak() const { return weak_; }

  void save(StateWriter& out) const;
  void load(StateReader& in);

 private:
  double least_friction(std::size_t gripper, std::span<const int> parts) const;

  const CellModel& model_;
  std::vector<GripLoad> loads_;  ///< by gripper
  std::vector<char> reported_;   ///< by gripper: that this grip is too weak
  std::vector<WeakGrip> weak_;
};

}  // namespace takt

#pragma once
// Grippers, the discrete side: commands, the grasp volume between the jaws, and jaws that stop where they
// touch. By surface contact (LoD 3) nothing stops a jaw but the force of what it touches: its reference goes
// on until its drive pushes with all its force, and what is held is what both jaws press upon.
#include <cstdint>
#include <span>
#include <vector>

#include "plant_models/gripper/parallel_gripper.h"
#include "server/simulation/cell_model.h"
#include "server/simulation/cell_plant.h"
#include "server/simulation/command.h"
#include "server/simulation/snapshot.h"

namespace takt {

class StateReader;
class StateWriter;

class Grasping {
 public:
  explicit Grasping(const CellModel& model);

  void apply(const GripperCommand& command, double t, CellPlant& plant);
  /// From now on this gripper works by surface contact, or ceases to.
  void set_by_contact(std::size_t gripper, bool by_contact, double t, CellPlant& plant);

  /// Before the connections of the step [t, t + h] are decided: stops jaws that would touch a Part within the
  /// step, and brings the grasp volumes up to date.
  void update(double t, double h, const CellMotion& motion, CellPlant& plant,
              ComponentInteraction& interaction, ContactInteraction& contacts);

  std::span<const GraspState> states() const { return states_; }
  bool closed(std::size_t gripper) const { return modes_[gripper] == Mode::close || states_[gripper].active; }
  void reset();
  void save(StateWriter& out) const;
  void load(StateReader& in);

 private:
  /// What the last command means for holding. `position` (jaws sent to a smaller width) holds only what both
  /// jaws touch.
  enum class Mode : std::uint8_t { open, position, close };

  void stop_jaws(std::size_t gripper, double t, double h, const CellMotion& motion, ParallelGripper& jaws,
                 ComponentInteraction& interaction);

  /// Jaws that touch begin `pressing_m` beyond where they are.
  void drive_jaws(std::size_t gripper, double t, double to_m, CellPlant& plant, double pressing_m = 0.0);

  const CellModel& model_;
  std::vector<Mode> modes_;           ///< by gripper
  std::vector<double> widths_;        ///< by gripper: last commanded
  std::vector<char> by_contact_;      ///< by gripper
  std::vector<double> held_until_s_;  ///< by gripper: what it held when contact took over, unless it presses
  std::vector<GraspState> states_;
};

/// State of a component for people (thesis 3.2.3): a Part is grasped if a Gripper holds it, assembled if it
/// touches a Part of its assembly (a neighbour with another hierarchy), else placed if a Ground holds it,
/// else free.
PartState part_state(const std::vector<Component>& components, const ContactGraph& graph, int component,
                     int partner);

}  // namespace takt

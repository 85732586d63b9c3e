#pragma once
// Discrete state of grippers: commands, held Parts, and the stop of jaws at contact.
//
// The held Parts are decided once per closing, after both jaws have stopped: the Parts between them that both
// touch, directly or, of several Parts clamped together, through each other. A hold ends when the jaws open,
// or when the Part leaves the space between them. A Part that enters the space later is not held, and jaws
// that closed on no Part hold none. GraspRule::on_command also holds, until that decision, the Parts between
// the jaws at the close command.
//
// By surface contact (LoD 3) only the contact force stops a jaw: its reference advances until the drive is at
// its force limit. At any time the held Parts are those that both jaws press towards each other. Jaws that
// meet each other stop.
#include <cstdint>
#include <span>
#include <vector>

#include "plant_models/gripper/parallel_gripper.h"
#include "server/simulation/model/cell_model.h"
#include "server/simulation/model/command.h"
#include "server/simulation/model/snapshot.h"
#include "server/simulation/step/cell_plant.h"

namespace takt {

class StateReader;
class StateWriter;

class Grasping {
 public:
  explicit Grasping(const CellModel& model);

  void apply(const GripperCommand& command, double t, CellPlant& plant);
  /// Switches this gripper to surface contact, or back.
  void set_by_contact(std::size_t gripper, bool by_contact, double t, CellPlant& plant);

  /// Before the decision on the connections of the step [t, t + h]: stops jaws that would touch a Part within
  /// the step, and updates the grasp volumes.
  void update(double t, double h, const CellMotion& motion, CellPlant& plant,
              ComponentInteraction& interaction, ContactInteraction& contacts);

  std::span<const GraspState> states() const { return states_; }
  /// True if the last command closes the jaws, or they hold a Part.
  bool closed(std::size_t gripper) const {
    return modes_[gripper] == Mode::close || !states_[gripper].held.empty();
  }
  /// The last command closes the jaws.
  bool commanded_close(std::size_t gripper) const { return modes_[gripper] == Mode::close; }
  bool by_contact(std::size_t gripper) const { return by_contact_[gripper] != 0; }
  double commanded_width_m(std::size_t gripper) const { return widths_[gripper]; }
  /// The Part that both jaws touch, of several the first in the description; -1: none.
  int part_present(std::size_t gripper) const;
  /// Force of each jaw on the held Part at a level of detail without contact forces: the share of the drive's
  /// largest force that corresponds to the advance of its reference beyond the stop, at most the commanded limit.
  double grip_force_N(std::size_t gripper, const CellPlant& plant) const;
  void reset();
  void save(StateWriter& out) const;
  void load(StateReader& in);

 private:
  /// Kind of the last command. `position` (jaws sent to a smaller width) holds only Parts that both jaws
  /// touch.
  enum class Mode : std::uint8_t { open, position, close };

  void stop_jaws(std::size_t gripper, double t, double h, const CellMotion& motion, ParallelGripper& jaws,
                 ComponentInteraction& interaction);
  /// Both jaws have stopped: decides the held Parts.
  void settle(std::size_t gripper, double t, const CellMotion& motion, const ParallelGripper& jaws,
              ComponentInteraction& interaction);
  void hold_by_contact(std::size_t gripper, double t, const CellMotion& motion, CellPlant& plant,
                       ComponentInteraction& interaction, ContactInteraction& contacts);
  /// The Parts of `between_` that are clamped, from the contacts of each jaw in `touched_`.
  void clamp(const ContactGraph& graph, std::vector<int>& held);
  bool reaches(const ContactGraph& graph, std::size_t from, std::size_t without, std::uint8_t jaws);

  /// References of touching jaws begin `pressing_m` beyond their positions.
  void drive_jaws(std::size_t gripper, double t, double to_m, CellPlant& plant, double pressing_m = 0.0);

  const CellModel& model_;
  std::vector<Mode> modes_;       ///< by gripper
  std::vector<double> widths_;    ///< by gripper: last commanded
  std::vector<char> by_contact_;  ///< by gripper
  /// By gripper: end of the hold of Parts taken over from substitute forces, unless it presses on them.
  std::vector<double> held_until_s_;
  std::vector<char> settled_;  ///< by gripper: the held Parts have been decided since the jaws closed
  std::vector<char> taking_;   ///< by gripper: the Parts between the jaws are held until that decision
  std::vector<GraspState> states_;

  std::vector<int> between_, queue_;   ///< Parts, and places in between_
  std::vector<std::uint8_t> touched_;  ///< by place in between_: bits of the jaws
  std::vector<char> seen_;             ///< by place in between_
  std::vector<int> pressed_;
};

/// Reported state of a component (thesis 3.2.3): a Part is grasped if a Gripper holds it, assembled if it
/// touches a Part of its assembly (a neighbour with another hierarchy), else placed if a Ground holds it,
/// else free.
PartState part_state(const std::vector<Component>& components, const ContactGraph& graph, int component,
                     int partner);

}  // namespace takt

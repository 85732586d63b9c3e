#pragma once
// Grippers, the discrete side: commands, what the jaws hold, and jaws that stop where they touch.
//
// What is held is decided once per closing, when both jaws have come to a stand: the Parts between them that
// both touch, directly or, of several that are clamped together, through each other. It ends when the jaws
// open, or when the Part leaves the space between them. What comes between the jaws afterwards is not held,
// and jaws that closed on nothing hold nothing. GraspRule::on_command holds what was between the jaws at the
// close command until then, too.
//
// By surface contact (LoD 3) nothing stops a jaw but the force of what it touches: its reference goes on
// until its drive pushes with all its force. What is held is what both jaws press towards each other, at
// any time. Jaws that meet each other stand there.
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
  /// From now on this gripper works by surface contact, or ceases to.
  void set_by_contact(std::size_t gripper, bool by_contact, double t, CellPlant& plant);

  /// Before the connections of the step [t, t + h] are decided: stops jaws that would touch a Part within the
  /// step, and brings the grasp volumes up to date.
  void update(double t, double h, const CellMotion& motion, CellPlant& plant,
              ComponentInteraction& interaction, ContactInteraction& contacts);

  std::span<const GraspState> states() const { return states_; }
  /// The last command closes the jaws, or they hold something.
  bool closed(std::size_t gripper) const {
    return modes_[gripper] == Mode::close || !states_[gripper].held.empty();
  }
  bool by_contact(std::size_t gripper) const { return by_contact_[gripper] != 0; }
  double commanded_width_m(std::size_t gripper) const { return widths_[gripper]; }
  /// The Part that both jaws touch, of several the first in the description; -1: none.
  int part_present(std::size_t gripper) const;
  /// With which each jaw presses on what it holds at a level of detail without forces between them: the share
  /// of the largest force that the drive has after going on so far beyond where the jaw was stopped.
  double grip_force_N(std::size_t gripper, const CellPlant& plant) const;
  void reset();
  void save(StateWriter& out) const;
  void load(StateReader& in);

 private:
  /// What the last command means for holding. `position` (jaws sent to a smaller width) holds only what both
  /// jaws touch.
  enum class Mode : std::uint8_t { open, position, close };

  void stop_jaws(std::size_t gripper, double t, double h, const CellMotion& motion, ParallelGripper& jaws,
                 ComponentInteraction& interaction);
  /// Both jaws stand: what is held from now on.
  void settle(std::size_t gripper, double t, const CellMotion& motion, const ParallelGripper& jaws,
              ComponentInteraction& interaction);
  void hold_by_contact(std::size_t gripper, double t, const CellMotion& motion, CellPlant& plant,
                       ComponentInteraction& interaction, ContactInteraction& contacts);
  /// The Parts of `between_` that are clamped, as `touched_` says which jaw touches which of them.
  void clamp(const ContactGraph& graph, std::vector<int>& held);
  bool reaches(const ContactGraph& graph, std::size_t from, std::size_t without, std::uint8_t jaws);

  /// Jaws that touch begin `pressing_m` beyond where they are.
  void drive_jaws(std::size_t gripper, double t, double to_m, CellPlant& plant, double pressing_m = 0.0);

  const CellModel& model_;
  std::vector<Mode> modes_;           ///< by gripper
  std::vector<double> widths_;        ///< by gripper: last commanded
  std::vector<char> by_contact_;      ///< by gripper
  std::vector<double> held_until_s_;  ///< by gripper: what it held when contact took over, unless it presses
  std::vector<char> settled_;         ///< by gripper: what is held has been decided since the jaws closed
  std::vector<char> taking_;          ///< by gripper: what is between the jaws now is held until then
  std::vector<GraspState> states_;

  std::vector<int> between_, queue_;   ///< Parts, and places in between_
  std::vector<std::uint8_t> touched_;  ///< by place in between_: bits of the jaws
  std::vector<char> seen_;             ///< by place in between_
  std::vector<int> pressed_;
};

/// State of a component for people (thesis 3.2.3): a Part is grasped if a Gripper holds it, assembled if it
/// touches a Part of its assembly (a neighbour with another hierarchy), else placed if a Ground holds it,
/// else free.
PartState part_state(const std::vector<Component>& components, const ContactGraph& graph, int component,
                     int partner);

}  // namespace takt

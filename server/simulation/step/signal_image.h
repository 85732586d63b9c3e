#pragma once
// The signals of a running cell: those of grippers and robots as values, writing to inputs, forced values, and wires.
//
// Inputs are written at the boundary of a step: commands of clients first, in their order, then all wires in the order
// of the description. A wire whose source is an input that a wire drives follows that wire. Reported signals have the
// values that clients have received with the instant at this time. A forced signal keeps its value against all of them.
#include <string>

#include "server/simulation/model/cell_model.h"
#include "server/simulation/model/command.h"
#include "server/simulation/model/snapshot.h"
#include "server/simulation/step/cell_plant.h"
#include "server/simulation/step/grasping.h"

namespace takt {

class SignalImage final : public MachineSignals {
 public:
  /// All outlive it.
  SignalImage(const CellModel& model, CellPlant& plant, Grasping& grasping);

  double value(SignalRef ref) const override;

  /// Writes an input, unless it is forced: then the value comes with the release. True if the right-hand side of the
  /// equations of motion has changed. `value` is one of the signal.
  bool write(SignalRef ref, double value, double t);
  /// A forced gripper keeps the command until the release.
  void apply(const GripperCommand& command, double t);
  /// The motion must be that of time t. True as write().
  bool follow_wires(double t);

  /// `value` is one of the signal (wrong_value()). True as write().
  bool force(SignalRef ref, double value, double t);
  /// The other input of the same gripper, if that is forced.
  std::optional<SignalRef> other_forced_input(SignalRef ref) const;
  /// The signal must be forced. True as write().
  bool release(SignalRef ref, double t);

  /// Measured values with forced ones in their place, without the force of the drives of a dynamic robot.
  void read_gripper(std::size_t gripper, double t, GripperSample& sample) const;
  /// Adds that force where it is the measured one. `effort`: of the drives of the robot.
  void add_drive_force(std::size_t gripper, std::span<const double> effort, GripperSample& sample) const;

 private:
  double gripper_value(std::size_t gripper, GripperSignal signal) const;
  void put_forced(std::size_t gripper, GripperSample& sample) const;
  bool set(SignalRef ref, double value, double t);
  ForcedSignal* forced_gripper(std::size_t gripper);

  const CellModel& model_;
  CellPlant& plant_;
  Grasping& grasping_;
  std::vector<SignalDescription> inputs_;  ///< by wire
};

}  // namespace takt

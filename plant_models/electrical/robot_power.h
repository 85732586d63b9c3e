#pragma once
// Electrical power of a robot (thesis 5.5.2): from the mechanical power of each axis by a loss factor (5.24),
// (5.25), or from the motor's own voltage and current where its drive models them; plus idle power.
//
// A braking axis returns no power to the other axes or to the mains, as in the thesis, unless `recovers` is
// set: then it feeds back its mechanical power less the losses (divided by the loss factor), a motor model
// its u i.
#include <array>

#include "plant_models/robot/arm_kinematics.h"

namespace takt {

struct RobotPowerParameters {
  double idle_W = 0.0;       ///< control cabinet and brakes; drawn always (thesis: 200 W)
  double loss_factor = 1.0;  ///< k_loss of (5.24), at least 1 (thesis: 1.3)
  bool recovers = false;     ///< negative power is fed back; else it is burnt in the brake resistor
};

struct RobotPower {
  std::array<double, kMaxJoints> mechanical_W{};  ///< per joint: torque of the drive times joint velocity
  double mechanical_total_W = 0.0;
  double electrical_W = 0.0;
  double mechanical_energy_J = 0.0;
  double electrical_energy_J = 0.0;  ///< the sum over communication steps of what each axis takes in one
};

/// Electrical power of one axis without a motor model (W), idle power not included.
double electrical_power_of_axis(const RobotPowerParameters& parameters, double mechanical_W);
/// The same from u i of a motor model: the power from the supply.
double electrical_power_of_motor(const RobotPowerParameters& parameters, double voltage_times_current_W);

}  // namespace takt

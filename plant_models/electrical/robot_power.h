#pragma once
// Electrical power of a robot from its mechanical power (thesis 5.5.2): a loss factor and idle power.
#include <array>

#include "plant_models/robot/arm_kinematics.h"

namespace takt {

struct RobotPowerParameters {
  double idle_W = 0.0;       ///< P_idle of (5.25): control cabinet and brakes
  double loss_factor = 1.0;  ///< electrical per mechanical power while motoring, see (5.24)
  bool recovers = false;  ///< negative mechanical power is fed back; else it is burnt in the brake resistor
};

struct RobotPower {
  std::array<double, kMaxJoints> mechanical_W{};  ///< per joint: torque of the drive times joint velocity
  double mechanical_total_W = 0.0;
  double electrical_W = 0.0;
  double mechanical_energy_J = 0.0, electrical_energy_J = 0.0;  ///< integrated as states
};

}  // namespace takt

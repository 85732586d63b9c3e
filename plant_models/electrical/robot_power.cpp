#include "plant_models/electrical/robot_power.h"

namespace takt {

double electrical_power_of_axis(const RobotPowerParameters& parameters, double mechanical_W) {
  if (mechanical_W >= 0.0) return parameters.loss_factor * mechanical_W;
  return parameters.recovers ? mechanical_W / parameters.loss_factor : 0.0;
}

double electrical_power_of_motor(const RobotPowerParameters& parameters, double voltage_times_current_W) {
  return voltage_times_current_W >= 0.0 || parameters.recovers ? voltage_times_current_W : 0.0;
}

}  // namespace takt

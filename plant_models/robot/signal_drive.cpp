#include "plant_models/robot/signal_drive.h"

#include <algorithm>
#include <stdexcept>
#include <string>

namespace takt {

SignalDrive::SignalDrive(const SignalDriveParameters& parameters) : parameters_(parameters) {
  if (!(parameters.armature >= 0.0) || !std::isfinite(parameters.armature))
    throw std::invalid_argument("drive by a signal: the armature must not be negative, found " +
                                std::to_string(parameters.armature));
  if (!(parameters.max_torque > 0.0))
    throw std::invalid_argument("drive by a signal: the largest torque must be positive, found " +
                                std::to_string(parameters.max_torque));
}

DriveOutput SignalDrive::output(const JointReference& reference, double, double, const double*) const {
  DriveOutput output;
  output.torque = std::clamp(reference.applied, -parameters_.max_torque, parameters_.max_torque);
  return output;
}

DriveSample SignalDrive::sample(const JointReference& reference, double q, double qd, double,
                                const double* z) const {
  DriveSample sample;
  sample.motor_speed_rad_per_s = qd;
  sample.motor_torque_N_m = output(reference, q, qd, z).torque;
  return sample;
}

}  // namespace takt

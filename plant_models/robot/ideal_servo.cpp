#include "plant_models/robot/ideal_servo.h"

#include <algorithm>
#include <stdexcept>
#include <string>

namespace takt {

IdealServo::IdealServo(const IdealServoParameters& parameters) : parameters_(parameters) {
  if (!(parameters.frequency_rad_per_s > 0.0) || !std::isfinite(parameters.frequency_rad_per_s))
    throw std::invalid_argument("ideal servo: the frequency must be positive, found " +
                                std::to_string(parameters.frequency_rad_per_s) + " rad/s");
  if (!(parameters.max_torque > 0.0))
    throw std::invalid_argument("ideal servo: the largest torque or force must be positive, found " +
                                std::to_string(parameters.max_torque));
}

DriveOutput IdealServo::output(const JointReference& reference, double q, double qd, const double*) const {
  const double w = parameters_.frequency_rad_per_s;
  DriveOutput output;
  if (!reference.position_control) {
    output.torque = std::clamp(reference.feed_forward, -parameters_.max_torque, parameters_.max_torque);
    return output;
  }
  output.prescribes_acceleration = true;
  output.acceleration = w * w * (reference.q - q) - 2.0 * w * qd;
  if (parameters_.velocity_feed_forward) output.acceleration += reference.qdd + 2.0 * w * reference.qd;
  output.max_holding_torque = parameters_.max_torque;
  return output;
}

void IdealServo::jacobian(const JointReference& reference, double, double, const double*,
                          DriveJacobian& J) const {
  if (!reference.position_control) return;
  const double w = parameters_.frequency_rad_per_s;
  J.torque_dq = -w * w;
  J.torque_dqd = -2.0 * w;
}

void IdealServo::time_derivative(const JointReference& reference, double, double, const double*,
                                 DriveRate& rate) const {
  if (!reference.position_control) return;
  const double w = parameters_.frequency_rad_per_s;
  rate.torque = w * w * reference.qd;
  if (parameters_.velocity_feed_forward) rate.torque += 2.0 * w * reference.qdd;
}

DriveSample IdealServo::sample(const JointReference& reference, double q, double qd, double holding_torque,
                               const double* z) const {
  DriveSample sample;
  sample.motor_speed_rad_per_s = qd;
  sample.motor_torque_N_m = holding_torque + output(reference, q, qd, z).torque;
  return sample;
}

}  // namespace takt

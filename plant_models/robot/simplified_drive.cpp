#include "plant_models/robot/simplified_drive.h"

#include <algorithm>
#include <stdexcept>
#include <string>

namespace takt {

void SimplifiedDriveParameters::set_bandwidth(double w) {
  position_gain_per_s = w;
  speed_gain_per_s = 6.0 * w;
  integral_time_s = 3.0 / w;
}

SimplifiedDrive::SimplifiedDrive(const SimplifiedDriveParameters& parameters) : parameters_(parameters) {
  const auto positive = [](double value, const char* name) {
    if (!(value > 0.0))
      throw std::invalid_argument(std::string("simplified drive: ") + name + " must be positive, found " +
                                  std::to_string(value));
  };
  positive(parameters.inertia(), "the inertia the gains are made for (rotor behind the gear plus load)");
  positive(parameters.position_gain_per_s, "the position gain");
  positive(parameters.speed_gain_per_s, "the speed gain");
  positive(parameters.integral_time_s, "the integral time");
  positive(parameters.max_torque, "the largest torque");
  if (parameters.gear_ratio == 0.0 || parameters.rotor_inertia_kg_m2 < 0.0)
    throw std::invalid_argument(
        "simplified drive: the gear ratio must not be zero, nor the rotor inertia negative");
}

SimplifiedDrive::Control SimplifiedDrive::control(const JointReference& reference, double q, double qd,
                                                  double x) const {
  const SimplifiedDriveParameters& p = parameters_;
  Control c;
  if (!reference.position_control) {
    c.u = 0.0;
    c.torque = c.limited_torque = std::clamp(reference.feed_forward, -p.max_torque, p.max_torque);
    return c;
  }
  c.u = reference.qd - qd + p.position_gain_per_s * (reference.q - q);
  c.torque = p.inertia() * (p.speed_gain_per_s * (c.u + x / p.integral_time_s) + reference.qdd) +
             reference.feed_forward;
  c.limited_torque = std::clamp(c.torque, -p.max_torque, p.max_torque);
  return c;
}

void SimplifiedDrive::initial_state(const JointReference& reference, double tau, double* z) const {
  const SimplifiedDriveParameters& p = parameters_;
  const double wanted = std::clamp(tau + p.armature() * reference.qdd, -p.max_torque, p.max_torque);
  z[0] = p.integral_time_s / p.speed_gain_per_s *
         ((wanted - reference.feed_forward) / p.inertia() - reference.qdd);
}

DriveOutput SimplifiedDrive::output(const JointReference& reference, double q, double qd,
                                    const double* z) const {
  DriveOutput output;
  output.torque = control(reference, q, qd, z[0]).limited_torque;
  return output;
}

void SimplifiedDrive::derivatives(const JointReference& reference, double q, double qd, const double* z,
                                  double* zdot) const {
  const Control c = control(reference, q, qd, z[0]);
  zdot[0] = c.u + (c.limited_torque - c.torque) / (parameters_.inertia() * parameters_.speed_gain_per_s);
}

void SimplifiedDrive::set_integral(double torque, double* z) const {
  const SimplifiedDriveParameters& p = parameters_;
  z[0] = p.integral_time_s / p.speed_gain_per_s * torque / p.inertia();
}

DrivePattern SimplifiedDrive::pattern() const {
  DrivePattern P;
  P.dz_dz[0][0] = P.dz_dq[0] = P.dz_dqd[0] = P.torque_dz[0] = true;
  return P;
}

void SimplifiedDrive::jacobian(const JointReference& reference, double q, double qd, const double* z,
                               DriveJacobian& J) const {
  if (!reference.position_control) return;
  const SimplifiedDriveParameters& p = parameters_;
  const Control c = control(reference, q, qd, z[0]);
  if (c.limited_torque == c.torque) {
    const double gain = p.inertia() * p.speed_gain_per_s;
    J.torque_dq = -gain * p.position_gain_per_s;
    J.torque_dqd = -gain;
    J.torque_dz[0] = gain / p.integral_time_s;
    J.dz_dq[0] = -p.position_gain_per_s;
    J.dz_dqd[0] = -1.0;
  } else {  // u cancels
    J.dz_dz[0][0] = -1.0 / p.integral_time_s;
  }
}

void SimplifiedDrive::time_derivative(const JointReference& reference, double q, double qd, const double* z,
                                      DriveRate& rate) const {
  if (!reference.position_control) return;
  const SimplifiedDriveParameters& p = parameters_;
  const Control c = control(reference, q, qd, z[0]);
  if (c.limited_torque != c.torque) return;  // u cancels, the torque stays
  const double u_rate = reference.qdd + p.position_gain_per_s * reference.qd;
  rate.torque = p.inertia() * p.speed_gain_per_s * u_rate;
  rate.zdot[0] = u_rate;
}

DriveSample SimplifiedDrive::sample(const JointReference& reference, double q, double qd, double,
                                    const double* z) const {
  DriveSample sample;
  sample.motor_speed_rad_per_s = parameters_.gear_ratio * qd;
  sample.motor_torque_N_m = control(reference, q, qd, z[0]).limited_torque / parameters_.gear_ratio;
  return sample;
}

}  // namespace takt

#include "plant_models/robot/detailed_drive.h"

#include <stdexcept>
#include <string>

namespace takt {

DetailedDrive::DetailedDrive(const DetailedDriveParameters& parameters) : parameters_(parameters) {
  const auto require = [](bool good, const char* what, double value) {
    if (!good || !std::isfinite(value))
      throw std::invalid_argument(std::string("detailed drive: ") + what + ", found " +
                                  std::to_string(value));
  };
  const DetailedDriveParameters& p = parameters;
  require(p.gear_ratio != 0.0, "the gear ratio must not be zero", p.gear_ratio);
  require(p.motor_inertia_kg_m2 > 0.0 || (!p.elastic_gear && p.motor_inertia_kg_m2 == 0.0),
          "the motor's inertia must be positive", p.motor_inertia_kg_m2);
  require(p.motor_constant_N_m_per_A > 0.0, "the motor constant must be positive",
          p.motor_constant_N_m_per_A);
  require(p.current_loop_rad_per_s > 0.0, "the current loop's frequency must be positive",
          p.current_loop_rad_per_s);
  require(p.current_loop_damping > 0.0, "the current loop's damping must be positive",
          p.current_loop_damping);
  require(p.resistance_ohm > 0.0, "the resistance must be positive", p.resistance_ohm);
  require(p.power_stage_gain > 0.0, "the power stage's gain must be positive", p.power_stage_gain);
  require(p.position_gain_per_s >= 0.0, "the position gain must not be negative", p.position_gain_per_s);
  require(p.speed_gain_As_per_rad > 0.0, "the speed gain must be positive", p.speed_gain_As_per_rad);
  require(p.speed_integral_time_s > 0.0, "the speed controller's integral time must be positive",
          p.speed_integral_time_s);
  require(!p.elastic_gear || p.gear_stiffness_N_m_per_rad > 0.0, "an elastic gear needs a positive stiffness",
          p.gear_stiffness_N_m_per_rad);
  require(p.gear_damping_N_m_s_per_rad >= 0.0, "the gear's damping must not be negative",
          p.gear_damping_N_m_s_per_rad);
  require(p.friction.zero_speed_N_m >= 0.0, "friction at zero speed must not be negative",
          p.friction.zero_speed_N_m);
  require(p.friction.break_away >= 1.0, "the break-away factor must be at least 1", p.friction.break_away);
  require(p.friction.slope_N_m_s >= 0.0, "the friction's slope must not be negative", p.friction.slope_N_m_s);
  require(p.friction.regularisation_speed_rad_per_s > 0.0, "the regularisation speed must be positive",
          p.friction.regularisation_speed_rad_per_s);
}

double DetailedDrive::armature() const {
  const DetailedDriveParameters& p = parameters_;
  return p.elastic_gear ? 0.0 : p.gear_ratio * p.gear_ratio * p.motor_inertia_kg_m2;
}

FrictionMode DetailedDrive::mode(const double* z) const {
  if (!has_modes()) return FrictionMode::forward;
  const double m = z[mode_index()];
  return m > 0.5 ? FrictionMode::forward : (m < -0.5 ? FrictionMode::backward : FrictionMode::stuck);
}

void DetailedDrive::set_mode(FrictionMode mode, double& qd, double* z) const {
  if (!has_modes()) return;
  z[mode_index()] = static_cast<double>(mode);
  if (mode == FrictionMode::stuck) (parameters_.elastic_gear ? z[motor_speed] : qd) = 0.0;
}

double DetailedDrive::motor_speed_of(double qd, const double* z) const {
  return parameters_.elastic_gear ? z[motor_speed] : parameters_.gear_ratio * qd;
}

double DetailedDrive::current_A(double torque) const {
  return torque / (parameters_.gear_ratio * parameters_.motor_constant_N_m_per_A);
}

void DetailedDrive::set_integral(double torque, double* z) const {
  z[integrator] = current_A(torque) / parameters_.speed_gain_As_per_rad;
}

double DetailedDrive::spring_torque(double qd, const double* z) const {
  const DetailedDriveParameters& p = parameters_;
  return p.gear_stiffness_N_m_per_rad * z[deflection] +
         p.gear_damping_N_m_s_per_rad * (p.gear_ratio * qd - z[motor_speed]);
}

void DetailedDrive::initial_state(const JointReference& reference, double tau, double* z) const {
  const DetailedDriveParameters& p = parameters_;
  const double n = p.gear_ratio, k = p.motor_constant_N_m_per_A;
  const double speed = n * reference.qd;
  const double friction_speed_now = p.elastic_gear ? speed : reference.qd;
  FrictionMode mode = FrictionMode::stuck;
  if (friction_speed_now > 0.0) mode = FrictionMode::forward;
  if (friction_speed_now < 0.0) mode = FrictionMode::backward;
  const double friction = p.friction.torque(mode, friction_speed_now);
  double psi = 0.0;
  if (p.elastic_gear) {
    psi = -tau / (n * p.gear_stiffness_N_m_per_rad);
    z[deflection] = psi;
    z[motor_speed] = speed;
    z[current] = (tau / n + p.motor_inertia_kg_m2 * n * reference.qdd + friction) / k;
  } else {
    z[current] = (tau + armature() * reference.qdd + friction) / (n * k);
  }
  z[current_controller] = -(p.resistance_ohm * z[current] + k * speed) / p.power_stage_gain;
  // i' = vC' = 0 needs i_ref = i. At the reference, u is the remainder from the wind-up of the gear.
  const double angle_error = p.position_at_joint ? 0.0 : psi;
  z[integrator] = (z[current] - current_A(reference.feed_forward)) / p.speed_gain_As_per_rad -
                  p.position_gain_per_s * angle_error;
  if (has_modes()) z[mode_index()] = static_cast<double>(mode);
}

DriveOutput DetailedDrive::output(const JointReference&, double, double qd, const double* z) const {
  const DetailedDriveParameters& p = parameters_;
  DriveOutput output;
  output.electrical_power_W = -p.power_stage_gain * z[current_controller] * z[current];
  if (p.elastic_gear) {
    output.torque = -p.gear_ratio * spring_torque(qd, z);
  } else {
    const FrictionMode present = mode(z);
    output.torque = p.gear_ratio * p.motor_constant_N_m_per_A * z[current] - p.friction.torque(present, qd);
    output.locks_joint = present == FrictionMode::stuck;
  }
  return output;
}

void DetailedDrive::derivatives(const JointReference& reference, double q, double qd, const double* z,
                                double* zdot) const {
  const DetailedDriveParameters& p = parameters_;
  const double n = p.gear_ratio, k = p.motor_constant_N_m_per_A, R = p.resistance_ohm;
  const double w = p.current_loop_rad_per_s, D = p.current_loop_damping, g = p.power_stage_gain;
  const double speed = motor_speed_of(qd, z);
  const bool wind_up_counts = p.elastic_gear && !p.position_at_joint;
  const double angle_error = n * (reference.q - q) + (wind_up_counts ? z[deflection] : 0.0);
  const double u = n * reference.qd + p.position_gain_per_s * angle_error - speed;
  const double control = reference.position_control ? p.speed_gain_As_per_rad * (z[integrator] + u) : 0.0;
  const double wanted_current = control + current_A(reference.feed_forward);
  zdot[integrator] = reference.position_control ? u / p.speed_integral_time_s : 0.0;
  zdot[current_controller] = (z[current] - wanted_current) * w * R / (2.0 * g * D);
  zdot[current] = (-g * z[current_controller] - R * z[current] - k * speed) / p.inductance_H();
  if (p.elastic_gear) {
    const FrictionMode present = mode(z);
    zdot[deflection] = n * qd - speed;
    zdot[motor_speed] = present == FrictionMode::stuck
                            ? 0.0
                            : (k * z[current] + spring_torque(qd, z) - p.friction.torque(present, speed)) /
                                  p.motor_inertia_kg_m2;
  }
  if (has_modes()) zdot[mode_index()] = 0.0;
}

DrivePattern DetailedDrive::pattern() const {
  DrivePattern P;
  const auto row = [&P](int i, std::initializer_list<int> columns, bool q, bool qd) {
    for (const int j : columns) P.dz_dz[i][j] = true;
    P.dz_dq[i] = q, P.dz_dqd[i] = qd;
  };
  if (parameters_.elastic_gear) {
    row(integrator, {deflection, motor_speed}, true, false);
    row(current_controller, {integrator, current, deflection, motor_speed}, true, false);
    row(current, {current_controller, current, motor_speed}, false, false);
    row(deflection, {motor_speed}, false, true);
    row(motor_speed, {current, deflection, motor_speed}, false, true);
    P.torque_dz[deflection] = P.torque_dz[motor_speed] = true;
  } else {
    row(integrator, {}, true, true);
    row(current_controller, {integrator, current}, true, true);
    row(current, {current_controller, current}, false, true);
    P.torque_dz[current] = true;
  }
  return P;
}

void DetailedDrive::jacobian(const JointReference& reference, double, double qd, const double* z,
                             DriveJacobian& J) const {
  const DetailedDriveParameters& p = parameters_;
  const double n = p.gear_ratio, k = p.motor_constant_N_m_per_A, L = p.inductance_H();
  // Without position control the current controller is all that is left.
  const double ks = reference.position_control ? p.speed_gain_As_per_rad : 0.0;
  const double Ts =
      reference.position_control ? p.speed_integral_time_s : std::numeric_limits<double>::infinity();
  const double kp = p.position_gain_per_s;
  const double loop =
      p.current_loop_rad_per_s * p.resistance_ohm / (2.0 * p.power_stage_gain * p.current_loop_damping);
  J.dz_dq[integrator] = -n * kp / Ts;
  J.dz_dq[current_controller] = loop * ks * n * kp;
  J.dz_dz[current_controller][integrator] = -loop * ks;
  J.dz_dz[current_controller][current] = loop;
  J.dz_dz[current][current_controller] = -p.power_stage_gain / L;
  J.dz_dz[current][current] = -p.resistance_ohm / L;
  const FrictionMode present = mode(z);
  if (p.elastic_gear) {
    const double c = p.gear_stiffness_N_m_per_rad, d = p.gear_damping_N_m_s_per_rad;
    if (!p.position_at_joint) {
      J.dz_dz[integrator][deflection] = kp / Ts;
      J.dz_dz[current_controller][deflection] = -loop * ks * kp;
    }
    J.dz_dz[integrator][motor_speed] = -1.0 / Ts;
    J.dz_dz[current_controller][motor_speed] = loop * ks;
    J.dz_dz[current][motor_speed] = -k / L;
    J.dz_dz[deflection][motor_speed] = -1.0;
    J.dz_dqd[deflection] = n;
    if (present != FrictionMode::stuck) {
      const double per_inertia = 1.0 / p.motor_inertia_kg_m2;
      J.dz_dz[motor_speed][current] = k * per_inertia;
      J.dz_dz[motor_speed][deflection] = c * per_inertia;
      J.dz_dz[motor_speed][motor_speed] = (-d - p.friction.torque_dv(present, z[motor_speed])) * per_inertia;
      J.dz_dqd[motor_speed] = n * d * per_inertia;
    }
    J.torque_dz[deflection] = -n * c;
    J.torque_dz[motor_speed] = n * d;
    J.torque_dqd = -n * n * d;
  } else {
    J.dz_dqd[integrator] = -n / Ts;
    J.dz_dqd[current_controller] = loop * ks * n;
    J.dz_dqd[current] = -k * n / L;
    J.torque_dz[current] = n * k;
    J.torque_dqd = -p.friction.torque_dv(present, qd);
  }
}

void DetailedDrive::time_derivative(const JointReference& reference, double, double, const double*,
                                    DriveRate& rate) const {
  if (!reference.position_control) return;
  const DetailedDriveParameters& p = parameters_;
  const double u_rate = p.gear_ratio * (reference.qdd + p.position_gain_per_s * reference.qd);
  rate.zdot[integrator] = u_rate / p.speed_integral_time_s;
  rate.zdot[current_controller] = -p.speed_gain_As_per_rad * u_rate * p.current_loop_rad_per_s *
                                  p.resistance_ohm / (2.0 * p.power_stage_gain * p.current_loop_damping);
}

void DetailedDrive::state_scales(double* scales) const {
  scales[integrator] = 10.0;           // rad/s
  scales[current_controller] = 100.0;  // V
  scales[current] = 10.0;              // A
  if (parameters_.elastic_gear) {
    scales[deflection] = 1.0;     // rad
    scales[motor_speed] = 100.0;  // rad/s
  }
  if (has_modes()) scales[mode_index()] = 1.0;  // never changes within a step
}

double DetailedDrive::friction_speed(double qd, const double* z) const {
  return parameters_.elastic_gear ? z[motor_speed] : qd;
}

double DetailedDrive::friction_acceleration(double, double qd, double qdd, const double* z) const {
  const DetailedDriveParameters& p = parameters_;
  if (!p.elastic_gear) return qdd;
  const FrictionMode present = mode(z);
  if (present == FrictionMode::stuck) return 0.0;
  return (p.motor_constant_N_m_per_A * z[current] + spring_torque(qd, z) -
          p.friction.torque(present, z[motor_speed])) /
         p.motor_inertia_kg_m2;
}

double DetailedDrive::stuck_torque(double, double qd, double holding_torque, const double* z) const {
  if (!parameters_.elastic_gear)
    return -holding_torque;  // the holding torque is friction's torque on the joint
  return parameters_.motor_constant_N_m_per_A * z[current] + spring_torque(qd, z);
}

DriveSample DetailedDrive::sample(const JointReference&, double q, double qd, double holding_torque,
                                  const double* z) const {
  const DetailedDriveParameters& p = parameters_;
  DriveSample sample;
  sample.has_motor = true;
  sample.motor_current_A = z[current];
  sample.motor_voltage_V = -p.power_stage_gain * z[current_controller];
  sample.motor_speed_rad_per_s = motor_speed_of(qd, z);
  sample.motor_torque_N_m = p.motor_constant_N_m_per_A * z[current];
  sample.gear_deflection_rad = p.elastic_gear ? z[deflection] : 0.0;
  sample.friction_mode = mode(z);
  sample.friction_torque_N_m = has_modes() && sample.friction_mode == FrictionMode::stuck
                                   ? stuck_torque(q, qd, holding_torque, z)
                                   : p.friction.torque(sample.friction_mode, friction_speed(qd, z));
  sample.electrical_power_W = sample.motor_voltage_V * sample.motor_current_A;
  return sample;
}

}  // namespace takt

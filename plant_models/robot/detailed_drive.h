#pragma once
// A detailed drivetrain (thesis 5.3): cascade control, a current-controlled motor with its electrical side,
// the rotor, a gear that is elastic or rigid, and bearing friction. Equations as in the r3 robot of the
// Modelica Standard Library; n gear ratio, phi_m and om_m angle and speed of the motor:
//
//   controller   u = n qd_ref + kp (n q_ref - phi_m) - om_m          [rad/s]
//                x' = u / Ts,   i_ref = ks (x + u) + tau_ff / (n k)  [x: rad/s, A]
//                n q takes the place of phi_m in u where the position is measured at the joint;
//                tau_ff, at the joint, is the feed-forward of the reference (not in the r3 robot; 0 without);
//                without position control i_ref = tau_ff / (n k), x' = 0
//   current      vC' = (i - i_ref) w R / (2 g D),  L = R / (2 D w)   [vC: V]
//                L i' = -g vC - R i - k om_m
//   elastic      psi = n q - phi_m,  tau_s = c psi + d (n qd - om_m)
//                J om_m' = k i + tau_s - tau_f(om_m),  joint torque -n tau_s
//   rigid        phi_m = n q,  joint torque n k i - tau_f(qd) - n^2 J qdd
//
// w and D are natural frequency and damping of the current loop, g the gain of the power stage (-g vC is the
// motor's voltage). Friction acts on the motor shaft where the gear is elastic, on the joint where it is
// rigid.
//
// States z: x, vC, i, then psi and om_m if the gear is elastic, then the friction mode if there are modes.
// (The motor's own speed, not the speed of the spring: so the drive's derivatives do not need the joint's
// acceleration, and a stuck shaft is a state that is exactly zero.)
#include "plant_models/robot/drive.h"

namespace takt {

struct DetailedDriveParameters {
  bool elastic_gear = false;
  double gear_ratio = 1.0;                  ///< n, motor per joint; any sign
  double motor_inertia_kg_m2 = 0.0;         ///< J
  double motor_constant_N_m_per_A = 0.0;    ///< k, also V s/rad
  double current_loop_rad_per_s = 0.0;      ///< w
  double current_loop_damping = 0.0;        ///< D
  double resistance_ohm = 0.0;              ///< R
  double power_stage_gain = 5.0;            ///< g
  double gear_stiffness_N_m_per_rad = 0.0;  ///< c, on the motor side; elastic gear only
  double gear_damping_N_m_s_per_rad = 0.0;  ///< d, on the motor side
  FrictionParameters friction;
  double position_gain_per_s = 0.0;    ///< kp
  double speed_gain_As_per_rad = 0.0;  ///< ks
  double speed_integral_time_s = 0.0;  ///< Ts
  /// True: the position is measured by a second encoder at the joint instead of the motor's, and the wind-up
  /// of an elastic gear is controlled away. The speed is the motor's in both cases.
  bool position_at_joint = false;

  double inductance_H() const {
    return resistance_ohm / (2.0 * current_loop_damping * current_loop_rad_per_s);
  }
};

class DetailedDrive final : public Drive {
 public:
  /// Throws std::invalid_argument naming the parameter and the value found.
  explicit DetailedDrive(const DetailedDriveParameters& parameters);

  int state_count() const override { return (parameters_.elastic_gear ? 5 : 3) + (has_modes() ? 1 : 0); }
  bool has_motor() const override { return true; }
  double armature() const override;
  void initial_state(const JointReference& reference, double tau, double* z) const override;
  DriveOutput output(const JointReference& reference, double q, double qd, const double* z) const override;
  void derivatives(const JointReference& reference, double q, double qd, const double* z,
                   double* zdot) const override;
  void set_integral(double torque, double* z) const override;
  DrivePattern pattern() const override;
  void jacobian(const JointReference& reference, double q, double qd, const double* z,
                DriveJacobian& J) const override;
  void time_derivative(const JointReference& reference, double q, double qd, const double* z,
                       DriveRate& rate) const override;
  void state_scales(double* scales) const override;
  DriveSample sample(const JointReference& reference, double q, double qd, double holding_torque,
                     const double* z) const override;

  bool has_modes() const override { return parameters_.friction.has_modes(); }
  FrictionMode mode(const double* z) const override;
  int mode_state() const override { return mode_index(); }
  void set_mode(FrictionMode mode, double& qd, double* z) const override;
  double friction_speed(double qd, const double* z) const override;
  double friction_acceleration(double q, double qd, double qdd, const double* z) const override;
  double stuck_torque(double q, double qd, double holding_torque, const double* z) const override;
  double break_away_torque() const override { return parameters_.friction.break_away_torque(); }
  const DetailedDriveParameters& parameters() const { return parameters_; }

  /// Places in z.
  enum State : int { integrator = 0, current_controller = 1, current = 2, deflection = 3, motor_speed = 4 };

 private:
  int mode_index() const { return parameters_.elastic_gear ? 5 : 3; }
  double spring_torque(double qd, const double* z) const;
  double motor_speed_of(double qd, const double* z) const;
  /// Of the motor, for this torque at the joint.
  double current_A(double torque) const;
  DetailedDriveParameters parameters_;
};

}  // namespace takt

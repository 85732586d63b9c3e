#pragma once
// A simplified drive (thesis 5.1: "simplified models of the drivetrains and controls"): cascade of a P
// position and a PI speed controller, the motor's inertia behind a rigid gear, no friction, an ideal torque
// source.
//
//   u   = qd_ref - qd + kp (q_ref - q)                          [rad/s]
//   tau = I (kv (u + x / Ti) + qdd_ref) + tau_ff, limited to max_torque  [N m, at the joint]
//   x'  = u + (limited tau - tau) / (I kv)                      [x: rad]
//
// I is the inertia for which the gains are designed: the reflected rotor n^2 J plus a nominal load. The last
// term of x' prevents wind-up of the integrator at the limit. The integrator carries the weight, so there is
// no deviation at rest; tau_ff is the feed-forward of the reference (0 without one), whose error the
// integrator compensates. Without position control tau = tau_ff, limited, and x' = 0.
#include "plant_models/robot/drive.h"

namespace takt {

struct SimplifiedDriveParameters {
  double gear_ratio = 1.0;           ///< n, motor per joint; any sign, not zero
  double rotor_inertia_kg_m2 = 0.0;  ///< J of the motor
  double load_inertia_kg_m2 = 0.0;   ///< nominal, at the joint; only the gains depend on it
  double position_gain_per_s = 0.0;  ///< kp
  double speed_gain_per_s = 0.0;     ///< kv
  double integral_time_s = 0.0;      ///< Ti
  double max_torque = std::numeric_limits<double>::infinity();  ///< at the joint

  double armature() const { return gear_ratio * gear_ratio * rotor_inertia_kg_m2; }
  double inertia() const { return armature() + load_inertia_kg_m2; }
  /// Gains for a position bandwidth w: kp = w, kv = 6 w, Ti = 3 / w. The closed loop
  /// s^3 + 6 w s^2 + 8 w^2 s + 2 w^3 has real poles only (-0.32 w, -1.46 w, -4.21 w); with three times the
  /// inertia I its damping ratio is 0.58, with a third all poles are real again, the fastest at -16.6 w. An
  /// explicit solver of order two then needs steps below 2 / (16.6 w): 1 ms up to w = 120 rad/s.
  void set_bandwidth(double w);
};

class SimplifiedDrive final : public Drive {
 public:
  /// Throws std::invalid_argument naming the parameter: gains, inertia and limit must be positive.
  explicit SimplifiedDrive(const SimplifiedDriveParameters& parameters);
  int state_count() const override { return 1; }
  double armature() const override { return parameters_.armature(); }
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
  DriveSample sample(const JointReference& reference, double q, double qd, double holding_torque,
                     const double* z) const override;
  const SimplifiedDriveParameters& parameters() const { return parameters_; }

 private:
  struct Control {
    double u, torque, limited_torque;
  };
  Control control(const JointReference& reference, double q, double qd, double x) const;
  SimplifiedDriveParameters parameters_;
};

}  // namespace takt

#pragma once
// The drive of one joint: from reference motion to joint torque. Exchangeable models behind one interface:
// an ideal position servo, a simplified drive (thesis 5.1), a detailed drivetrain (thesis 5.3; equations of
// the r3 robot), and the torque of a device. A drive owns a few states z of the robot's state segment.
//
// A drive's torque on its joint is
//   tau = output.torque - armature() * qdd + (holding torque)
// The armature is part of the joint's inertia. A joint is held by friction that sticks on the joint side (its
// acceleration is zero) or by a servo that prescribes the acceleration. The dynamics of the whole arm
// determine the holding torques, because joints held in this way are coupled through it.
//
// The mode of true friction is kept in z, as a number with derivative zero: so the state vector is the whole
// state, and every function is pure. Only set_mode() changes it, at accepted points.
#include <limits>

#include "plant_models/robot/friction.h"

namespace takt {

/// Reference of a joint's controller at one time.
struct JointReference {
  double q = 0.0, qd = 0.0, qdd = 0.0;  ///< rad, rad/s, rad/s^2 (m for prismatic)
  /// Torque that the sender of set-points adds to that of the controller, at the joint and in the sense of q
  /// (N m or N). Constant during a step: it enters no Jacobian and no rate.
  double feed_forward = 0.0;
  /// Torque of a device on the joint (ArmMotion::applied). Constant during a step too.
  double applied = 0.0;
  /// False: the drive's torque is `feed_forward` alone, within its limit, and its controller rests.
  bool position_control = true;
};

struct DriveOutput {
  double torque = 0.0;       ///< on the joint, without armature and holding torque (N m or N)
  bool locks_joint = false;  ///< friction sticks on the joint side
  /// The joint moves with `acceleration` if that takes at most `max_holding_torque`; else this torque drives
  /// it.
  bool prescribes_acceleration = false;
  double acceleration = 0.0;  ///< rad/s^2
  double max_holding_torque = std::numeric_limits<double>::infinity();
  double electrical_power_W = 0.0;  ///< u i of the motor
};

/// Observable quantities of a drive.
struct DriveSample {
  double motor_current_A = 0.0;
  double motor_voltage_V = 0.0;
  double motor_speed_rad_per_s = 0.0;
  double motor_torque_N_m = 0.0;     ///< of the motor on its shaft
  double gear_deflection_rad = 0.0;  ///< n q - phi_m, on the motor side
  double friction_torque_N_m = 0.0;  ///< against motion, on the side where the friction is
  FrictionMode friction_mode = FrictionMode::forward;
  double electrical_power_W = 0.0;  ///< u i of the motor model, 0 without one
  bool has_motor = false;
};

/// Partial derivatives for linearly implicit solvers, of the drive's derivatives and torque with respect to
/// its own states z and to q, qd. Of a drive that prescribes the acceleration, `torque_*` are the
/// derivatives of the acceleration instead.
struct DriveJacobian {
  static constexpr int kMaxStates = 6;
  double dz_dz[kMaxStates][kMaxStates] = {};
  double dz_dq[kMaxStates] = {}, dz_dqd[kMaxStates] = {};
  double torque_dz[kMaxStates] = {};
  double torque_dq = 0.0, torque_dqd = 0.0;
};

/// Rates of a drive's derivatives and torque (of one that prescribes the acceleration: of that) due to the
/// moving reference alone, at equal states.
struct DriveRate {
  double zdot[DriveJacobian::kMaxStates] = {};
  double torque = 0.0;
};

/// The derivatives that can be nonzero. Those of torque with respect to q and qd always may be.
struct DrivePattern {
  bool dz_dz[DriveJacobian::kMaxStates][DriveJacobian::kMaxStates] = {};
  bool dz_dq[DriveJacobian::kMaxStates] = {}, dz_dqd[DriveJacobian::kMaxStates] = {};
  bool torque_dz[DriveJacobian::kMaxStates] = {};
};

class Drive {
 public:
  virtual ~Drive() = default;
  virtual int state_count() const = 0;  ///< at most DriveJacobian::kMaxStates
  /// True if the applied torque is that of the drive; else it acts on the joint besides the drive.
  virtual bool passes_applied_torque() const { return false; }
  /// True if the drive models the electrical side: DriveOutput::electrical_power_W.
  virtual bool has_motor() const { return false; }
  /// Inertia rigidly geared to the joint (kg m^2 or kg); constant.
  virtual double armature() const { return 0.0; }
  /// States in equilibrium with the motion `reference`. They give the joint torque `tau` in addition to
  /// friction and to the armature's torque at the acceleration reference.qdd; reference.feed_forward is a
  /// part of it. At rest true friction sticks with zero torque, so `tau` is the torque that holds the arm.
  virtual void initial_state(const JointReference& reference, double tau, double* z) const = 0;

  virtual DriveOutput output(const JointReference& reference, double q, double qd, const double* z) const = 0;
  virtual void derivatives(const JointReference& reference, double q, double qd, const double* z,
                           double* zdot) const = 0;
  /// False: set-points and their torques have no effect.
  virtual bool takes_torques() const { return true; }
  /// Sets the integral part of the position control to this torque at the joint (N m or N), from which
  /// control begins after a time without it.
  virtual void set_integral(double /*torque*/, double* /*z*/) const {}

  virtual DrivePattern pattern() const = 0;
  /// Adds to a J that the caller has cleared.
  virtual void jacobian(const JointReference& reference, double q, double qd, const double* z,
                        DriveJacobian& J) const = 0;
  /// Adds to a rate that the caller has cleared. The reference's position moves with qd, its velocity with
  /// qdd; its acceleration is taken as constant.
  virtual void time_derivative(const JointReference& /*reference*/, double /*q*/, double /*qd*/,
                               const double* /*z*/, DriveRate& /*rate*/) const {}
  /// Typical sizes of the states z (PlantModel::state_scales).
  virtual void state_scales(double* scales) const {
    for (int i = 0; i < state_count(); ++i) scales[i] = 1.0;
  }
  /// `holding_torque`: from the arm's dynamics.
  virtual DriveSample sample(const JointReference& reference, double q, double qd, double holding_torque,
                             const double* z) const = 0;

  // True friction. Drives without modes keep the defaults.

  virtual bool has_modes() const { return false; }
  virtual FrictionMode mode(const double*) const { return FrictionMode::forward; }
  virtual int mode_state() const { return -1; }  ///< its place in z
  /// Sets the mode; sticking sets the speed that sticks (the joint's or the motor's) to exactly zero.
  virtual void set_mode(FrictionMode, double& /*qd*/, double* /*z*/) const {}
  virtual double friction_speed(double /*qd*/, const double* /*z*/) const { return 0.0; }
  /// Its derivative in the present mode, for a joint that accelerates with qdd.
  virtual double friction_acceleration(double /*q*/, double /*qd*/, double /*qdd*/, const double*) const {
    return 0.0;
  }
  /// Torque that keeps the friction stuck, given the holding torque from the arm's dynamics.
  virtual double stuck_torque(double /*q*/, double /*qd*/, double /*holding_torque*/, const double*) const {
    return 0.0;
  }
  virtual double break_away_torque() const { return std::numeric_limits<double>::infinity(); }

  /// A stuck drive is released at this multiple of its break-away torque. A torque that settles at break-away
  /// itself would otherwise release and stop it in endless alternation, by rounding and the solver's
  /// tolerance.
  static constexpr double kReleaseShare = 1.0 + 1e-6;

  /// Positive as long as the present mode is valid: the margin to break-away, or the speed in the direction
  /// of sliding.
  double indicator(double q, double qd, double holding_torque, const double* z) const {
    const FrictionMode present = mode(z);
    if (present == FrictionMode::stuck)
      return kReleaseShare * break_away_torque() - std::abs(stuck_torque(q, qd, holding_torque, z));
    return static_cast<double>(present) * friction_speed(qd, z);
  }
};

}  // namespace takt

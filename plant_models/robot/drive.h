#pragma once
// The drive of one joint: from reference motion to joint torque. Exchangeable models behind one interface:
// an ideal position servo, a simplified drive (thesis 5.1), a detailed drivetrain (thesis 5.3; equations of
// the r3 robot). A drive owns a few states z of the robot's state segment.
//
// A drive's torque on its joint is
//   tau = output.torque - output.armature * qdd + (friction that sticks on the joint side)
// The armature enters the joint's inertia; friction that sticks on the joint side locks the joint, and its
// torque comes back from the dynamics of the whole arm (stuck joints are coupled through it).
#include <memory>
#include <string>

namespace takt {

/// What the controller of a joint wants at one time.
struct JointReference {
  double q = 0.0, qd = 0.0, qdd = 0.0;  ///< rad, rad/s, rad/s^2 (m for prismatic)
};

/// Modes of true Coulomb friction: switched between accepted steps only.
enum class FrictionMode : signed char { backward = -1, stuck = 0, forward = 1 };

struct DriveOutput {
  double torque = 0.0;       ///< on the joint, without armature and sticking friction (N m or N)
  double armature = 0.0;     ///< inertia rigidly geared to the joint (kg m^2 or kg); constant
  bool locks_joint = false;  ///< friction sticks on the joint side
};

/// What may be observed of a drive, for outputs and power.
struct DriveSample {
  double motor_current_A = 0.0;
  double motor_voltage_V = 0.0;
  double motor_speed_rad_per_s = 0.0;
  double motor_torque_Nm = 0.0;
  double gear_deflection_rad = 0.0;  ///< n q - phi_m, on the motor side
  double friction_torque_Nm = 0.0;
  FrictionMode friction_mode = FrictionMode::forward;
  double electrical_power_W = 0.0;  ///< u i of the motor model, 0 where there is none
  bool has_motor = false;
};

/// Partial derivatives for linearly implicit solvers: of the drive's derivatives and torque with respect to
/// its own states z and to q, qd. Row-major, kMaxStates wide.
struct DriveJacobian {
  static constexpr int kMaxStates = 6;
  double dz_dz[kMaxStates][kMaxStates] = {};
  double dz_dq[kMaxStates] = {}, dz_dqd[kMaxStates] = {};
  double torque_dz[kMaxStates] = {};
  double torque_dq = 0.0, torque_dqd = 0.0;
};

class Drive {
 public:
  virtual ~Drive() = default;
  virtual int state_count() const = 0;  ///< at most DriveJacobian::kMaxStates
  /// States at rest at `reference`, carrying the joint torque `tau` (what the arm needs to hold still).
  virtual void initial_state(const JointReference& reference, double tau, double* z) const = 0;

  virtual DriveOutput output(const JointReference& reference, double q, double qd, const double* z) const = 0;
  virtual void derivatives(const JointReference& reference, double q, double qd, double qdd, const double* z,
                           double* zdot) const = 0;
  virtual void jacobian(const JointReference& reference, double q, double qd, const double* z,
                        DriveJacobian& J) const = 0;
  /// `tau_lock`: torque of friction that sticks on the joint side, from the arm's dynamics.
  virtual DriveSample sample(const JointReference& reference, double q, double qd, double tau_lock,
                             const double* z) const = 0;

  // True friction: one function whose sign change ends the present mode, and the decision between accepted
  // steps. Drives without modes keep the defaults.
  virtual bool has_modes() const { return false; }
  /// Positive while the present mode holds.
  virtual double indicator(const JointReference& reference, double q, double qd, double tau_lock,
                           const double* z) const {
    static_cast<void>(reference), static_cast<void>(q), static_cast<void>(qd), static_cast<void>(tau_lock),
        static_cast<void>(z);
    return 1.0;
  }
};

}  // namespace takt

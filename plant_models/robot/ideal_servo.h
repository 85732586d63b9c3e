#pragma once
// An ideal position servo: the joint's acceleration is
//   qdd = qdd_ref + 2 w (qd_ref - qd) + w^2 (q_ref - q)
// whatever hangs on it, so the error decays critically damped with the servo's frequency w and the load has
// no influence on the motion. The torque is what the arm's dynamics need for that (computed torque). With a
// limit to the torque the joint yields where the limit is reached: then it is driven by just that much. This
// is also the servo of a gripper's jaws: position control until the grip force is reached. A feed-forward of
// the reference changes nothing: what it is for, the servo has from the dynamics already.
//
// Without velocity feed-forward qd_ref is taken as zero: the joint follows a reference of constant speed 2/w
// late, and where the reference sets off or stops at once the acceleration has no jump.
//
// Explicit solvers of order two are stable for steps up to 2 / w.
#include "plant_models/robot/drive.h"

namespace takt {

struct IdealServoParameters {
  double frequency_rad_per_s = 100.0;                           ///< w
  double max_torque = std::numeric_limits<double>::infinity();  ///< N m or N
  bool velocity_feed_forward = true;
};

class IdealServo final : public Drive {
 public:
  /// Throws std::invalid_argument for a frequency or limit that is not positive.
  explicit IdealServo(const IdealServoParameters& parameters);
  int state_count() const override { return 0; }
  void initial_state(const JointReference&, double, double*) const override {}
  DriveOutput output(const JointReference& reference, double q, double qd, const double* z) const override;
  void derivatives(const JointReference&, double, double, const double*, double*) const override {}
  DrivePattern pattern() const override { return {}; }
  void jacobian(const JointReference& reference, double q, double qd, const double* z,
                DriveJacobian& J) const override;
  void time_derivative(const JointReference& reference, double q, double qd, const double* z,
                       DriveRate& rate) const override;
  DriveSample sample(const JointReference& reference, double q, double qd, double holding_torque,
                     const double* z) const override;

 private:
  IdealServoParameters parameters_;
};

}  // namespace takt

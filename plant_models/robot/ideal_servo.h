#pragma once
// An ideal position servo: the joint's acceleration is
//   qdd = qdd_ref + 2 w (qd_ref - qd) + w^2 (q_ref - q)
// for any load, so the error decays critically damped with the servo's frequency w and the load has no
// influence on the motion. The arm's dynamics give the torque for it (computed torque). With a torque limit
// the joint yields at the limit, which then drives it. This is also the servo of a gripper's jaws: position
// control up to the grip force. A feed-forward of the reference has no effect, because the computed torque
// includes it; without position control it is the servo's torque, up to the limit.
//
// Without velocity feed-forward qd_ref is taken as zero: the joint follows a reference of constant speed with
// a delay of 2/w, and the acceleration is continuous at sudden starts and stops of the reference.
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

#pragma once
// A drive without a controller of takt: its torque is that which a device gives, limited to the largest one, and the rotor
// behind a rigid gear is a part of the joint's inertia. Set-points of the joint have no effect.
#include "plant_models/robot/drive.h"

namespace takt {

struct SignalDriveParameters {
  double armature = 0.0;                                        ///< kg m^2 or kg, at the joint
  double max_torque = std::numeric_limits<double>::infinity();  ///< N m or N, at the joint
};

class SignalDrive final : public Drive {
 public:
  /// Throws std::invalid_argument for a negative armature, or a limit that is not positive.
  explicit SignalDrive(const SignalDriveParameters& parameters);
  int state_count() const override { return 0; }
  bool passes_applied_torque() const override { return true; }
  bool takes_torques() const override { return false; }
  double armature() const override { return parameters_.armature; }
  void initial_state(const JointReference&, double, double*) const override {}
  DriveOutput output(const JointReference& reference, double q, double qd, const double* z) const override;
  void derivatives(const JointReference&, double, double, const double*, double*) const override {}
  DrivePattern pattern() const override { return {}; }
  void jacobian(const JointReference&, double, double, const double*, DriveJacobian&) const override {}
  DriveSample sample(const JointReference& reference, double q, double qd, double holding_torque,
                     const double* z) const override;

 private:
  SignalDriveParameters parameters_;
};

}  // namespace takt

#pragma once
// A Part: a free rigid body. It never gains or loses states; being held is a matter of wrenches alone.
//
// State (13): p_WBcm (m), q_WB as w x y z (-), v_WBcm (m/s), w_WB (rad/s), all in the world frame. The centre
// of mass is the reference point, so translation and rotation decouple. The quaternion's length is held at 1
// by a stabilising term in its derivative, not by projection: projecting would force multi-step solvers to
// restart.
#include "plant_models/plant_model.h"

namespace takt {

struct RigidBodyParameters {
  int body = -1;               ///< component id
  double mass_kg = 0.0;        ///< > 0
  Vec3 p_BBcm = Vec3::Zero();  ///< centre of mass in B (m)
  /// Inertia about the centre of mass, axes of B (kg m^2), positive definite.
  Mat3 I_BBcm_B = Mat3::Identity();
  Vec3 gravity_W = Vec3::Zero();  ///< m/s^2
  Pose X_WB_initial;
  Twist V_WB_initial{};  ///< of the origin of B
};

class RigidBody final : public PlantModel {
 public:
  static constexpr int kStates = 13;

  explicit RigidBody(const RigidBodyParameters& parameters);
  int state_count() const override { return kStates; }
  int body() const override { return parameters_.body; }
  void initial_state(double* x) const override;
  /// The states of this pose and twist (of the origin of B).
  void set_state(const Pose& X_WB, const Twist& V_WB, double* x) const;
  void write_motion(double t, const double* x, CellMotion& motion) const override;
  void derivatives(double t, const double* x, const CellMotion& motion, std::span<const Wrench> wrenches,
                   double* xdot) const override;
  /// At a tolerance of 1e-4 no point of the Part is off by more than about 0.5 um and 5 um/s per step: a two-hundredth of the
  /// speed at which regularised friction holds, so that forces of contacts are right too.
  void state_scales(double* scales) const override;
  int absolute_states() const override { return kStates; }
  /// Velocities v, w; the gyroscopic torque is left out.
  std::unique_ptr<VelocityForm> make_velocity_form() const override;
  /// Rate at which a quaternion's length error decays (1/s). Large enough to follow any drift, small against
  /// the substitute springs (313 1/s), so that it never limits the step.
  static constexpr double kQuaternionStabilisation = 50.0;
  const RigidBodyParameters& parameters() const { return parameters_; }

 private:
  RigidBodyParameters parameters_;
  Mat3 I_inverse_B_;
  Vec3 weight_W_;  ///< m g
};

/// Kinetic plus gravitational energy (J), potential zero at the world origin.
double mechanical_energy(const RigidBodyParameters& parameters, const double* x);

}  // namespace takt

#pragma once
// The dynamics of an arm from the text of its URDF file: mass matrix, Coriolis and centrifugal torques; and the time
// derivative of a Jacobian. Joint positions are those of the protocol. Rotors of drives are no part of a URDF file.
#include <optional>
#include <string>

#include "client_lib/gateway/ur/path.h"
#include "plant_models/mechanics/multibody_tree.h"

namespace takt::ur {

using Matrix6 = Eigen::Matrix<double, 6, 6>;

class RobotDynamics {
 public:
  /// `arm`: six revolute joints with the names of the file; their links' frames are those of the file at any zero and sign of
  /// the protocol's joints. Throws nothing: the functions below do.
  RobotDynamics(const std::string& urdf, const ArmModel& arm);

  /// kg m^2. `payload`: in the flange's frame. Both throw std::invalid_argument with the reason: a URDF file without the masses
  /// of moving links, an inertia that is not physical.
  Matrix6 mass_matrix(const Vector6& q, const BodyInertia& payload) const;
  /// N m, without gravity.
  Vector6 coriolis_torques(const Vector6& q, const Vector6& qd, const BodyInertia& payload) const;

 private:
  MultibodyTree tree(const BodyInertia& payload) const;

  TreeModel links_;  ///< no gravity
  Pose X_JF_;        ///< flange in the last link
  std::string problem_;
};

/// The time derivative of the Jacobian of a chain of revolute joints at joint speeds. Column j of `J`: the twist at a rate of
/// 1 rad/s of joint j, linear first, in the axes of one frame that stands.
Matrix6 jacobian_rate(const Matrix6& J, const Vector6& qd);

}  // namespace takt::ur

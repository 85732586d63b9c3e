#pragma once
// Kinematics of a serial arm: pose, twist and Jacobian of the flange from joint positions and velocities.
//
// Frames: R is the robot's base frame, J_i the frame of joint i (which coincides with child link i), F the
// flange. The joint's own motion is a rotation (revolute) about, or a translation (prismatic) along, `axis`
// given in J_i; X_PJ places J_i in its parent link at joint position zero. This is the URDF convention.
#include <array>
#include <string>
#include <vector>

#include "plant_models/spatial.h"
#include "takt_enumerations.h"

namespace takt {

/// Upper bound for the moving joints of one robot: commands and samples are fixed-size, so that no step
/// allocates.
inline constexpr int kMaxJoints = 16;
using JointArray = std::array<double, kMaxJoints>;

struct JointModel {
  std::string name;
  JointType type = JointType::revolute;
  Pose X_PJ;                  ///< joint frame in the parent link at position zero
  Vec3 axis = Vec3::UnitZ();  ///< unit vector in the joint frame
  double lower = 0.0;         ///< rad or m
  double upper = 0.0;         ///< rad or m
  double max_velocity = 0.0;  ///< rad/s or m/s
  double max_effort = 0.0;    ///< N m or N
};

/// A serial chain from base R to flange F; constant after loading.
struct ArmModel {
  std::vector<JointModel> joints;
  Pose X_JF;  ///< flange in the frame of the last joint
  int joint_count() const { return static_cast<int>(joints.size()); }
};

/// Joint frames in base R; `link[i]` is X_RJi after joint i's own motion.
struct ArmPoses {
  std::array<Pose, kMaxJoints> link;
  Pose X_RF;
};

/// Columns j of the geometric Jacobian: rows 0-2 linear velocity of the flange origin, rows 3-5 angular
/// velocity, both in R.
using ArmJacobian = Eigen::Matrix<double, 6, Eigen::Dynamic, 0, 6, kMaxJoints>;

/// Position kinematics. `q` holds joint_count() values.
void forward_kinematics(const ArmModel& arm, const double* q, ArmPoses& poses);

/// Twist of the flange in R for joint velocities `qd`, at the poses of forward_kinematics().
Twist flange_twist(const ArmModel& arm, const ArmPoses& poses, const double* qd);

/// Geometric Jacobian of the flange at the poses of forward_kinematics().
ArmJacobian flange_jacobian(const ArmModel& arm, const ArmPoses& poses);

}  // namespace takt

#include "plant_models/robot/arm_kinematics.h"

#include <cmath>

namespace takt {

namespace {
/// Rotation by `angle` about a unit axis (Rodrigues), without the temporary quaternion of Eigen's AngleAxis
/// product.
Mat3 axis_rotation(const Vec3& axis, double angle) {
  const double c = std::cos(angle);
  const double s = std::sin(angle);
  const Vec3 a = axis * (1.0 - c);
  Mat3 R;
  R << a.x() * axis.x() + c, a.x() * axis.y() - s * axis.z(), a.x() * axis.z() + s * axis.y(),
      a.y() * axis.x() + s * axis.z(), a.y() * axis.y() + c, a.y() * axis.z() - s * axis.x(),
      a.z() * axis.x() - s * axis.y(), a.z() * axis.y() + s * axis.x(), a.z() * axis.z() + c;
  return R;
}
}  // namespace

void forward_kinematics(const ArmModel& arm, const double* q, ArmPoses& poses) {
  Pose X_RP;
  for (int i = 0; i < arm.joint_count(); ++i) {
    const JointModel& joint = arm.joints[static_cast<size_t>(i)];
    Pose& X_RJ = poses.link[static_cast<size_t>(i)];
    X_RJ = X_RP * joint.X_PJ;
    if (joint.type == JointType::revolute) {
      X_RJ.R = X_RJ.R * axis_rotation(joint.axis, q[i]);
    } else {
      X_RJ.p += X_RJ.R * joint.axis * q[i];
    }
    X_RP = X_RJ;
  }
  poses.X_RF = X_RP * arm.X_JF;
}

Twist flange_twist(const ArmModel& arm, const ArmPoses& poses, const double* qd) {
  Twist V_RF;
  for (int i = 0; i < arm.joint_count(); ++i) {
    const JointModel& joint = arm.joints[static_cast<size_t>(i)];
    const Pose& X_RJ = poses.link[static_cast<size_t>(i)];
    const Vec3 axis_R = X_RJ.R * joint.axis * qd[i];
    if (joint.type == JointType::revolute) {
      V_RF.w += axis_R;
      V_RF.v += axis_R.cross(poses.X_RF.p - X_RJ.p);
    } else {
      V_RF.v += axis_R;
    }
  }
  return V_RF;
}

ArmJacobian flange_jacobian(const ArmModel& arm, const ArmPoses& poses) {
  ArmJacobian J(6, arm.joint_count());
  for (int i = 0; i < arm.joint_count(); ++i) {
    const JointModel& joint = arm.joints[static_cast<size_t>(i)];
    const Pose& X_RJ = poses.link[static_cast<size_t>(i)];
    const Vec3 axis_R = X_RJ.R * joint.axis;
    if (joint.type == JointType::revolute) {
      J.col(i) << axis_R.cross(poses.X_RF.p - X_RJ.p), axis_R;
    } else {
      J.col(i) << axis_R, Vec3::Zero();
    }
  }
  return J;
}

}  // namespace takt

#pragma once
// Denavit-Hartenberg parameters of a robot with six revolute joints, computed from its axes.
//
// Convention (classic): T_i = Rz(q_i + theta_i) Tz(d_i) Tx(a_i) Rx(alpha_i), from frame i-1 on the axis of joint i to frame
// i. Parallel axes leave d free; it is 0 there. Of the two directions of a common normal the one with the smaller theta
// is taken, so that a robot whose parameters are published with theta 0 gets these (a negative for Universal Robots).
#include "client_lib/gateway/rtde/primary.h"
#include "plant_models/robot/arm_kinematics.h"

namespace takt::ur {

struct DhArm {
  rtde::DhParameters parameters;
  Pose X_R0;  ///< frame 0 in the robot's base R
  Pose X_6F;  ///< the flange in frame 6
};

/// Exact to rounding: X_R0 T_1 ... T_6 X_6F is the flange for all joint positions. `arm` has six revolute joints.
DhArm dh_parameters(const ArmModel& arm);

}  // namespace takt::ur

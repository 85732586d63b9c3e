// Observable quantities of a robot at one instant.
#include "plant_models/robot/dynamic_robot_impl.h"

namespace takt {

DynamicRobot::Output DynamicRobot::output(double t, const double* x, const CellMotion& motion,
                                          std::span<const Wrench> wrenches) const {
  Impl& m = *impl_;
  Impl::Solution& s = m.solution;
  m.solve(t, x, motion, wrenches, s);
  const int n = m.joints;
  Output output;
  output.power.electrical_W = parameters_.power.idle_W;
  for (int i = 0; i < n; ++i) {
    const auto k = static_cast<size_t>(i);
    output.acceleration[k] = s.qdd[k];
    output.torque[k] = s.torque(i, m.tree.model().joints[k].armature);
    output.drives[k] = m.drive(i).sample(s.reference[k], x[i], x[n + i], s.holding[k], m.drive_states(x, i));
    const double power = output.torque[k] * x[n + i];
    output.power.mechanical_W[k] = power;
    output.power.mechanical_total_W += power;
    output.power.electrical_W += m.supplied(parameters_.power, i, m.taken(i, s.output[k], power));
  }
  output.power.mechanical_energy_J = x[energy_state()];

  const Mat3& R_WR = m.base.X_WR.R;
  const Wrench base = m.tree.base_reaction(m.w);
  output.base_reaction_W = {R_WR * base.f, R_WR * base.t};

  // The flange carries the palm's and jaws' inertia and weight less the external forces on them.
  const int last = m.arm - 1;
  const Pose X_RL = m.tree.link_pose(last, m.w);
  const Twist A_RL = m.tree.link_acceleration(last, m.w);
  const Vec3 w_R = m.tree.link_twist(last, m.w).w;
  const Vec3 p_RF = X_RL * parameters_.arm.X_JF.p;
  Wrench on_gripper_R;  // by the flange, about its origin
  const auto add = [&](const Vec3& f, const Vec3& moment, const Vec3& p_R) {
    on_gripper_R += {f, moment + (p_R - p_RF).cross(f)};
  };
  int jaw = m.arm;
  for (size_t g = 0; g < m.grippers.size(); ++g) {
    const ParallelGripperParameters& p = m.grippers[g]->parameters();
    const BodyInertia& palm = parameters_.grippers[g].palm;
    const Pose X_RG = X_RL * (parameters_.arm.X_JF * p.X_FG);
    const Vec3 p_RGcm = X_RG * palm.p_BBcm_B;
    const Vec3 r = p_RGcm - X_RL.p;
    const Vec3 a = A_RL.v + A_RL.w.cross(r) + w_R.cross(w_R.cross(r));
    const Mat3 I = X_RG.R * palm.I_BBcm_B * X_RG.R.transpose();
    add(palm.mass_kg * (a - m.tree.gravity(m.w)), I * A_RL.w + w_R.cross(I * w_R), p_RGcm);
    const auto body = static_cast<size_t>(p.palm);
    const Vec3 p_R = R_WR.transpose() * (motion.bodies[body].p_WBcm - m.base.X_WR.p);
    add(-(R_WR.transpose() * wrenches[body].f), -(R_WR.transpose() * wrenches[body].t), p_R);
    for (int side = 0; side < 2; ++side, ++jaw) {
      const Wrench F = m.tree.joint_wrench(jaw, m.w);
      add(F.f, F.t, m.tree.link_pose(jaw, m.w).p);
    }
  }
  output.flange_load_W = {-(R_WR * on_gripper_R.f), -(R_WR * on_gripper_R.t)};
  return output;
}

double DynamicRobot::electrical_energy_J(double h, const double* before, const double* after) const {
  const Impl& m = *impl_;
  double energy_J = parameters_.power.idle_W * h;
  for (int i = 0; i < m.joints; ++i) {
    const int state = energy_state() + 1 + i;
    energy_J += m.supplied(parameters_.power, i, after[state] - before[state]);
  }
  return energy_J;
}

// The mass matrix is at least J^T m J + A, with m the inertia of the last link with its palms, J its Jacobian
// and A the armatures. By the matrix inversion lemma the palm then responds to a force like the inertia m +
// (J A^-1 J^T)^-1. About the centre of mass, which a joint with armature a at a distance of at most l moves
// by l and turns by 1, J A^-1 J^T is at most 2 diag(sum 1/a, sum l^2/a) in every position. Holding torques
// (stuck friction, servos) only add to the inertia.
BodyInertia DynamicRobot::least_palm_inertia(std::size_t gripper) const {
  const Impl& m = *impl_;
  const std::vector<TreeJoint>& joints = m.tree.model().joints;
  const auto last = static_cast<size_t>(m.arm - 1);
  const BodyInertia& link = joints[last].inertia;
  double turns = 0.0, shifts = 0.0, distance = link.p_BBcm_B.norm();
  for (size_t j = last + 1; j-- > 0;) {
    const JointModel& joint = joints[j].joint;
    const bool revolute = joint.type == JointType::revolute;
    if (!revolute) distance += std::max(std::abs(joint.lower), std::abs(joint.upper));
    const double compliance = 1.0 / joints[j].armature;  // infinite without armature
    shifts += revolute ? distance * distance * compliance : compliance;
    if (revolute) turns += compliance;
    distance += joint.X_PJ.p.norm();
  }
  const Pose X_GL = (parameters_.arm.X_JF * m.grippers[gripper]->parameters().X_FG).inverse();
  constexpr double kLeast = 1e-6;  // kg, kg m^2: avoids a division by zero for massless bodies
  BodyInertia palm;
  palm.mass_kg = std::max(link.mass_kg, kLeast);
  palm.p_BBcm_B = X_GL * link.p_BBcm_B;
  palm.I_BBcm_B = X_GL.R * link.I_BBcm_B * X_GL.R.transpose() + kLeast * Mat3::Identity();
  if (shifts > 0.0) palm.mass_kg += 0.5 / shifts;
  if (turns > 0.0) palm.I_BBcm_B += 0.5 / turns * Mat3::Identity();
  return palm;
}

}  // namespace takt

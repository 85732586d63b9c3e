#include "plant_models/robot/dynamic_robot.h"

#include <algorithm>
#include <cstring>
#include <stdexcept>
#include <string>

#include "plant_models/robot/dynamic_robot_impl.h"
#include "plant_models/robot/ideal_servo.h"

namespace takt {

namespace {

// End stops of jaws: stiff against the servo, yet no stiffer than explicit steps of 1 ms allow.
constexpr double kStopPerServoFrequency = 5.0;
// Depth over which an end stop's damping, critical for the jaw alone, comes in (m), so that the force has no
// jump.
constexpr double kStopDampingDepth = 1e-5;

void require(bool good, const std::string& text) {
  if (!good) throw std::invalid_argument("dynamic robot: " + text);
}

void check_sizes(const DynamicRobotParameters& p, size_t drives, size_t grippers) {
  const size_t n = p.arm.joints.size();
  require(n > 0, "an arm needs joints");
  require(p.links.size() == n,
          std::to_string(p.links.size()) + " link inertias for " + std::to_string(n) + " joints");
  require(drives == n, std::to_string(drives) + " drives for " + std::to_string(n) + " joints");
  require(grippers == p.grippers.size(),
          std::to_string(grippers) + " grippers, but masses of " + std::to_string(p.grippers.size()));
  require(n + 2 * grippers <= static_cast<size_t>(kMaxJoints),
          std::to_string(n + 2 * grippers) + " joints with the jaws of the grippers; at most " +
              std::to_string(kMaxJoints) + " are possible");
}

/// Arm links, with palms fixed to the last one and jaws as prismatic joints on it.
TreeModel tree_of(const DynamicRobotParameters& p, const std::vector<std::unique_ptr<Drive>>& drives,
                  const std::vector<const ParallelGripper*>& grippers) {
  check_sizes(p, drives.size(), grippers.size());
  TreeModel tree;
  tree.gravity_R = p.X_WR.R.transpose() * p.gravity_W;
  const int last = p.arm.joint_count() - 1;
  for (int i = 0; i <= last; ++i) {
    const auto k = static_cast<size_t>(i);
    require(drives[k] != nullptr, "joint " + p.arm.joints[k].name + " has no drive");
    tree.joints.push_back({p.arm.joints[k], i - 1, p.links[k], drives[k]->armature()});
  }
  for (size_t g = 0; g < grippers.size(); ++g) {
    const ParallelGripperParameters& gripper = grippers[g]->parameters();
    const Pose X_LG = p.arm.X_JF * gripper.X_FG;
    BodyInertia& flange_link = tree.joints[static_cast<size_t>(last)].inertia;
    flange_link = combined(flange_link, p.grippers[g].palm, X_LG);
    for (const auto side : {ParallelGripper::left, ParallelGripper::right}) {
      TreeJoint jaw;
      jaw.joint.name = std::string(side == ParallelGripper::left ? "left" : "right") + " jaw of gripper " +
                       std::to_string(g + 1);
      jaw.joint.type = JointType::prismatic;
      jaw.joint.X_PJ = X_LG * ParallelGripper::jaw_pose(side, 0.0);
      jaw.joint.axis = Vec3::UnitY();  // outwards for both: the right jaw is turned by half a turn
      jaw.joint.upper = 0.5 * gripper.max_width_m;
      jaw.joint.max_velocity = gripper.jaw_speed_m_per_s;
      jaw.joint.max_effort = p.grippers[g].max_force_N;
      jaw.parent = last;
      jaw.inertia = p.grippers[g].jaw;
      tree.joints.push_back(jaw);
    }
  }
  return tree;
}

}  // namespace

DynamicRobot::Impl::Impl(const DynamicRobotParameters& parameters,
                         std::vector<std::unique_ptr<Drive>> arm_drives, const KinematicRobot& arm_reference,
                         std::vector<const ParallelGripper*> mounted)
    : reference(arm_reference),
      grippers(std::move(mounted)),
      drives(std::move(arm_drives)),
      tree(tree_of(parameters, drives, grippers)),
      base{parameters.X_WR, {}, {}},
      mount(parameters.mount),
      X_MR(parameters.X_MR),
      gravity_W(parameters.gravity_W),
      robot(static_cast<std::size_t>(parameters.robot)),
      arm(parameters.arm.joint_count()),
      joints(tree.joint_count()) {
  for (size_t g = 0; g < grippers.size(); ++g) {
    const MountedGripper& gripper = parameters.grippers[g];
    for (int side = 0; side < 2; ++side) {
      const double stop = kStopPerServoFrequency * gripper.servo_frequency_rad_per_s;
      stops[drives.size()] = {0.5 * grippers[g]->parameters().max_width_m, gripper.jaw.mass_kg * stop * stop,
                              2.0 * gripper.jaw.mass_kg * stop};
      // Two jaws of mass m against each other: w^2 = 2 k / m, critically damped.
      const double sync_w = gripper.gear_frequency_rad_per_s;
      syncs[drives.size()] = {0.5 * gripper.jaw.mass_kg * sync_w * sync_w, gripper.jaw.mass_kg * sync_w};
      drives.push_back(std::make_unique<IdealServo>(
          IdealServoParameters{gripper.servo_frequency_rad_per_s, gripper.max_force_N, false}));
    }
  }
  states = 2 * joints;
  for (size_t i = 0; i < drives.size(); ++i) {
    z_begin[i] = states;
    states += drives[i]->state_count();
    patterns[i] = drives[i]->pattern();
    if (drives[i]->has_modes()) ++indicators;
  }
  states += 1 + joints;
  gain_x.resize(static_cast<size_t>(states));
  yielding_x.resize(static_cast<size_t>(states));
}

void DynamicRobot::Impl::set_base(const BaseMotion& now) {
  if (now == base && w.base.moves) return;
  base = now;
  const Mat3 R_RW = base.X_WR.R.transpose();
  tree.set_base({R_RW * base.V_WR.v, R_RW * base.V_WR.w}, {R_RW * base.A_WR.v, R_RW * base.A_WR.w},
                R_RW * gravity_W, w);
  updated = false;
}

void DynamicRobot::Impl::update(const double* x) {
  const auto n = static_cast<size_t>(joints);
  // Compares bit for bit, including the sign of a zero: the cache must not change a result.
  const std::size_t size = n * sizeof(double);
  if (updated && std::memcmp(x, q.data(), size) == 0 && std::memcmp(x + n, qd.data(), size) == 0) return;
  std::copy(x, x + n, q.begin());
  std::copy(x + n, x + 2 * n, qd.begin());
  tree.update(q.data(), qd.data(), w);
  updated = true;
}

void DynamicRobot::Impl::references(double t, std::array<JointReference, kMaxJoints>& references) const {
  JointArray position, velocity, acceleration;
  reference.joint_state(t, position.data(), velocity.data());
  reference.joint_acceleration(t, acceleration.data());
  for (size_t i = 0; i < static_cast<size_t>(arm); ++i)
    references[i] = {position[i],
                     velocity[i],
                     acceleration[i],
                     reference.feed_forward()[i],
                     0.0,
                     !reference.torque_mode()};
  auto next = static_cast<size_t>(arm);
  for (const ParallelGripper* gripper : grippers) {
    for (const auto side : {ParallelGripper::left, ParallelGripper::right})
      references[next++] = {gripper->coordinate(t, side), gripper->speed(t, side), 0.0};
  }
}

void DynamicRobot::Impl::apply_wrenches(const CellMotion& motion, std::span<const Wrench> wrenches) {
  tree.clear_wrenches(w);
  const auto apply = [&](int body, int link) {
    const auto b = static_cast<size_t>(body);
    const Wrench& F = wrenches[b];
    const Pose& X_WR = base.X_WR;
    const Vec3 p_WLo = X_WR * tree.link_pose(link, w).p;
    const Vec3 t_Lo = F.t + (motion.bodies[b].p_WBcm - p_WLo).cross(F.f);
    tree.add_wrench(link, {X_WR.R.transpose() * F.f, X_WR.R.transpose() * t_Lo}, w);
  };
  int jaw = arm;
  for (const ParallelGripper* gripper : grippers) {
    const ParallelGripperParameters& p = gripper->parameters();
    apply(p.palm, arm - 1);
    apply(p.jaws[0], jaw++);
    apply(p.jaws[1], jaw++);
  }
}

double DynamicRobot::Impl::stop_force(int joint, const double* x) const {
  if (joint < arm) return 0.0;
  const EndStop& stop = stops[static_cast<size_t>(joint)];
  const double y = x[joint], v = x[joints + joint];
  const auto push = [&stop](double depth, double approach) {
    const double damping = stop.damping_N_s_per_m * std::min(1.0, depth / kStopDampingDepth);
    return std::max(0.0, stop.stiffness_N_per_m * depth + damping * approach);
  };
  if (y < 0.0) return push(-y, -v);
  if (y > stop.upper_m) return -push(y - stop.upper_m, v);
  return 0.0;
}

double DynamicRobot::Impl::sync_force(int joint, const double* x,
                                      const std::array<JointReference, kMaxJoints>& wanted) const {
  if (joint < arm) return 0.0;
  const int other = other_jaw(joint);
  const JointReference& mine = wanted[static_cast<size_t>(joint)];
  const JointReference& theirs = wanted[static_cast<size_t>(other)];
  const double ahead = x[joint] - x[other] - (mine.q - theirs.q);
  const double faster = x[joints + joint] - x[joints + other] - (mine.qd - theirs.qd);
  return -(sync(joint).stiffness_N_per_m * ahead + sync(joint).damping_N_s_per_m * faster);
}

void DynamicRobot::Impl::solve(double t, const double* x, const CellMotion& motion,
                               std::span<const Wrench> wrenches, Solution& s) {
  stand_on_mount(motion);
  update(x);
  apply_wrenches(motion, wrenches);
  references(t, s.reference);
  JointArray tau;
  MultibodyTree::Mask held{};
  for (int i = 0; i < joints; ++i) {
    const auto k = static_cast<size_t>(i);
    if (i < arm) s.reference[k].applied = motion.arms[robot].applied[k];
    s.output[k] = drive(i).output(s.reference[k], x[i], x[joints + i], drive_states(x, i));
    if (i >= arm) {
      const double limit = grippers[static_cast<size_t>((i - arm) / 2)]->force_limit_N();
      s.output[k].max_holding_torque = std::min(s.output[k].max_holding_torque, limit);
    }
    tau[k] = s.output[k].torque + besides_drive(i, s.reference[k].applied) + stop_force(i, x) +
             sync_force(i, x, s.reference);
    held[k] = s.output[k].locks_joint || s.output[k].prescribes_acceleration;
    s.qdd[k] = s.output[k].prescribes_acceleration ? s.output[k].acceleration : 0.0;
  }
  // Servos that would need more than they have yield; each may make another one yield.
  JointArray yield_torque{};
  s.yields.fill(false);
  for (bool again = true; again;) {
    again = false;
    tree.forward_dynamics(tau.data(), held, s.qdd.data(), s.holding.data(), w);
    for (size_t i = 0; i < static_cast<size_t>(joints); ++i) {
      if (!held[i] || !s.output[i].prescribes_acceleration) continue;
      const double limit = s.output[i].max_holding_torque;
      if (std::abs(s.holding[i]) <= limit) continue;
      yield_torque[i] = std::copysign(limit, s.holding[i]);
      tau[i] += yield_torque[i];
      held[i] = false;
      s.yields[i] = true;
      again = true;
    }
  }
  for (size_t i = 0; i < static_cast<size_t>(joints); ++i) s.holding[i] += yield_torque[i];
}

DynamicRobot::DynamicRobot(const DynamicRobotParameters& parameters,
                           std::vector<std::unique_ptr<Drive>> drives, const KinematicRobot& reference,
                           std::vector<const ParallelGripper*> grippers)
    : parameters_(parameters),
      impl_(std::make_unique<Impl>(parameters_, std::move(drives), reference, std::move(grippers))) {}

DynamicRobot::~DynamicRobot() = default;

int DynamicRobot::state_count() const {
  return impl_->states;
}

int DynamicRobot::joint_count() const {
  return impl_->joints;
}

const MultibodyTree& DynamicRobot::tree() const {
  return impl_->tree;
}

const Drive& DynamicRobot::drive(int joint) const {
  return impl_->drive(joint);
}

int DynamicRobot::drive_state(int joint) const {
  return impl_->z_begin[static_cast<size_t>(joint)];
}

void DynamicRobot::initial_state(double* x) const {
  std::array<JointReference, kMaxJoints> references;
  impl_->references(0.0, references);
  JointArray q{};
  const JointArray qd{};
  for (size_t i = 0; i < static_cast<size_t>(impl_->joints); ++i) q[i] = references[i].q;
  state_from_motion(q.data(), qd.data(), x);
}

void DynamicRobot::state_from_motion(const double* q, const double* qd, double* x) const {
  Impl& m = *impl_;
  std::copy(q, q + m.joints, x);
  std::copy(qd, qd + m.joints, x + m.joints);
  if (m.mount >= 0) m.set_base({parameters_.X_WR, {}, {}});
  m.update(x);
  m.tree.clear_wrenches(m.w);
  m.balance_drives({}, {}, x);
}

void DynamicRobot::state_from_motion(double t, const double* q, const double* qd, const CellMotion& motion,
                                     std::span<const Wrench> wrenches, double* x) const {
  Impl& m = *impl_;
  std::copy(q, q + m.joints, x);
  std::copy(qd, qd + m.joints, x + m.joints);
  m.stand_on_mount(motion);
  m.update(x);
  m.apply_wrenches(motion, wrenches);
  std::array<JointReference, kMaxJoints> references;
  m.references(t, references);
  JointArray qdd{};
  for (size_t i = 0; i < static_cast<size_t>(m.joints); ++i) qdd[i] = references[i].qdd;
  m.balance_drives(qdd, motion.arms[m.robot].applied, x);
}

JointArray DynamicRobot::weight_torques(const double* x) const {
  Impl& m = *impl_;
  const JointArray at_rest{};
  if (m.mount >= 0) m.set_base({m.base.X_WR, {}, {}});
  m.tree.update(x, at_rest.data(), m.w);
  m.updated = false;
  m.tree.clear_wrenches(m.w);
  JointArray torques{};
  m.tree.inverse_dynamics(at_rest.data(), torques.data(), m.w);
  return torques;
}

bool DynamicRobot::takes_torques(int joint) const {
  return impl_->drive(joint).takes_torques();
}

void DynamicRobot::begin_position_control(const JointArray& torques, double* x) const {
  const Impl& m = *impl_;
  for (int i = 0; i < m.arm; ++i) {
    const auto k = static_cast<size_t>(i);
    m.drive(i).set_integral(torques[k], x + m.z_begin[k]);
  }
}

void DynamicRobot::control_changed() const {
  impl_->gain_t = impl_->yielding_t = std::numeric_limits<double>::quiet_NaN();
}

void DynamicRobot::Impl::balance_drives(const JointArray& qdd, const JointArray& applied, double* x) {
  JointArray tau{};
  tree.inverse_dynamics(qdd.data(), tau.data(), w);
  for (int i = 0; i < joints; ++i) {
    const auto k = static_cast<size_t>(i);
    const double feed_forward = i < arm ? reference.feed_forward()[k] : 0.0;
    // Drives bring their own armature.
    const double needed = tau[k] - tree.model().joints[k].armature * qdd[k] - besides_drive(i, applied[k]);
    drive(i).initial_state({x[i], x[joints + i], qdd[k], feed_forward, applied[k]}, needed, x + z_begin[k]);
  }
  std::fill(x + energy_state(), x + states, 0.0);
}

void DynamicRobot::write_motion(double, const double* x, CellMotion& motion) const {
  Impl& m = *impl_;
  m.stand_on_mount(motion);
  m.update(x);
  ArmMotion& arm = motion.arms[static_cast<size_t>(parameters_.robot)];
  const auto n = static_cast<size_t>(m.arm);
  for (size_t i = 0; i < n; ++i) {
    arm.q[i] = m.q[i];
    arm.qd[i] = m.qd[i];
    arm.poses.link[i] = m.tree.link_pose(static_cast<int>(i), m.w);
  }
  const Pose& X_RL = arm.poses.link[n - 1];
  arm.poses.X_RF = X_RL * parameters_.arm.X_JF;
  const Twist V_RL = m.tree.link_twist(m.arm - 1, m.w);
  arm.base = m.base;
  const Pose& X_WR = m.base.X_WR;
  arm.X_WF = X_WR * arm.poses.X_RF;
  arm.V_WF = {X_WR.R * V_RL.at(arm.poses.X_RF.p - X_RL.p), X_WR.R * V_RL.w};
  auto joint = n;
  for (const ParallelGripper* gripper : m.grippers) {
    const ParallelGripperParameters& p = gripper->parameters();
    BodyMotion& palm = motion.bodies[static_cast<size_t>(p.palm)];
    palm.X_WB = arm.X_WF * p.X_FG;
    palm.V_WB = {arm.V_WF.at(palm.X_WB.p - arm.X_WF.p), arm.V_WF.w};
    palm.p_WBcm = palm.X_WB.p;
    for (const auto side : {ParallelGripper::left, ParallelGripper::right}) {
      BodyMotion& jaw = motion.bodies[static_cast<size_t>(p.jaws[static_cast<size_t>(side)])];
      jaw.X_WB = palm.X_WB * ParallelGripper::jaw_pose(side, m.q[joint]);
      const Vec3 outwards_W = palm.X_WB.R.col(1) * (side == ParallelGripper::left ? 1.0 : -1.0);
      jaw.V_WB = {palm.V_WB.at(jaw.X_WB.p - palm.X_WB.p) + m.qd[joint] * outwards_W, palm.V_WB.w};
      jaw.p_WBcm = jaw.X_WB.p;
      ++joint;
    }
  }
}

void DynamicRobot::derivatives(double t, const double* x, const CellMotion& motion,
                               std::span<const Wrench> wrenches, double* xdot) const {
  Impl& m = *impl_;
  Impl::Solution& s = m.solution;
  m.solve(t, x, motion, wrenches, s);
  const int n = m.joints;
  double mechanical = 0.0;
  double* taken = xdot + energy_state() + 1;
  for (int i = 0; i < n; ++i) {
    const auto k = static_cast<size_t>(i);
    xdot[i] = x[n + i];
    xdot[n + i] = s.qdd[k];
    m.drive(i).derivatives(s.reference[k], x[i], x[n + i], m.drive_states(x, i), xdot + m.z_begin[k]);
    const double power = s.torque(i, m.tree.model().joints[k].armature) * x[n + i];
    mechanical += power;
    taken[i] = m.taken(i, s.output[k], power);
  }
  xdot[energy_state()] = mechanical;
}

void DynamicRobot::state_scales(double* scales) const {
  constexpr double kNoErrorTest_J = 1e12;
  const Impl& m = *impl_;
  for (int i = 0; i < m.joints; ++i) {
    const bool in_metres = m.tree.model().joints[static_cast<size_t>(i)].joint.type == JointType::prismatic;
    scales[i] = scales[m.joints + i] = in_metres ? 0.1 : 1.0;
    m.drive(i).state_scales(scales + m.z_begin[static_cast<size_t>(i)]);
  }
  std::fill(scales + energy_state(), scales + m.states, kNoErrorTest_J);
}

double DynamicRobot::next_time_event(double t) const {
  double next = impl_->reference.next_time_event(t);
  for (const ParallelGripper* gripper : impl_->grippers) next = std::min(next, gripper->next_time_event(t));
  return next;
}

}  // namespace takt

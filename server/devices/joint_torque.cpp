#include "server/devices/joint_torque.h"

#include <algorithm>
#include <array>

#include "idl/common/text.h"
#include "plant_models/state_bytes.h"
#include "server/simulation/model/state_hash.h"

namespace takt {

namespace {
constexpr double kLargestTorque = 1e9;  ///< N m or N, where nothing limits it

struct Units {
  const char *torque, *position, *velocity;
};
consteval std::array<KindSignal, 3> signals_in(Units unit) {
  return {commanded("torque", unit.torque, "±`max_torque_N_m`", "that acts on the joint"),
          reported("position", unit.position, "of the joint"),
          reported("velocity", unit.velocity, "of the joint")};
}
constexpr auto kRevoluteSignals = signals_in({"N m", "rad", "rad/s"});
constexpr auto kPrismaticSignals = signals_in({"N", "m", "m/s"});
}  // namespace

void describe(Fields& f, ScenarioJointTorque& s) {
  f.field("robot", s.robot, f.name_of({"robots"}, "a robot"), "Robot or other machine with joints.",
          kRequired);
  f.field("joint", s.joint, Text{}, "Name of the joint.", kRequired);
  s.place_of_joint = f.place("joint");
  const Choice<bool> drives{{{"replaced", false}, {"kept", true}}};
  f.field("drive", s.keeps_drive, drives,
          "The torque is the drive of the joint, which follows no set-points; or it acts besides the drive.");
  f.when("drive", drives, s.keeps_drive, {false}, [&] {
    f.field("armature_kg_m2", s.armature_kg_m2, not_negative("kg m^2, kg of prismatic joints"),
            "Inertia of the rotor at the joint: that of the motor times the gear ratio squared.");
  });
  f.field("max_torque_N_m", s.max_torque_N_m, positive("N m, N of prismatic joints"),
          "Largest torque; without it: the effort of the joint in the URDF.");
}

void build(const ScenarioJointTorque& s, DeviceBuilder& b) {
  JointTorqueParameters p;
  p.robot = static_cast<std::size_t>(b.cell.description.find_robot(s.robot));
  const std::vector<JointModel>& joints = b.cell.description.robots[p.robot].arm.joints;
  const auto joint =
      std::find_if(joints.begin(), joints.end(), [&](const JointModel& j) { return j.name == s.joint; });
  if (joint == joints.end()) {
    std::vector<std::string> names;
    for (const JointModel& j : joints) names.push_back(j.name);
    throw ScenarioError(s.place_of_joint + ": found '" + s.joint + "'; allowed: a joint of " + s.robot +
                        ": " + join(names, ", "));
  }
  p.joint = static_cast<std::size_t>(joint - joints.begin());
  if (!b.torques.insert({p.robot, p.joint}).second)
    throw ScenarioError(s.place_of_joint + ": found '" + s.joint + "' of " + s.robot +
                        " again; allowed: one torque for each joint. A device in Lua adds several");
  std::optional<RobotDynamics>& dynamics = b.cell.dynamics[p.robot];
  if (!dynamics)
    throw ScenarioError(s.place_of_joint + ": the joint '" + s.joint +
                        "' has no dynamics that a torque acts on: " + b.cell.no_dynamics[p.robot]);
  const double effort = joint->max_effort > 0.0 ? joint->max_effort : kLargestTorque;
  const double most = s.max_torque_N_m.value_or(effort);
  if (!s.keeps_drive) dynamics->drives[p.joint] = SignalDriveParameters{s.armature_kg_m2, most};
  if (b.cell.robot_levels[p.robot] < 2)
    b.cell.import_notes.push_back({b.name,
                                   b.name + ": " + s.robot +
                                       " is at level of detail 1, where joints follow their set-points; the "
                                       "torque acts from level 2 on, which "
                                       "the robot has as a member of a process with level_of_detail: 2.",
                                   {}});
  const bool revolute = joint->type == JointType::revolute;
  b.add<JointTorque>(p, described(revolute ? kRevoluteSignals : kPrismaticSignals, {{-most, most}}));
}

DeviceType joint_torque_type() {
  return device_type<ScenarioJointTorque>(
      DeviceType::Owner::cell, "joint_torques", "Torques on joints that signals give.",
      "The drive of a joint as a signal, e.g. of an FMU, or a torque besides the drive.", false,
      kRevoluteSignals, "Units of a prismatic joint: N, m and m/s.");
}

void JointTorque::write_motion(double, const double*, CellMotion& motion) const {
  motion.arms[p_.robot].applied[p_.joint] = torque_;
}

void JointTorque::set_signal(double, int, double value) {
  torque_ = value;
}

void JointTorque::read_signals(double, const double*, const CellMotion& motion,
                               std::span<double> signals) const {
  const ArmMotion& arm = motion.arms[p_.robot];
  signals[torque] = torque_;
  signals[position] = arm.q[p_.joint];
  signals[velocity] = arm.qd[p_.joint];
}

std::uint64_t JointTorque::discrete_hash() const {
  StateHash hash;
  hash.add(std::span<const double>(&torque_, 1));
  return hash.value();
}

void JointTorque::save(StateWriter& out) const {
  out.put(torque_);
}

void JointTorque::load(StateReader& in) {
  torque_ = in.number("a torque of a joint");
}

}  // namespace takt

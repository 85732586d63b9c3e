#include <algorithm>

#include "plant_models/robot/trajectory.h"
#include "server/scenario/cell_builders.h"
#include "server/scenario/scenario_reader.h"

namespace takt {

namespace {

void check_count(const Scenario& scenario, const std::string& key, std::size_t found, std::size_t joints) {
  if (found == joints || found == 1) return;
  fail(scenario, key, std::to_string(found) + " values",
       "one number, or one for each of the " + std::to_string(joints) + " joints");
}

/// Mass and inertia of a solid of uniform density.
BodyInertia solid_inertia(const SharedMesh& mesh, double mass_kg) {
  const VolumeProperties& volume = mesh.volume();
  return {mass_kg, volume.p_BBcm, mass_kg * volume.G_BBcm_B};
}

MountedGripper mounted_gripper(const Scenario& scenario, const ScenarioGripper& gripper,
                               const SharedMesh& body, const SharedMesh& jaw) {
  const double jaw_kg = gripper.jaw_mass_kg.value_or(0.1 * gripper.mass_kg);
  if (!(gripper.mass_kg > 2.0 * jaw_kg)) {
    fail(scenario, "grippers." + gripper.name + ".mass_kg", std::to_string(gripper.mass_kg),
         "more than both jaws together (" + std::to_string(2.0 * jaw_kg) +
             " kg), for a robot that is dynamic");
  }
  MountedGripper mounted;
  mounted.palm = solid_inertia(body, gripper.mass_kg - 2.0 * jaw_kg);
  mounted.jaw = solid_inertia(jaw, jaw_kg);
  mounted.max_force_N = gripper.max_force_N;
  return mounted;
}

/// How far the reference of a jaw must be beyond the jaw for the servo to push with all its force; a bit
/// more, so that it stays at the limit while the jaw is pushed about.
double servo_travel_to_limit(const MountedGripper& gripper) {
  const double w = gripper.servo_frequency_rad_per_s;
  return 1.2 * gripper.max_force_N / (gripper.jaw.mass_kg * w * w);
}

DriveParameters drive_parameters(const ScenarioDrives& drives, const JointModel& joint, std::size_t i,
                                 double link_inertia) {
  const double limit = joint.max_effort > 0.0 ? joint.max_effort : std::numeric_limits<double>::infinity();
  if (drives.model == ScenarioDrives::Model::ideal) {
    return IdealServoParameters{drives.bandwidth_rad_per_s.at(i), limit};
  }
  if (drives.model == ScenarioDrives::Model::simplified) {
    SimplifiedDriveParameters p;
    p.gear_ratio = drives.gear_ratio.given() ? drives.gear_ratio.at(i) : 1.0;
    p.rotor_inertia_kg_m2 = drives.motor_inertia_kg_m2.given() ? drives.motor_inertia_kg_m2.at(i) : 0.0;
    p.load_inertia_kg_m2 = link_inertia;
    p.max_torque = limit;
    p.set_bandwidth(drives.bandwidth_rad_per_s.at(i));
    return p;
  }
  DetailedDriveParameters p;
  p.elastic_gear = drives.gear_stiffness_N_m_per_rad.at(i) > 0.0;
  p.gear_ratio = drives.gear_ratio.at(i);
  p.motor_inertia_kg_m2 = drives.motor_inertia_kg_m2.at(i);
  p.motor_constant_N_m_per_A = drives.torque_constant_N_m_per_A.at(i);
  p.current_loop_rad_per_s = drives.current_loop_rad_per_s.at(i);
  p.current_loop_damping = drives.current_loop_damping.at(i);
  p.resistance_ohm = drives.armature_resistance_ohm.at(i);
  p.power_stage_gain = drives.power_stage_gain.at(i);
  p.gear_stiffness_N_m_per_rad = drives.gear_stiffness_N_m_per_rad.at(i);
  p.gear_damping_N_m_s_per_rad = drives.gear_damping_N_m_s_per_rad.at(i);
  if (drives.friction != ScenarioDrives::Friction::none) {
    p.friction.zero_speed_N_m = drives.friction_zero_speed_N_m.at(i);
    p.friction.slope_N_m_s = drives.friction_slope_N_m_s_per_rad.at(i);
    p.friction.break_away = drives.breakaway_factor.at(i);
    p.friction.regularised = drives.friction == ScenarioDrives::Friction::regularised;
    p.friction.regularisation_speed_rad_per_s = drives.friction_regularisation_rad_per_s.at(i);
  }
  p.position_at_joint = drives.position_encoder == ScenarioDrives::PositionEncoder::joint;
  p.position_gain_per_s = drives.position_gain_per_s.at(i);
  p.speed_gain_As_per_rad = drives.speed_gain_A_s_per_rad.at(i);
  p.speed_integral_time_s = drives.speed_integral_time_s.at(i);
  return p;
}

void check_counts(const Scenario& scenario, const ScenarioRobot& robot, std::size_t joints) {
  const ScenarioDrives& d = robot.drives;
  const std::string prefix = "robots." + robot.name + ".drives.";
  const std::pair<const char*, const JointValues*> lists[] = {
      {"bandwidth_rad_per_s", &d.bandwidth_rad_per_s},
      {"gear_ratio", &d.gear_ratio},
      {"motor_inertia_kg_m2", &d.motor_inertia_kg_m2},
      {"torque_constant_N_m_per_A", &d.torque_constant_N_m_per_A},
      {"current_loop_rad_per_s", &d.current_loop_rad_per_s},
      {"current_loop_damping", &d.current_loop_damping},
      {"armature_resistance_ohm", &d.armature_resistance_ohm},
      {"power_stage_gain", &d.power_stage_gain},
      {"gear_stiffness_N_m_per_rad", &d.gear_stiffness_N_m_per_rad},
      {"gear_damping_N_m_s_per_rad", &d.gear_damping_N_m_s_per_rad},
      {"friction_zero_speed_N_m", &d.friction_zero_speed_N_m},
      {"friction_slope_N_m_s_per_rad", &d.friction_slope_N_m_s_per_rad},
      {"breakaway_factor", &d.breakaway_factor},
      {"friction_regularisation_rad_per_s", &d.friction_regularisation_rad_per_s},
      {"position_gain_per_s", &d.position_gain_per_s},
      {"speed_gain_A_s_per_rad", &d.speed_gain_A_s_per_rad},
      {"speed_integral_time_s", &d.speed_integral_time_s}};
  for (const auto& [key, values] : lists)
    if (values->given()) check_count(scenario, prefix + key, values->values.size(), joints);
}

/// Inertia that each drive of the arm sees at the start, with gripper, without its own rotor: the diagonal of
/// the mass matrix.
std::vector<double> seen_inertias(const DynamicRobotParameters& parameters,
                                  const KinematicRobotParameters& arm,
                                  const std::vector<ParallelGripper>& grippers) {
  std::vector<std::unique_ptr<Drive>> none;
  none.reserve(parameters.arm.joints.size());
  for (std::size_t i = 0; i < parameters.arm.joints.size(); ++i)
    none.push_back(std::make_unique<IdealServo>(IdealServoParameters{}));
  std::vector<const ParallelGripper*> mounted;
  mounted.reserve(grippers.size());
  for (const ParallelGripper& gripper : grippers) mounted.push_back(&gripper);
  const KinematicRobot reference(arm);
  const DynamicRobot robot(parameters, std::move(none), reference, std::move(mounted));
  JointArray q = arm.q_initial, qd{};
  auto jaw = static_cast<std::size_t>(arm.arm.joint_count());
  for (const ParallelGripper& gripper : grippers)
    for (const auto side : {ParallelGripper::left, ParallelGripper::right})
      q[jaw++] = gripper.coordinate(0.0, side);
  MultibodyTree::Workspace w;
  robot.tree().update(q.data(), qd.data(), w);
  MultibodyTree::MassMatrix M(robot.joint_count(), robot.joint_count());
  robot.tree().mass_matrix(M, w);
  std::vector<double> result;
  for (int i = 0; i < arm.arm.joint_count(); ++i) result.push_back(M(i, i));
  return result;
}

RobotDynamics robot_dynamics(const Scenario& scenario, const ScenarioRobot& robot, const UrdfArm& urdf,
                             std::size_t index, const SharedMeshes& meshes, const CellModel& cell,
                             std::vector<std::string>& remarks) {
  const KinematicRobotParameters& arm = cell.robots[index];
  RobotDynamics result;
  DynamicRobotParameters& p = result.parameters;
  p.robot = static_cast<int>(index);
  p.arm = arm.arm;
  UrdfInertias inertias_of_file = urdf_inertias(urdf, robot.mass_kg);
  p.links = std::move(inertias_of_file.links);
  remarks = std::move(inertias_of_file.remarks);
  p.X_WR = robot.X_WR;
  p.mount = arm.mount;
  p.X_MR = arm.X_MR;
  p.gravity_W = scenario.gravity_m_per_s2;
  p.power = {robot.power.idle_W, robot.power.loss_factor, robot.power.regenerative};
  std::vector<ParallelGripper> grippers;
  for (std::size_t g = 0; g < scenario.grippers.size(); ++g) {
    if (scenario.grippers[g].robot != robot.name) continue;
    const ParallelGripperParameters& jaws = cell.grippers[g].parameters;
    p.grippers.push_back(mounted_gripper(scenario, scenario.grippers[g],
                                         *meshes[static_cast<std::size_t>(jaws.palm)],
                                         *meshes[static_cast<std::size_t>(jaws.jaws[0])]));
    grippers.emplace_back(jaws);
  }
  check_counts(scenario, robot, p.arm.joints.size());
  const std::vector<double> inertias = seen_inertias(p, arm, grippers);
  for (std::size_t i = 0; i < p.arm.joints.size(); ++i)
    result.drives.push_back(drive_parameters(robot.drives, p.arm.joints[i], i, inertias[i]));
  return result;
}

std::vector<TrajectoryKnot> trajectory(const Scenario& scenario, const ScenarioRobot& robot,
                                       const KinematicRobotParameters& arm) {
  if (!robot.trajectory) return {};
  const ScenarioTrajectory& t = *robot.trajectory;
  std::vector<MotionLimits> limits;
  for (std::size_t i = 0; i < t.end_rad.size(); ++i) {
    const JointModel& joint = arm.arm.joints[i];
    if (t.end_rad[i] < joint.lower || t.end_rad[i] > joint.upper) {
      fail(scenario, "robots." + robot.name + ".trajectory.end_rad",
           std::to_string(t.end_rad[i]) + " for joint '" + joint.name + "'",
           "a value in [" + std::to_string(joint.lower) + ", " + std::to_string(joint.upper) + "]");
    }
    limits.push_back({t.max_velocity_rad_per_s[i], t.max_acceleration_rad_per_s2[i]});
  }
  return point_to_point(0.0, robot.initial_joints_rad, t.end_rad, limits);
}

ProcessDescription process_description(const Scenario& scenario, const ScenarioProcess& process,
                                       const CellModel& cell) {
  ProcessDescription model;
  model.name = process.name;
  model.level_of_detail = process.level_of_detail;
  const auto is_member = [&](const std::string& name) {
    return process.all_members ||
           std::find(process.members.begin(), process.members.end(), name) != process.members.end();
  };
  for (std::size_t r = 0; r < scenario.robots.size(); ++r) {
    const std::string& name = scenario.robots[r].name;
    const bool by_gripper =
        std::any_of(scenario.grippers.begin(), scenario.grippers.end(),
                    [&](const ScenarioGripper& g) { return g.robot == name && is_member(g.name); });
    if (is_member(name) || by_gripper) model.robots.push_back(static_cast<int>(r));
  }
  for (std::size_t c = 0; c < cell.components.size(); ++c) {
    const Component& component = cell.components[c];
    bool member = is_member(component.name);
    if (component.type == ComponentType::gripper) {
      const int robot = cell.grippers[static_cast<std::size_t>(component.gripper)].parameters.robot;
      member = std::find(model.robots.begin(), model.robots.end(), robot) != model.robots.end();
    }
    if (member) model.components.push_back(static_cast<int>(c));
  }
  return model;
}

}  // namespace

void add_dynamics(const Scenario& scenario, const std::vector<UrdfArm>& arms, const SharedMeshes& meshes,
                  CellModel& cell) {
  cell.robot_levels.assign(scenario.robots.size(), 1);
  for (const ScenarioProcess& process : scenario.processes) {
    cell.description.processes.push_back(process_description(scenario, process, cell));
    for (const int robot : cell.description.processes.back().robots)
      cell.robot_levels[static_cast<std::size_t>(robot)] = process.level_of_detail;
  }
  for (std::size_t r = 0; r < scenario.robots.size(); ++r) {
    const ScenarioRobot& robot = scenario.robots[r];
    cell.trajectories.push_back(trajectory(scenario, robot, cell.robots[r]));
    std::optional<RobotDynamics> dynamics;
    std::string reason;
    std::vector<std::string> remarks;
    try {
      dynamics = robot_dynamics(scenario, robot, arms[r], r, meshes, cell, remarks);
      make_drives(dynamics->drives);  // refuses parameters that no drive can have
      for (const std::string& remark : remarks)
        cell.import_notes.push_back({robot.name, robot.name + ": " + remark, {}});
    } catch (const std::exception& error) {
      dynamics.reset();
      reason = error.what();
      const std::string file = scenario.file.string() + ": ";
      if (reason.starts_with(file)) reason.erase(0, file.size());
      if (cell.robot_levels[r] > 1) {
        throw ScenarioError(scenario.file.string() + ": robots." + robot.name +
                            " cannot be simulated at level of detail " +
                            std::to_string(cell.robot_levels[r]) + ": " + reason);
      }
    }
    std::size_t mounted = 0;
    for (GripperModel& gripper : cell.grippers) {
      if (!dynamics || gripper.parameters.robot != static_cast<int>(r)) continue;
      gripper.press_m = servo_travel_to_limit(dynamics->parameters.grippers[mounted++]);
    }
    cell.dynamics.push_back(std::move(dynamics));
    cell.no_dynamics.push_back(std::move(reason));
  }
}

}  // namespace takt

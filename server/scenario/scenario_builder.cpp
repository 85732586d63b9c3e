#include "server/scenario/scenario_builder.h"

#include <algorithm>
#include <utility>

#include "idl/common/mesh_path.h"
#include "idl/common/text.h"
#include "server/scenario/cell_builders.h"
#include "server/scenario/convex_import.h"
#include "server/scenario/urdf_gripper.h"
#include "server/scenario/world_bounds.h"
#include "server/simulation/step/step_limit.h"

namespace takt {

namespace {

/// Notes the risks of the mesh for forces of surface contact, if the cell has any.
void look_after_contact(const Scenario& scenario, const std::string& component, SharedMesh& mesh,
                        bool usually_carries_elements, CellModel& cell) {
  if (!scenario.begins_with_contact()) return;
  const MeshUse use = mesh_use(scenario, component, mesh, usually_carries_elements);
  note_contact_risks(component, mesh, use, cell);
}

/// What the components of a cell are made with.
struct Import {
  MeshLibrary library;
  ConvexImporter convex;
  SharedMeshes meshes;  ///< by component
};

int add_component(CellModel& cell, Component component, const std::shared_ptr<SharedMesh>& mesh,
                  const std::filesystem::path& file, const std::array<float, 4>& color, Import& import) {
  import.meshes.push_back(mesh);
  component.box = component.convex.box();
  ComponentDescription description;
  description.name = component.name;
  description.type = component.type;
  description.hierarchy = component.hierarchy;
  description.mass_kg = component.mass_kg;
  description.p_BBcm = component.p_BBcm;
  description.mesh_uri = mesh_label(file);
  description.color = color;
  description.mesh = mesh->described();
  cell.description.components.push_back(std::move(description));
  cell.components.push_back(std::move(component));
  return static_cast<int>(cell.components.size()) - 1;
}

void add_part(const Scenario& scenario, const ScenarioPart& part, Import& import, CellModel& cell) {
  const auto mesh = import_component_mesh(part.name, part.mesh, part.mesh_scale, import.library, cell);
  look_after_contact(scenario, part.name, *mesh, true, cell);
  Component component;
  component.name = part.name;
  component.type = ComponentType::part;
  component.hierarchy = part.hierarchy;
  component.convex = import.convex.parts(part.name, part.mesh, part.mesh_scale, mesh, part.convex);
  component.mass_kg = part.mass_kg;
  const VolumeProperties& volume = mesh->volume();
  component.p_BBcm = part.center_of_mass_m.value_or(volume.p_BBcm);
  component.I_BBcm_B = part.inertia_kg_m2.value_or(part.mass_kg * volume.G_BBcm_B);
  const double gravity = scenario.gravity_m_per_s2.norm();
  // Without gravity the allowed error has no weight to bound it; standard gravity keeps the spring as stiff
  // as usual.
  component.substitute =
      substitute_parameters(part.mass_kg, component.I_BBcm_B, gravity > 0.0 ? gravity : 9.80665,
                            part.allowed_position_error_m.value_or(scenario.allowed_position_error_m),
                            part.damping_ratio.value_or(scenario.damping_ratio));
  if (part.rotational_stiffness_N_m_per_rad) {
    component.substitute.K_rot_B = Mat3::Identity() * *part.rotational_stiffness_N_m_per_rad;
  }
  if (part.rotational_damping_N_m_s_per_rad) {
    component.substitute.D_rot_B = Mat3::Identity() * *part.rotational_damping_N_m_s_per_rad;
  }
  const Component copy = component;
  const int id = add_component(cell, std::move(component), mesh, part.mesh, part.color, import);
  cell.parts.push_back(
      {id, copy.mass_kg, copy.p_BBcm, copy.I_BBcm_B, scenario.gravity_m_per_s2, part.X_WB, part.V_WB});
}

void add_ground(const Scenario& scenario, const ScenarioGround& ground, Import& import, CellModel& cell) {
  const auto mesh = import_component_mesh(ground.name, ground.mesh, ground.mesh_scale, import.library, cell);
  look_after_contact(scenario, ground.name, *mesh, false, cell);
  Component component;
  component.name = ground.name;
  component.type = ComponentType::ground;
  component.convex = import.convex.parts(ground.name, ground.mesh, ground.mesh_scale, mesh, ground.convex);
  cell.grounds.push_back(
      {add_component(cell, std::move(component), mesh, ground.mesh, ground.color, import), ground.X_WB});
}

/// Where a joint starts that no position is given for: as joint_state_publisher of ROS has it.
double initial_position(const JointModel& joint) {
  return joint.lower <= 0.0 && joint.upper >= 0.0 ? 0.0 : 0.5 * (joint.lower + joint.upper);
}

void add_robot(const Scenario& scenario, const ScenarioRobot& robot, const UrdfArm& urdf, CellModel& cell) {
  const std::string key = "robots." + robot.name + ".initial_joints_rad";
  const auto count = static_cast<std::size_t>(urdf.arm.joint_count());
  const bool given = !robot.initial_joints_rad.empty();
  if (given && robot.initial_joints_rad.size() != count) {
    fail(scenario, key, std::to_string(robot.initial_joints_rad.size()) + " values",
         std::to_string(count) + ", one for each joint of " + robot.urdf.string());
  }
  KinematicRobotParameters parameters;
  parameters.robot = static_cast<int>(cell.robots.size());
  parameters.arm = urdf.arm;
  parameters.X_WR = robot.X_WR;
  if (!robot.mounted_on.empty()) {
    parameters.mount = cell.description.find_component(robot.mounted_on);
    const auto ground = std::find_if(cell.grounds.begin(), cell.grounds.end(),
                                     [&](const GroundModel& g) { return g.component == parameters.mount; });
    parameters.X_MR = ground->X_WB.inverse() * robot.X_WR;
  }
  for (std::size_t i = 0; i < count; ++i) {
    const JointModel& joint = urdf.arm.joints[i];
    const double q = given ? robot.initial_joints_rad[i] : initial_position(joint);
    if (q < joint.lower || q > joint.upper) {
      fail(scenario, key, std::to_string(q) + " for joint '" + joint.name + "'",
           "a value in [" + std::to_string(joint.lower) + ", " + std::to_string(joint.upper) + "]");
    }
    parameters.q_initial[i] = q;
  }
  if (!given) {
    std::vector<std::string> starts;
    for (std::size_t i = 0; i < count; ++i) starts.push_back(number_text(parameters.q_initial[i], 4));
    cell.import_notes.push_back({robot.name,
                                 robot.name + ": the joints start at [" + join(starts, ", ") +
                                     "]; `initial_joints_rad` says where else.",
                                 {}});
  }
  cell.robots.push_back(parameters);
  CommandDeadline deadline;
  deadline.deadline_s = robot.deadline.command_deadline_s;
  deadline.action = robot.deadline.safe_action;
  for (std::size_t i = 0; i < count && robot.deadline.max_acceleration_rad_per_s2.given(); ++i)
    deadline.max_acceleration[i] = robot.deadline.max_acceleration_rad_per_s2.at(i);
  cell.description.robots.push_back({robot.name, urdf.robot.text, urdf.arm, robot.X_WR,
                                     robot.command_period_s, deadline, urdf.links, parameters.mount,
                                     parameters.X_MR});
  for (const std::string& remark : urdf.remarks)
    cell.import_notes.push_back({robot.name, robot.name + ": " + remark + ".", {}});
  if (urdf.standing_joints.empty()) return;
  cell.import_notes.push_back({robot.name,
                               robot.name + ": " + urdf.robot.place(0) + "the chain from '" + urdf.base_link +
                                   "' to '" + urdf.flange_link + "' moves; the other joints stand still: " +
                                   join(urdf.standing_joints, ", ") + ".",
                               {}});
}

void add_gripper(const Scenario& scenario, const ScenarioGripper& gripper, Import& import, CellModel& cell) {
  const int index = static_cast<int>(cell.grippers.size());
  const int robot = cell.description.find_robot(gripper.robot);
  const auto body =
      import_component_mesh(gripper.name, gripper.body_mesh, gripper.mesh_scale, import.library, cell);
  const auto jaw =
      import_component_mesh(gripper.name, gripper.jaw_mesh, gripper.mesh_scale, import.library, cell);
  look_after_contact(scenario, gripper.name, *body, false, cell);
  look_after_contact(scenario, gripper.name + "/left_jaw", *jaw, true, cell);

  GripperModel model;
  model.parameters.robot = robot;
  model.parameters.X_FG = gripper.X_FG;
  model.parameters.max_width_m = gripper.max_width_m;
  model.parameters.initial_width_m = gripper.initial_width_m.value_or(gripper.max_width_m);
  model.parameters.jaw_speed_m_per_s = gripper.jaw_speed_m_per_s;
  model.rule = gripper.grasp;
  model.max_force_N = gripper.max_force_N;

  Component palm;
  palm.name = gripper.name;
  palm.type = ComponentType::gripper;
  palm.gripper = index;
  palm.role = GripperRole::palm;
  model.parameters.palm =
      add_component(cell, std::move(palm), body, gripper.body_mesh, gripper.color, import);
  const ConvexParts jaw_hull =
      import.convex.parts(gripper.name, gripper.jaw_mesh, gripper.mesh_scale, jaw, {});
  for (const auto& [side, suffix, role] : {std::tuple{0, "/left_jaw", GripperRole::left_jaw},
                                           std::tuple{1, "/right_jaw", GripperRole::right_jaw}}) {
    Component component;
    component.name = gripper.name + suffix;
    component.type = ComponentType::gripper;
    component.gripper = index;
    component.role = role;
    component.convex = jaw_hull;
    model.parameters.jaws[static_cast<std::size_t>(side)] =
        add_component(cell, std::move(component), jaw, gripper.jaw_mesh, gripper.color, import);
  }
  const BodyBox& box = jaw_hull[0].box;
  const Vec3 lower = box.center_B - box.half_B, upper = box.center_B + box.half_B;
  model.face_x_lower_m = lower.x(), model.face_x_upper_m = upper.x();
  model.face_z_lower_m = lower.z(), model.face_z_upper_m = upper.z();
  cell.grippers.push_back(model);

  GripperDescription description;
  description.name = gripper.name;
  description.robot = robot;
  description.component = model.parameters.palm;
  description.left_jaw = model.parameters.jaws[0];
  description.right_jaw = model.parameters.jaws[1];
  description.X_FG = gripper.X_FG;
  description.X_GT = gripper.X_GT;
  description.max_width_m = gripper.max_width_m;
  description.max_force_N = gripper.max_force_N;
  description.jaw_speed_m_per_s = gripper.jaw_speed_m_per_s;
  cell.description.grippers.push_back(description);
}

/// Returns the wires that the devices bring with them.
std::vector<StatedWire> add_devices(const Scenario& scenario, const SharedMeshes& meshes, FmuOpener* fmus,
                                    CellModel& cell) {
  DeviceBuilder b(meshes, scenario.temperature_degC, cell);
  b.fmus = fmus;
  for (const DeviceType& type : device_types()) {
    b.type = type.key;
    for (const ScenarioPart& part : scenario.parts) {
      for (const StatedDevice& device : part.devices) {
        if (device.type != &type) continue;
        b.name = part_device_name(part.name, type);
        b.component = cell.description.find_component(part.name);
        type.build(device.section, b);
      }
    }
    b.component = -1;
    for (const StatedDevice& device : scenario.devices) {
      if (device.type != &type) continue;
      b.name = device.name;
      type.build(device.section, b);
    }
  }
  for (const auto& finish : b.when_built) finish();
  return std::move(b.wires);
}

/// Checks the step of levels 1 and 2 against its known limit. Skipped for a cell that begins with contact,
/// which uses another solver; Simulation refuses to leave that.
void check_step(const Scenario& scenario, CellModel& cell) {
  if (scenario.begins_with_contact()) return;
  bool refused = false;
  const std::string remark = step_remark(cell, scenario.begins_with(2), refused);
  if (refused) throw ScenarioError(scenario.file.string() + ": " + remark);
  if (!remark.empty()) cell.import_notes.push_back({"solver", remark, {}});
}

}  // namespace

std::shared_ptr<const CellModel> build_cell(const Scenario& stated, const ImportOptions& options) {
  MeshFiles files;
  const std::optional<Scenario> filled = with_pools(stated);
  const std::optional<Scenario> placed = placed_at_nodes(filled ? *filled : stated, files);
  const Scenario& without_fingers = placed ? *placed : filled ? *filled : stated;
  std::vector<UrdfArm> arms;
  for (const ScenarioRobot& robot : without_fingers.robots)
    arms.push_back(read_urdf_arm(robot.urdf, robot.base_link, robot.flange_link, options.packages));
  std::vector<ImportNote> finger_notes;
  const std::optional<Scenario> with_grippers =
      with_fingers(without_fingers, arms, files, [&](const std::string& robot, const std::string& sentence) {
        finger_notes.push_back({robot, robot + ": " + sentence + ".", {}});
      });
  const Scenario& scenario = with_grippers ? *with_grippers : without_fingers;
  auto cell = std::make_shared<CellModel>();
  cell->import_notes = std::move(finger_notes);
  cell->description.scenario = scenario.name;
  cell->description.step_s = cell->step_s = scenario.step_s;
  cell->description.gravity_m_per_s2 = scenario.gravity_m_per_s2;
  cell->description.level_of_detail = 1;
  for (const ScenarioProcess& process : scenario.processes) {
    cell->description.level_of_detail = std::max(cell->description.level_of_detail, process.level_of_detail);
  }
  const auto level_step_s = [&scenario](const Scenario::LevelSolver& own) {
    return own.step_s.value_or(scenario.solver_step_s);
  };
  cell->solver = {scenario.solver, scenario.tolerance, scenario.level_1_step_s(), scenario.matrix};
  cell->contact_solver = {scenario.contact_solver.method, scenario.contact_solver.tolerance,
                          level_step_s(scenario.contact_solver), scenario.matrix};
  if (scenario.dynamics_solver) {
    // Part, gripper and robot act on each other by springs: the stiffness is between the models.
    cell->dynamics_solver = {scenario.dynamics_solver->method, scenario.dynamics_solver->tolerance,
                             level_step_s(*scenario.dynamics_solver), SystemMatrix::coupled};
  }
  cell->interaction = {scenario.gravity_m_per_s2, scenario.contact_margin_m, scenario.weight_feed_forward,
                       scenario.sleeping.method != ScenarioSleeping::Method::never};
  cell->interaction.step_s = scenario.step_s;
  cell->interaction.algorithm = interaction_algorithm(scenario.algorithm);
  Import import{MeshLibrary(files, FaceOctreeCache(options.cache_directory)),
                ConvexImporter(scenario, options, files, *cell),
                {}};
  const SharedMeshes& meshes = import.meshes;
  for (const ScenarioPart& part : scenario.parts) add_part(scenario, part, import, *cell);
  add_pools(scenario, *cell);
  for (const ScenarioGround& ground : scenario.grounds) add_ground(scenario, ground, import, *cell);
  for (std::size_t r = 0; r < arms.size(); ++r) add_robot(scenario, scenario.robots[r], arms[r], *cell);
  for (const ScenarioGripper& gripper : scenario.grippers) add_gripper(scenario, gripper, import, *cell);
  note_units(scenario, *cell);
  add_world_bounds(scenario, *cell);
  add_dynamics(scenario, arms, meshes, *cell);
  std::vector<StatedWire> wires = add_devices(scenario, meshes, options.fmus, *cell);
  wires.insert(wires.end(), scenario.wires.begin(), scenario.wires.end());
  add_wires(wires, cell->description);
  cell->pairs = generate_pairs(cell->components);
  add_grip_friction(scenario, *cell);
  add_contact(scenario, meshes, *cell);
  find_start_overlaps(scenario, meshes, *cell);
  if (scenario.collision_checking.enabled) add_collision_checking(scenario, arms, meshes, *cell);
  check_step(scenario, *cell);
  return cell;
}

std::shared_ptr<const CellModel> load_cell(const std::filesystem::path& file, const ScenarioOptions& options,
                                           const ImportOptions& import) {
  return build_cell(read_scenario(file, options), import);
}

}  // namespace takt

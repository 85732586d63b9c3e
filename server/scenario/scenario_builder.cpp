#include "server/scenario/scenario_builder.h"

#include <algorithm>
#include <utility>

#include "idl/common/mesh_path.h"
#include "server/scenario/cell_builders.h"
#include "server/scenario/convex_import.h"
#include "server/scenario/world_bounds.h"
#include "server/simulation/step/step_limit.h"

namespace takt {

namespace {

/// By component, for surface contact.
using Meshes = std::vector<TriangleMesh>;

void describe_mesh(const TriangleMesh& mesh, const std::filesystem::path& file,
                   const std::array<float, 4>& color, ComponentDescription& description) {
  description.mesh_uri = mesh_label(file);
  description.color = color;
  for (const Vec3& v : mesh.vertices) {
    for (int i = 0; i < 3; ++i) description.vertices.push_back(static_cast<float>(v[i]));
  }
  for (const auto& t : mesh.triangles)
    description.triangles.insert(description.triangles.end(), t.begin(), t.end());
}

/// Notes the risks of the mesh for forces of surface contact, if the cell has any.
void look_after_contact(const Scenario& scenario, const std::string& component, const TriangleMesh& mesh,
                        bool carries_elements, CellModel& cell) {
  if (!scenario.begins_with_contact()) return;
  note_contact_risks(mesh, mesh_quality_options(scenario, component, mesh, carries_elements), cell);
}

int add_component(CellModel& cell, Component component, const TriangleMesh& mesh,
                  const std::filesystem::path& file, const std::array<float, 4>& color, Meshes& meshes) {
  meshes.push_back(mesh);
  component.box = bounding_box(component.convex);
  ComponentDescription description;
  description.name = component.name;
  description.type = component.type;
  description.hierarchy = component.hierarchy;
  description.mass_kg = component.mass_kg;
  description.p_BBcm = component.p_BBcm;
  describe_mesh(mesh, file, color, description);
  cell.description.components.push_back(std::move(description));
  cell.components.push_back(std::move(component));
  return static_cast<int>(cell.components.size()) - 1;
}

void add_part(const Scenario& scenario, const ScenarioPart& part, ConvexImporter& importer, CellModel& cell,
              Meshes& meshes) {
  const TriangleMesh mesh = import_component_mesh(part.name, part.mesh, part.mesh_scale, cell);
  look_after_contact(scenario, part.name, mesh, true, cell);
  Component component;
  component.name = part.name;
  component.type = ComponentType::part;
  component.hierarchy = part.hierarchy;
  component.convex = importer.shapes(part.name, part.mesh, part.mesh_scale, mesh, part.convex);
  component.mass_kg = part.mass_kg;
  const VolumeProperties volume = volume_properties(mesh);
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
  const int id = add_component(cell, std::move(component), mesh, part.mesh, part.color, meshes);
  cell.parts.push_back(
      {id, copy.mass_kg, copy.p_BBcm, copy.I_BBcm_B, scenario.gravity_m_per_s2, part.X_WB, part.V_WB});
}

void add_ground(const Scenario& scenario, const ScenarioGround& ground, ConvexImporter& importer,
                CellModel& cell, Meshes& meshes) {
  const TriangleMesh mesh = import_component_mesh(ground.name, ground.mesh, ground.mesh_scale, cell);
  look_after_contact(scenario, ground.name, mesh, false, cell);
  Component component;
  component.name = ground.name;
  component.type = ComponentType::ground;
  component.convex = importer.shapes(ground.name, ground.mesh, ground.mesh_scale, mesh, ground.convex);
  cell.grounds.push_back(
      {add_component(cell, std::move(component), mesh, ground.mesh, ground.color, meshes), ground.X_WB});
}

void add_robot(const Scenario& scenario, const ScenarioRobot& robot, const UrdfArm& urdf, CellModel& cell) {
  const std::string key = "robots." + robot.name + ".initial_joints_rad";
  const auto count = static_cast<std::size_t>(urdf.arm.joint_count());
  if (robot.initial_joints_rad.size() != count) {
    fail(scenario, key, std::to_string(robot.initial_joints_rad.size()) + " values",
         std::to_string(count) + ", one for each joint of " + robot.urdf.string());
  }
  KinematicRobotParameters parameters;
  parameters.robot = static_cast<int>(cell.robots.size());
  parameters.arm = urdf.arm;
  parameters.X_WR = robot.X_WR;
  for (std::size_t i = 0; i < count; ++i) {
    const JointModel& joint = urdf.arm.joints[i];
    const double q = robot.initial_joints_rad[i];
    if (q < joint.lower || q > joint.upper) {
      fail(scenario, key, std::to_string(q) + " for joint '" + joint.name + "'",
           "a value in [" + std::to_string(joint.lower) + ", " + std::to_string(joint.upper) + "]");
    }
    parameters.q_initial[i] = q;
  }
  cell.robots.push_back(parameters);
  CommandDeadline deadline;
  deadline.deadline_s = robot.deadline.command_deadline_s;
  deadline.action = robot.deadline.safe_action;
  for (std::size_t i = 0; i < count && robot.deadline.max_acceleration_rad_per_s2.given(); ++i)
    deadline.max_acceleration[i] = robot.deadline.max_acceleration_rad_per_s2.at(i);
  cell.description.robots.push_back(
      {robot.name, urdf.robot.text, urdf.arm, robot.X_WR, robot.command_period_s, deadline, urdf.links});
}

void add_gripper(const Scenario& scenario, const ScenarioGripper& gripper, ConvexImporter& importer,
                 CellModel& cell, Meshes& meshes) {
  const int index = static_cast<int>(cell.grippers.size());
  const int robot = cell.description.find_robot(gripper.robot);
  const TriangleMesh body = import_component_mesh(gripper.name, gripper.body_mesh, gripper.mesh_scale, cell);
  const TriangleMesh jaw = import_component_mesh(gripper.name, gripper.jaw_mesh, gripper.mesh_scale, cell);
  look_after_contact(scenario, gripper.name, body, false, cell);
  look_after_contact(scenario, gripper.name + "/left_jaw", jaw, true, cell);

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
      add_component(cell, std::move(palm), body, gripper.body_mesh, gripper.color, meshes);
  const ConvexShape jaw_hull =
      importer.shapes(gripper.name, gripper.jaw_mesh, gripper.mesh_scale, jaw, {}).front();
  for (const auto& [side, suffix, role] : {std::tuple{0, "/left_jaw", GripperRole::left_jaw},
                                           std::tuple{1, "/right_jaw", GripperRole::right_jaw}}) {
    Component component;
    component.name = gripper.name + suffix;
    component.type = ComponentType::gripper;
    component.gripper = index;
    component.role = role;
    component.convex = {jaw_hull};
    model.parameters.jaws[static_cast<std::size_t>(side)] =
        add_component(cell, std::move(component), jaw, gripper.jaw_mesh, gripper.color, meshes);
  }
  const Vec3 lower = jaw_hull.box.center_B - jaw_hull.box.half_B;
  const Vec3 upper = jaw_hull.box.center_B + jaw_hull.box.half_B;
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

void add_devices(const Scenario& scenario, const Meshes& meshes, CellModel& cell) {
  DeviceBuilder b(meshes, scenario.temperature_degC, cell);
  for (const DeviceType& type : device_types()) {
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

std::shared_ptr<const CellModel> build_cell(const Scenario& stated, const ImportOptions& import) {
  const std::optional<Scenario> placed = placed_at_nodes(stated);
  const Scenario& scenario = placed ? *placed : stated;
  auto cell = std::make_shared<CellModel>();
  cell->description.scenario = scenario.name;
  cell->description.step_s = cell->step_s = scenario.step_s;
  cell->description.gravity_m_per_s2 = scenario.gravity_m_per_s2;
  cell->description.level_of_detail = 1;
  for (const ScenarioProcess& process : scenario.processes) {
    cell->description.level_of_detail = std::max(cell->description.level_of_detail, process.level_of_detail);
  }
  cell->solver = {scenario.solver, scenario.tolerance, scenario.step_s, scenario.matrix};
  cell->contact_solver = {scenario.contact_solver.method, scenario.contact_solver.tolerance, scenario.step_s,
                          scenario.matrix};
  if (scenario.dynamics_solver) {
    // Part, gripper and robot act on each other by springs: the stiffness is between the models.
    cell->dynamics_solver = {scenario.dynamics_solver->method, scenario.dynamics_solver->tolerance,
                             scenario.step_s, SystemMatrix::coupled};
  }
  cell->interaction = {scenario.gravity_m_per_s2, scenario.contact_margin_m, scenario.weight_feed_forward,
                       scenario.sleeping.method != ScenarioSleeping::Method::never};
  cell->interaction.step_s = scenario.step_s;
  cell->interaction.algorithm = interaction_algorithm(scenario.algorithm);
  ConvexImporter importer(scenario, import, *cell);
  Meshes meshes;
  for (const ScenarioPart& part : scenario.parts) add_part(scenario, part, importer, *cell, meshes);
  for (const ScenarioGround& ground : scenario.grounds) add_ground(scenario, ground, importer, *cell, meshes);
  std::vector<UrdfArm> arms;
  for (const ScenarioRobot& robot : scenario.robots) {
    arms.push_back(read_urdf_arm(robot.urdf, robot.base_link, robot.flange_link));
    add_robot(scenario, robot, arms.back(), *cell);
  }
  for (const ScenarioGripper& gripper : scenario.grippers)
    add_gripper(scenario, gripper, importer, *cell, meshes);
  note_units(scenario, *cell);
  add_world_bounds(scenario, *cell);
  add_dynamics(scenario, arms, *cell);
  add_devices(scenario, meshes, *cell);
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

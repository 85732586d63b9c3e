#include "server/scenario/scenario_reader.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>
#include <sstream>

#include "idl/common/text.h"
#include "server/contact/holding/connection_rules.h"
#include "server/scenario/assertion_fields.h"
#include "server/scenario/collision_checking.h"
#include "server/scenario/contact_fields.h"
#include "server/scenario/device_builder.h"
#include "server/scenario/device_fields.h"
#include "server/scenario/dynamics_fields.h"
#include "server/scenario/scenario_names.h"
#include "server/scenario/yaml_fields.h"
#include "server/simulation/solver/integrator.h"

namespace takt {

namespace {

const NumberRange kPositive{.lower = 0.0, .lower_open = true};

// --set: replaces one value of the tree. Missing keys are created; whether they are known is checked when
// they are read.
void apply_override(YAML::Node& root, const std::string& text, YamlSource& source) {
  const std::size_t equals = text.find('=');
  if (equals == std::string::npos || equals == 0) {
    throw ScenarioError("--set " + text +
                        ": found no '='; allowed: key=value with a dotted key of the scenario file");
  }
  const std::string key = text.substr(0, equals);
  YAML::Node value;
  try {
    value = YAML::Load(text.substr(equals + 1));
  } catch (const YAML::Exception& error) {
    throw ScenarioError("--set " + text + ": the value is not valid YAML: " + error.msg);
  }
  std::vector<std::string> keys;
  std::stringstream stream(key);
  for (std::string part; std::getline(stream, part, '.');) keys.push_back(part);
  YAML::Node node = root;
  for (std::size_t i = 0; i + 1 < keys.size(); ++i) {
    YAML::Node next = node[keys[i]];
    if (next.IsDefined() && !next.IsNull() && !next.IsMap()) {
      throw ScenarioError("--set " + text + ": '" + keys[i] +
                          "' is not a mapping; allowed: the keys of the scenario file");
    }
    node.reset(next);
  }
  node[keys.back()] = value;
  source.overridden.insert(key);
}

std::array<float, 4> read_color(YamlFields& fields, const std::array<float, 4>& fallback) {
  if (!fields.has("color")) return fallback;
  const YAML::Node node = fields.optional("color");
  const NumberRange unit_interval{.lower = 0.0, .upper = 1.0};
  if (!node.IsSequence() || (node.size() != 3 && node.size() != 4)) {
    fields.fail("color", describe(node), "three or four numbers in [0, 1]: red, green, blue, alpha");
  }
  std::array<float, 4> color{0.0F, 0.0F, 0.0F, 1.0F};
  const std::vector<double> values = fields.numbers("color", node.size(), unit_interval);
  for (std::size_t i = 0; i < values.size(); ++i) color[i] = static_cast<float>(values[i]);
  return color;
}

const NumberRange kVolumeError{.lower = 0.0, .upper = 1.0, .lower_open = true};

ConvexSource read_convex_mapping(YamlFields fields) {
  using Kind = ConvexSource::Kind;
  ConvexSource source;
  const std::string method = fields.choice("method", {"hull", "objects", "file", "vhacd"}, "hull");
  source.kind = method == "vhacd"     ? Kind::vhacd
                : method == "objects" ? Kind::objects
                : method == "file"    ? Kind::file
                                      : Kind::hull;
  if (source.kind == Kind::file) source.file = fields.existing_file("file");
  source.max_volume_error = fields.number_if("max_volume_error", kVolumeError);
  if (source.kind == Kind::vhacd) {
    DecompositionParameters& d = source.decomposition;
    d.max_hulls = fields.integer_or("max_hulls", d.kMinHulls, d.kMaxHulls, d.max_hulls);
    d.resolution = fields.integer_or("resolution", d.kMinResolution, d.kMaxResolution, d.resolution);
    d.max_vertices_per_hull =
        fields.integer_or("max_vertices_per_hull", d.kMinVertices, d.kMaxVertices, d.max_vertices_per_hull);
    d.best_plane = fields.boolean_or("best_plane", d.best_plane);
    if (source.max_volume_error) d.max_volume_error = *source.max_volume_error;
  }
  fields.finish();
  return source;
}

ConvexSource read_convex(YamlFields& fields) {
  const YAML::Node node = fields.optional("convex");
  ConvexSource source;
  if (!node.IsDefined()) return source;
  if (node.IsMap()) return read_convex_mapping(fields.mapping("convex"));
  if (!node.IsScalar()) {
    fields.fail("convex", describe(node),
                "hull, objects, vhacd, the path of a file with one object per convex part, or a mapping "
                "{method: vhacd, max_hulls: 32, ...}");
  }
  if (node.Scalar() == "hull") return source;
  if (node.Scalar() == "objects" || node.Scalar() == "vhacd") {
    source.kind = node.Scalar() == "objects" ? ConvexSource::Kind::objects : ConvexSource::Kind::vhacd;
    return source;
  }
  source.kind = ConvexSource::Kind::file;
  source.file = fields.existing_file(node, "convex");
  return source;
}

void read_inertia(YamlFields& fields, ScenarioPart& part) {
  const bool has_center = fields.has("center_of_mass_m");
  const bool has_inertia = fields.has("inertia_kg_m2");
  if (has_center != has_inertia) {
    fields.fail(has_center ? "center_of_mass_m" : "inertia_kg_m2", "one of the two",
                "center_of_mass_m and inertia_kg_m2 together, or neither");
  }
  if (!has_center) return;
  part.center_of_mass_m = fields.vector_or("center_of_mass_m", Vec3::Zero(), "m");
  const std::vector<double> i = fields.numbers("inertia_kg_m2", 6);
  Mat3 inertia;
  inertia << i[0], i[3], i[4], i[3], i[1], i[5], i[4], i[5], i[2];
  if (!(inertia.diagonal().minCoeff() > 0.0) || !(inertia.determinant() > 0.0)) {
    fields.fail("inertia_kg_m2", describe(fields.optional("inertia_kg_m2")),
                "xx, yy, zz, xy, xz, yz of a positive definite tensor about the centre of mass");
  }
  part.inertia_kg_m2 = inertia;
}

void read_part(YamlFields fields, const std::string& name, Scenario& scenario) {
  ScenarioPart part;
  part.name = name;
  part.mesh = fields.existing_file("mesh");
  part.mesh_scale = fields.number_or("mesh_scale", kPositive, 1.0);
  part.convex = read_convex(fields);
  part.mass_kg = fields.number("mass_kg", positive("kg"));
  part.hierarchy = fields.integer("hierarchy", kMinHierarchy, kMaxHierarchy);
  part.X_WB = fields.pose_or_identity("pose");
  YamlFields twist = fields.mapping("twist");
  part.V_WB.v = twist.vector_or("velocity_m_per_s", Vec3::Zero(), "m/s");
  part.V_WB.w = twist.vector_or("angular_velocity_rad_per_s", Vec3::Zero(), "rad/s");
  twist.finish();
  part.color = read_color(fields, part.color);
  read_inertia(fields, part);
  YamlFields substitute = fields.mapping("substitute");
  part.allowed_position_error_m = substitute.number_if("allowed_position_error_m", positive("m"));
  part.damping_ratio = substitute.number_if("damping_ratio", kPositive);
  part.rotational_stiffness_N_m_per_rad =
      substitute.number_if("rotational_stiffness_N_m_per_rad", positive("N m/rad"));
  part.rotational_damping_N_m_s_per_rad =
      substitute.number_if("rotational_damping_N_m_s_per_rad", positive("N m s/rad"));
  substitute.finish();
  if (fields.has("heat")) part.heat = read_heat(fields.mapping("heat"), scenario.temperature_degC);
  if (fields.has("thread")) part.thread = read_thread(fields.mapping("thread"));
  fields.finish();
  scenario.parts.push_back(part);
}

void read_ground(YamlFields fields, const std::string& name, Scenario& scenario) {
  ScenarioGround ground;
  ground.name = name;
  ground.mesh = fields.existing_file("mesh");
  ground.mesh_scale = fields.number_or("mesh_scale", kPositive, 1.0);
  ground.convex = read_convex(fields);
  ground.X_WB = fields.pose_or_identity("pose");
  ground.color = read_color(fields, ground.color);
  fields.finish();
  scenario.grounds.push_back(ground);
}

void read_robot(YamlFields fields, const std::string& name, Scenario& scenario) {
  ScenarioRobot robot;
  robot.name = name;
  robot.urdf = fields.existing_file("urdf");
  robot.base_link = fields.text_or("base_link", robot.base_link);
  robot.flange_link = fields.text_or("flange_link", robot.flange_link);
  robot.X_WR = fields.pose_or_identity("pose");
  robot.initial_joints_rad = fields.angles("initial_joints", 0);
  robot.command_period_s = fields.number_or("command_period_s", positive("s"), robot.command_period_s);
  robot.deadline = read_command_deadline(fields, robot.command_period_s, robot.initial_joints_rad.size());
  if (fields.has("drives")) robot.drives = read_drives(fields.mapping("drives"));
  if (fields.has("power")) robot.power = read_power(fields.mapping("power"));
  if (fields.has("trajectory")) {
    robot.trajectory = read_trajectory(fields.mapping("trajectory"), robot.initial_joints_rad.size());
  }
  fields.finish();
  scenario.robots.push_back(robot);
}

void read_gripper(YamlFields fields, const std::string& name, Scenario& scenario) {
  ScenarioGripper gripper;
  gripper.name = name;
  gripper.robot = fields.text("robot");
  const bool known = std::any_of(scenario.robots.begin(), scenario.robots.end(),
                                 [&](const ScenarioRobot& r) { return r.name == gripper.robot; });
  if (!known)
    fields.fail("robot", "'" + gripper.robot + "'",
                "a robot of this scenario: " + list_names(scenario.robots));
  gripper.X_FG = fields.pose_or_identity("mount");
  gripper.X_GT = fields.pose_or_identity("tool_center_point");
  gripper.body_mesh = fields.existing_file("body_mesh");
  gripper.jaw_mesh = fields.existing_file("jaw_mesh");
  gripper.mesh_scale = fields.number_or("mesh_scale", kPositive, 1.0);
  gripper.max_width_m = fields.number("max_width_m", positive("m"));
  gripper.initial_width_m = fields.number_or(
      "initial_width_m", {.lower = 0.0, .upper = gripper.max_width_m, .unit = "m"}, gripper.max_width_m);
  gripper.jaw_speed_m_per_s = fields.number("jaw_speed_m_per_s", positive("m/s"));
  gripper.max_force_N = fields.number("max_force_N", positive("N"));
  gripper.mass_kg = fields.number_or("mass_kg", not_negative("kg"), 0.0);
  gripper.jaw_mass_kg = fields.number_if("jaw_mass_kg", positive("kg"));
  gripper.grasp_on_contact =
      fields.choice("grasp", {"on_command", "on_contact"}, "on_command") == "on_contact";
  gripper.color = read_color(fields, gripper.color);
  fields.finish();
  scenario.grippers.push_back(gripper);
}

void read_process(YamlFields fields, const std::string& name, Scenario& scenario) {
  ScenarioProcess process;
  process.name = name;
  process.level_of_detail = fields.integer("level_of_detail", kMinLevelOfDetail, kMaxLevelOfDetail);
  const YAML::Node members = fields.optional("members");
  if (members.IsDefined() && !(members.IsScalar() && members.Scalar() == "all")) {
    if (!members.IsSequence()) fields.fail("members", describe(members), "all, or a list of names");
    process.all_members = false;
    for (const YAML::Node& member : members) {
      if (!member.IsScalar()) fields.fail_at(member, "members", describe(member), "a name");
      process.members.push_back(member.Scalar());
    }
  }
  fields.finish();
  scenario.processes.push_back(process);
}

void read_expected(YamlFields& root, Scenario& scenario) {
  YamlFields expected = root.mapping("expected");
  scenario.expected_tolerance_m =
      expected.number_or("tolerance_m", positive("m"), scenario.expected_tolerance_m);
  YamlFields parts = expected.mapping("parts");
  for (const ScenarioPart& part : scenario.parts) {
    if (parts.has(part.name)) scenario.expected.push_back({part.name, parts.pose_or_identity(part.name)});
  }
  parts.finish();
  expected.finish();
}

void read_marks(YamlFields& root, const YamlSource& source, Scenario& scenario) {
  const YAML::Node marks = root.optional("marks");
  if (!marks.IsDefined()) return;
  if (!marks.IsSequence()) root.fail("marks", describe(marks), "a list of {name, time_s}");
  for (const YAML::Node& node : marks) {
    YamlFields fields(source, node, "marks");
    scenario.marks.push_back({fields.text("name"), fields.number("time_s", not_negative("s"))});
    fields.finish();
  }
}

void read_bounds(YamlFields& world, Scenario& scenario) {
  if (!world.has("bounds_m")) return;
  YamlFields bounds = world.mapping("bounds_m");
  for (const char* key : {"lower", "upper"})
    if (!bounds.has(key))
      world.fail("bounds_m", std::string("no '") + key + "'", "{lower: [x, y, z], upper: [x, y, z]}");
  const Vec3 lower = bounds.vector_or("lower", Vec3::Zero(), "m");
  const Vec3 upper = bounds.vector_or("upper", Vec3::Zero(), "m");
  bounds.finish();
  if (!(lower.array() < upper.array()).all())
    world.fail("bounds_m", "a lower that is not below upper along every axis",
               "{lower: [x, y, z], upper: [x, y, z]} with lower < upper");
  scenario.bounds_m = {lower, upper};
}

struct NamedDevice {
  std::string name;
};

void check_names(YamlFields& root, const Scenario& scenario) {
  std::set<std::string> names;
  const auto check = [&](const char* group, const auto& items) {
    for (const auto& item : items) {
      if (!is_scenario_name(item.name))
        root.fail(group, "the name '" + item.name + "'", kAllowedScenarioNames);
      if (!names.insert(item.name).second) {
        root.fail(group, "the name '" + item.name + "' again",
                  "names that are unique among parts, grounds, robots, grippers and devices");
      }
    }
  };
  check("parts", scenario.parts);
  check("grounds", scenario.grounds);
  check("robots", scenario.robots);
  check("grippers", scenario.grippers);
  for (const ScenarioProcess& process : scenario.processes) {
    for (const std::string& member : process.members) {
      if (names.count(member) == 0) {
        root.fail("processes", "the member '" + member + "' of " + process.name,
                  "names of parts, grounds, robots and grippers of this scenario");
      }
    }
  }
  check("furnaces", scenario.furnaces);
  check("screwdrivers", scenario.screwdrivers);
  std::vector<NamedDevice> heats;
  for (const ScenarioPart& part : scenario.parts)
    if (part.heat) heats.push_back({heat_device_name(part.name)});
  check("parts (heat)", heats);
  std::vector<NamedDevice> threads;
  for (const ScenarioPart& part : scenario.parts)
    if (part.thread) threads.push_back({thread_device_name(part.name)});
  check("parts (thread)", threads);
}

struct SolverKeys {
  bool method, tolerance, contact;
};

std::vector<std::string> contact_solver_names() {
  std::vector<std::string> names;
  for (const std::string_view name : solver_names())
    if (!solver_is_explicit(name)) names.emplace_back(name);
  return names;
}

Scenario::LevelSolver read_level_solver(YamlFields& fields, const std::vector<std::string>& names) {
  Scenario::LevelSolver solver;
  solver.method = fields.choice("method", names, solver.method);
  solver.tolerance = fields.number_or("tolerance", {.lower = 1e-12, .upper = 0.1}, solver.tolerance);
  solver.step_s = fields.number_if("step_s", {.lower = 0.0, .upper = 1.0, .lower_open = true, .unit = "s"});
  fields.finish();
  return solver;
}

/// What was said for the cell as a whole holds for levels 2 and 3 too where it came from the command line,
/// or where nothing was said of contact and the cell begins with it. Explicit methods never hold for contact:
/// in a file they are those of the other levels, on the command line of a cell that begins with contact they
/// are refused.
void choose_solver(const SolverKeys& given, const YamlSource& source, Scenario& scenario) {
  const bool only = scenario.begins_with_contact() && !given.contact;
  const auto overridden = [&source](const char* key) { return source.overridden.count(key) != 0; };
  const bool no_contact = solver_is_explicit(scenario.solver);
  if (no_contact && overridden("solver.method") && scenario.begins_with_contact()) {
    throw ScenarioError(
        source.file.string() + ": solver.method: found '" + scenario.solver +
        "' on the command line; allowed at level of detail 3: " + list_names(contact_solver_names()) +
        ". Explicit methods cannot follow surface contact.");
  }
  const auto take_over = [&](Scenario::LevelSolver& own, bool all) {
    const bool fits = !no_contact || &own != &scenario.contact_solver;
    if (fits && (overridden("solver.method") || (all && given.method))) {
      own.method = scenario.solver;
      own.tolerance = scenario.tolerance;
    }
    if (overridden("solver.tolerance") || (all && given.tolerance)) own.tolerance = scenario.tolerance;
  };
  take_over(scenario.contact_solver, only);
  if (scenario.dynamics_solver) take_over(*scenario.dynamics_solver, false);
  const Scenario::LevelSolver* initial = scenario.initial_level_solver();
  if (initial != nullptr && initial->step_s && !overridden("solver.step_s"))
    scenario.step_s = *initial->step_s;
}

/// Below `node`, whose key is `path`; `owner` is the name below a group such as parts.
void find_odd_angles(const YAML::Node& node, const std::string& path, const std::string& owner, int depth,
                     Scenario& scenario) {
  constexpr double kFullTurn = 2.0 * std::numbers::pi * (1.0 + 1e-9);
  for (const auto& entry : node) {
    const auto name = entry.first.as<std::string>(std::string());
    std::string key = path;
    if (!key.empty()) key += '.';
    key += name;
    const std::string& below = depth == 1 ? name : owner;
    if (entry.second.IsMap()) find_odd_angles(entry.second, key, below, depth + 1, scenario);
    if (name != "rpy_rad" || !entry.second.IsSequence()) continue;
    double largest = 0.0;
    for (const auto& angle : entry.second)
      if (std::abs(angle.as<double>(0.0)) > std::abs(largest)) largest = angle.as<double>(0.0);
    if (std::abs(largest) > kFullTurn) scenario.odd_angles.push_back({owner, key, largest});
  }
}

}  // namespace

Scenario read_scenario(const std::filesystem::path& file, const ScenarioOptions& options) {
  std::error_code unknown;
  if (std::filesystem::is_directory(file, unknown))
    throw ScenarioError(file.string() + ": a directory; a scenario is a file, NAME.yaml");
  YamlSource source{file, {}};
  YAML::Node root;
  try {
    root = YAML::LoadFile(file.string());
  } catch (const YAML::BadFile&) {
    throw ScenarioError(file.string() + ": the scenario file cannot be opened");
  } catch (const YAML::ParserException& error) {
    throw ScenarioError(file.string() + ":" + std::to_string(error.mark.line + 1) + ":" +
                        std::to_string(error.mark.column + 1) + ": not valid YAML: " + error.msg);
  }
  for (const std::string& text : options.overrides) apply_override(root, text, source);

  Scenario scenario;
  scenario.file = file;
  YamlFields top(source, root, "");
  top.integer("takt_scenario", 1, 1);
  scenario.name = top.text("name");
  scenario.description = top.text_or("description", "");
  scenario.duration_s = top.number_or("duration_s", not_negative("s"), 0.0);
  scenario.csv_period_s = top.number_or("csv_period_s", positive("s"), scenario.csv_period_s);

  YamlFields world = top.mapping("world");
  scenario.gravity_m_per_s2 = world.vector_or("gravity_m_per_s2", scenario.gravity_m_per_s2, "m/s^2");
  scenario.temperature_degC = world.number_or(
      "temperature_degC", {.lower = -273.0, .upper = 5000.0, .unit = "degC"}, scenario.temperature_degC);
  read_bounds(world, scenario);
  scenario.allow_overlap = read_name_pairs(world, "allow_overlap");
  world.finish();

  YamlFields solver = top.mapping("solver");
  const SolverKeys solver_is_given{solver.has("method"), solver.has("tolerance"), solver.has("contact")};
  const auto names = solver_names();
  scenario.solver = solver.choice("method", {names.begin(), names.end()}, scenario.solver);
  scenario.step_s =
      solver.number_or("step_s", {.lower = 0.0, .upper = 1.0, .lower_open = true, .unit = "s"}, 0.001);
  scenario.tolerance = solver.number_or("tolerance", {.lower = 1e-12, .upper = 0.1},
                                        solver_default_tolerance(scenario.solver));
  const std::string matrix = solver.choice("matrix", {"automatic", "separate", "coupled"}, "automatic");
  scenario.matrix = matrix == "coupled"    ? SystemMatrix::coupled
                    : matrix == "separate" ? SystemMatrix::separate
                                           : SystemMatrix::automatic;
  YamlFields contact_solver = solver.mapping("contact");
  scenario.contact_solver = read_level_solver(contact_solver, contact_solver_names());
  if (solver.has("dynamics")) {
    YamlFields dynamics_solver = solver.mapping("dynamics");
    scenario.dynamics_solver = read_level_solver(dynamics_solver, {names.begin(), names.end()});
  }
  solver.finish();

  YamlFields interaction = top.mapping("interaction");
  scenario.algorithm =
      interaction.choice("algorithm", {kInteractionAlgorithmNames.begin(), kInteractionAlgorithmNames.end()},
                         scenario.algorithm);
  scenario.weight_feed_forward = interaction.boolean_or("weight_feed_forward", scenario.weight_feed_forward);
  scenario.allowed_position_error_m =
      interaction.number_or("allowed_position_error_m", positive("m"), scenario.allowed_position_error_m);
  scenario.damping_ratio = interaction.number_or("damping_ratio", kPositive, scenario.damping_ratio);
  scenario.contact_margin_m =
      interaction.number_or("contact_margin_m", not_negative("m"), scenario.contact_margin_m);
  scenario.skip_resting = interaction.boolean_or("skip_resting", scenario.skip_resting);
  scenario.max_volume_error =
      interaction.number_or("max_volume_error", kVolumeError, scenario.max_volume_error);
  interaction.finish();

  for (auto& [name, fields] : top.entries("parts")) read_part(fields, name, scenario);
  for (auto& [name, fields] : top.entries("grounds")) read_ground(fields, name, scenario);
  for (auto& [name, fields] : top.entries("robots")) read_robot(fields, name, scenario);
  for (auto& [name, fields] : top.entries("grippers")) read_gripper(fields, name, scenario);
  read_devices(top, scenario);
  for (auto& [name, fields] : top.entries("processes")) read_process(fields, name, scenario);
  if (scenario.processes.empty()) scenario.processes.push_back({"cell", kMinLevelOfDetail, true, {}});
  if (options.level_of_detail) {
    const int level = *options.level_of_detail;
    if (level < kMinLevelOfDetail || level > kMaxLevelOfDetail) {
      throw ScenarioError("--lod: found " + std::to_string(level) + "; allowed: a whole number in [" +
                          std::to_string(kMinLevelOfDetail) + ", " + std::to_string(kMaxLevelOfDetail) + "]");
    }
    for (ScenarioProcess& process : scenario.processes) process.level_of_detail = level;
  }

  choose_solver(solver_is_given, source, scenario);
  read_contact(top, source, scenario);
  read_collision_checking(top, source, scenario);
  YamlFields controller = top.mapping("controller");
  if (controller.has("program")) scenario.controller_program = controller.existing_file("program");
  if (const YAML::Node given = controller.optional("parameters"); given.IsDefined()) {
    YamlFields parameters = controller.mapping("parameters");
    for (const auto& entry : given) {
      if (!entry.first.IsScalar()) controller.fail_at(given, "parameters", describe(entry.first), "a name");
      const std::string name = entry.first.Scalar();
      scenario.program_parameters[name] = parameters.number(name, {});
    }
  }
  controller.finish();
  read_marks(top, source, scenario);
  read_expected(top, scenario);
  read_assertions(top, scenario);
  top.finish();
  check_names(top, scenario);
  find_odd_angles(root, "", "", 0, scenario);
  return scenario;
}

}  // namespace takt

// The sections of a scenario file except contact, drives and assertions, which have files of their own.
#include "idl/common/mesh_path.h"
#include "server/contact/holding/connection_rules.h"
#include "server/fields/fields.h"
#include "server/scenario/scenario.h"
#include "server/simulation/solver/integrator.h"

namespace takt {

void describe(Fields& f, ConvexSource& s);

namespace {

constexpr NumberRange kScale{.lower = 0.0, .lower_open = true};
constexpr NumberRange kVolumeError{.lower = 0.0, .upper = 1.0, .lower_open = true};
constexpr NumberRange kStep{.lower = 0.0, .upper = 1.0, .lower_open = true, .unit = "s"};
constexpr NumberRange kTolerance{.lower = 1e-12, .upper = 0.1};
/// Beyond it is a wrong unit.
constexpr NumberRange kClearance{.lower = 0.0, .upper = 10.0, .unit = "m"};

/// The shorthand of `convex`: a word, or a file.
void read_convex_word(const FieldValue& value, ConvexSource& s) {
  using Kind = ConvexSource::Kind;
  if (!value.node.IsScalar())
    value.fail(describe_node(value.node),
               "hull, objects, vhacd, the path of a file with one object per convex part, or a mapping "
               "{method: vhacd, "
               "max_hulls: 32, ...}");
  const std::string& word = value.node.Scalar();
  s.kind = word == "hull"      ? Kind::hull
           : word == "objects" ? Kind::objects
           : word == "vhacd"   ? Kind::vhacd
                               : Kind::file;
  if (s.kind == Kind::file) ExistingFile::read(value, s.file);
}

void convex(Fields& f, ConvexSource& s) {
  if (const auto value = f.reading() ? f.find("convex") : std::nullopt; value && !value->node.IsMap())
    return read_convex_word(*value, s);
  f.section("convex",
            "Convex shapes for collision checks. Short forms: hull, objects, vhacd, or the path of a file "
            "with one object "
            "per convex part.",
            s, 0, "convex");
  f.or_else(Text::info());
}

template <class Item>
void mesh_fields(Fields& f, Item& s) {
  f.field("mesh", s.mesh, f.mesh(),
          "Closed mesh (OBJ, STL, GLB, DAE) in the frame of the component, m. FILE.glb#NODE is a node of a "
          "GLB file "
          "with the nodes below it, in the frame of the node.",
          kRequired);
  f.field("mesh_scale", s.mesh_scale, kScale, "Factor for the coordinates of the mesh, e.g. 0.001 for mm.");
  convex(f, s.convex);
}

template <class Item>
void common_fields(Fields& f, Item& s) {
  mesh_fields(f, s);
  f.pose("pose", s.X_WB, "Pose of the component in the world; of a part: at the start.");
  f.field(
      "at_node", s.at_node, Flag{},
      "With FILE.glb#NODE: `pose` is that of the file, its y axis upwards, and the component is where its "
      "node is in the file.");
  f.check(!s.at_node || !split_mesh_path(s.mesh).node.empty(), "at_node", "true",
          "only with a mesh FILE.glb#NODE");
  f.field("color", s.color, Color{}, "Red, green, blue, and alpha.", kNotInModel);
}

void mass_fields(Fields& f, ScenarioPart& s) {
  f.field("mass_kg", s.mass_kg, positive("kg"), "Mass.", kRequired);
  f.field("hierarchy", s.hierarchy, WholeRange{kMinHierarchy, kMaxHierarchy},
          "Place in the assembly: a part rests on, or sits in, parts of higher numbers.", kRequired);
}

void spring_fields(Fields& f, ScenarioPart& s) {
  f.field("center_of_mass_m", s.center_of_mass_m, vector3("m"),
          "Centre of mass; without it: that of the mesh at uniform density.");
  f.field("inertia_kg_m2", s.inertia_kg_m2, InertiaTensor{},
          "Inertia about the centre of mass: xx, yy, zz, xy, xz, yz; without it: that of the mesh at uniform "
          "density.");
  f.together("center_of_mass_m", "inertia_kg_m2");
  f.section("holding_spring",
            "Spring and damper between the part and its holder, at levels of detail 1 and 2.", [&] {
              f.field("allowed_position_error_m", s.allowed_position_error_m, positive("m"),
                      "Sag of the spring under the weight of the part: stiffness = m g / error; without it: "
                      "that of `interaction`.");
              f.field("damping_ratio", s.damping_ratio, kScale,
                      "Damping over critical damping; without it: that of `interaction`.");
              f.field("rotational_stiffness_N_m_per_rad", s.rotational_stiffness_N_m_per_rad,
                      positive("N m/rad"), "Stiffness against rotation; without it: by inertia.");
              f.field("rotational_damping_N_m_s_per_rad", s.rotational_damping_N_m_s_per_rad,
                      positive("N m s/rad"), "Damping against rotation; without it: by inertia.");
            });
}

}  // namespace

void describe(Fields& f, ConvexSource& s) {
  using Kind = ConvexSource::Kind;
  const Choice<Kind> methods{
      {{"hull", Kind::hull}, {"objects", Kind::objects}, {"file", Kind::file}, {"vhacd", Kind::vhacd}}};
  f.field("method", s.kind, methods,
          "Hull: one convex hull; objects: a hull for each object of the mesh; file: a hull for each object "
          "of another "
          "file; vhacd: decomposition by V-HACD.");
  f.when("method", methods, s.kind, {Kind::file},
         [&] { f.field("file", s.file, f.file(), "Mesh whose objects are the convex parts.", kRequired); });
  f.field("max_volume_error", s.max_volume_error, kVolumeError,
          "Share of the volume of the solid that may be lost or gained without a note; without it: that of "
          "`interaction`.");
  f.when("method", methods, s.kind, {Kind::vhacd}, [&] {
    DecompositionParameters& d = s.decomposition;
    f.field("max_hulls", d.max_hulls, WholeRange{d.kMinHulls, d.kMaxHulls},
            "Largest number of convex parts.");
    f.field("resolution", d.resolution, WholeRange{d.kMinResolution, d.kMaxResolution}, "Number of voxels.");
    f.field("max_vertices_per_hull", d.max_vertices_per_hull, WholeRange{d.kMinVertices, d.kMaxVertices},
            "Largest number of vertices of a part.");
    f.field("best_plane", d.best_plane, Flag{}, "Cut where the outline steps; false: always in the middle.");
    if (f.reading() && s.max_volume_error) d.max_volume_error = *s.max_volume_error;
  });
}

void describe(Fields& f, ScenarioPart& s) {
  common_fields(f, s);
  mass_fields(f, s);
  f.section("twist", "Velocity at the start, of the origin of the part, in axes of the world.", [&] {
    f.field("velocity_m_per_s", s.V_WB.v, vector3("m/s"), "Linear velocity.");
    f.field("angular_velocity_rad_per_s", s.V_WB.w, vector3("rad/s"), "Angular velocity.");
  });
  spring_fields(f, s);
  describe_part_devices(f, s.name, s.devices);
}

void describe(Fields& f, ScenarioPool& s) {
  f.field("count", s.count, WholeRange{1, kMaxPool},
          "Number of parts; their names are NAME_1, NAME_2 and so on.", kRequired);
  mesh_fields(f, s.part);
  f.field("color", s.part.color, Color{}, "Red, green, blue, and alpha.", kNotInModel);
  mass_fields(f, s.part);
  spring_fields(f, s.part);
  for (int i = 1; f.reading() && i <= s.count; ++i) f.add_name("parts", s.part_name(i));
}

void describe(Fields& f, ScenarioGround& s) {
  common_fields(f, s);
}

namespace {

void describe_deadline(Fields& f, ScenarioRobot& s) {
  ScenarioCommandDeadline& deadline = s.deadline;
  double& deadline_s = deadline.command_deadline_s;
  f.field("command_deadline_s", deadline_s, NumberRange{.lower = 0.0, .unit = "s"},
          "Longest silence (simulated) of a stream of set-points before safe_action; 0: any.");
  f.check(deadline_s == 0.0 || deadline_s >= s.command_period_s, "command_deadline_s",
          std::to_string(deadline_s) + " s",
          "at least command_period_s, " + std::to_string(s.command_period_s) + " s");
  f.field("safe_action", deadline.safe_action, choice_of<SafeAction>(),
          "After the deadline: hold the last set-point, or stop with max_acceleration_rad_per_s2.");
  std::vector<double>& limits = deadline.max_acceleration_rad_per_s2.values;
  f.field("max_acceleration_rad_per_s2", limits, ForJoints{positive("rad/s^2")},
          "Deceleration of that stop; m/s^2 for prismatic joints.");
  f.required_for("safe_action", {std::string(to_string(SafeAction::stop))});
  const std::string joints = std::to_string(s.initial_joints_rad.size());
  f.check(limits.size() <= 1 || limits.size() == s.initial_joints_rad.size(), "max_acceleration_rad_per_s2",
          std::to_string(limits.size()) + " values",
          s.initial_joints_rad.empty() ? "one, or as many as initial_joints_rad, which must then be given"
                                       : "one, or " + joints + ", one for each joint");
  f.check(deadline.safe_action != SafeAction::stop || !limits.empty(), "max_acceleration_rad_per_s2",
          "nothing (the key is missing)", "needed for safe_action: stop, in rad/s^2");
}

}  // namespace

void describe(Fields& f, ScenarioRobot& s) {
  f.field("urdf", s.urdf, f.file(), "URDF file of the arm.", kRequired);
  f.field("base_link", s.base_link, Text{},
          "Link of the URDF that stands at `pose`. Without it `base_link`, or else the root.");
  f.field(
      "flange_link", s.flange_link, Text{},
      "Link of the URDF that carries grippers. Without it `tool0`, or else the end of the moving joints.");
  f.pose("pose", s.X_WR, "Pose of the base in the world; with `mounted_on`: at the start.");
  f.field("mounted_on", s.mounted_on, f.name_of({"grounds"}, "a ground"),
          "Ground that it stands on and moves with, for instance the carriage of a linear axis; without it: "
          "the world.");
  f.angles("initial_joints", s.initial_joints_rad, 0,
           "Joint positions at the start; m for prismatic joints. Without it 0, or the middle of a range "
           "without 0.",
           0);
  f.field("mass_kg", s.mass_kg, positive("kg"),
          "Mass of the links without `<inertial>` together, which share it by the volume of their shapes.");
  f.field("command_period_s", s.command_period_s, positive("s"),
          "Period of the set-points of its controller.");
  describe_deadline(f, s);
  f.section("drives",
            "Drives of the joints, from level of detail 2 on. Each value: one number, or one for each joint.",
            s.drives);
  f.section("power", "Electrical power, from level of detail 2 on.", s.power);
  f.section("trajectory",
            "A synchronous point-to-point motion from initial_joints that the robot follows from time 0 on.",
            s.trajectory, [&](ScenarioTrajectory& t) {
              const std::size_t joints = s.initial_joints_rad.size();
              std::string profile = "trapezoid";
              f.field("profile", profile, choice_of(std::vector<std::string>{profile}),
                      "Profile of the speed.");
              f.check(joints > 0, "end_rad", "a robot without initial_joints_rad",
                      "a motion from initial_joints_rad, which must be given");
              f.angles("end", t.end_rad, joints, "Joint positions at the end.", kRequired);
              f.field("max_velocity_rad_per_s", t.max_velocity_rad_per_s, Numbers{joints, positive("rad/s")},
                      "Largest speed of each joint.", kRequired);
              f.field("max_acceleration_rad_per_s2", t.max_acceleration_rad_per_s2,
                      Numbers{joints, positive("rad/s^2")}, "Largest acceleration of each joint.", kRequired);
            });
}

namespace {

/// `auto`, or two names of joints.
struct FingerJoints {
  static std::string allowed() { return "auto, or a list of two names of joints"; }
  static void read(const FieldValue& value, ScenarioFingers& s) {
    if (value.node.IsScalar() && value.node.Scalar() == "auto") return;
    if (!value.node.IsSequence() || value.node.size() != 2) value.fail(describe_node(value.node), allowed());
    for (const YAML::Node& name : value.node) {
      if (!name.IsScalar()) value.part(name).fail(describe_node(name), "the name of a joint");
      s.joints.push_back(name.Scalar());
    }
  }
  static YAML::Node write(const ScenarioFingers& s) {
    return s.joints.empty() ? YAML::Node("auto") : ListOf<Text>{}.write(s.joints);
  }
  static KeyInfo info() {
    KeyInfo result = choice_of(std::vector<std::string>{"auto"}).info();
    result.other_forms = {ListOf<Text>{}.info()};
    return result;
  }
};

}  // namespace

void describe(Fields& f, ScenarioGripper& s) {
  f.field("robot", s.robot, f.name_of({"robots"}, "a robot"), "Robot that carries the gripper.", kRequired);
  f.pose("mount", s.X_FG, "Pose of the gripper on the flange.");
  f.pose("tool_center_point", s.X_GT, "Pose of the tool centre point in the gripper.");
  f.field(
      "fingers", s.fingers, FingerJoints{},
      "In place of meshes and mount: two joints of the robot's URDF that move the fingers, left and right, "
      "prismatic or by mimic joints; auto: those that the flange carries. Other keys of the gripper that are "
      "not given follow from the URDF.");
  f.field("body_mesh", s.body_mesh, f.mesh(), "Mesh of the body.");
  const auto needed = [&](const char* key, std::size_t most, const std::string& allowed) {
    f.alternatives({key, "fingers"}, 1, most, key,
                   f.has(key) ? "the key beside fingers" : "nothing (the key is missing)",
                   allowed + (most == 1 ? ", or fingers, but not both" : ""));
  };
  needed("body_mesh", 1, ExistingMesh::allowed());
  f.field("jaw_mesh", s.jaw_mesh, f.mesh(), "Mesh of the left jaw; the right one is the same, turned.");
  needed("jaw_mesh", 1, ExistingMesh::allowed());
  f.field("mesh_scale", s.mesh_scale, kScale, "Factor for the coordinates of both meshes.");
  f.field("max_width_m", s.max_width_m, positive("m"), "Largest distance of the jaws.");
  needed("max_width_m", 2, positive("m").allowed());
  f.field("initial_width_m", s.initial_width_m, not_negative("m"),
          "Distance of the jaws at the start; without it: the largest.");
  f.check(s.initial_width_m.value_or(0.0) <= s.max_width_m || !(s.max_width_m > 0.0), "initial_width_m",
          rounded_number(s.initial_width_m.value_or(0.0)),
          NumberRange{.lower = 0.0, .upper = s.max_width_m, .unit = "m"}.allowed());
  f.field("jaw_speed_m_per_s", s.jaw_speed_m_per_s, positive("m/s"), "Speed of each jaw.");
  needed("jaw_speed_m_per_s", 2, positive("m/s").allowed());
  f.field("max_force_N", s.max_force_N, positive("N"), "Largest force of each jaw.");
  needed("max_force_N", 2, positive("N").allowed());
  f.field("mass_kg", s.mass_kg, not_negative("kg"), "Mass, jaws included; needed from level of detail 2 on.");
  f.field("jaw_mass_kg", s.jaw_mass_kg, positive("kg"), "Mass of each jaw; without it: a tenth of all.");
  f.field("grasp", s.grasp,
          Choice<GraspRule>{{{"on_command", GraspRule::on_command}, {"on_contact", GraspRule::on_contact}}},
          "At level of detail 1 a part between the jaws is held from the close command on, or from the "
          "moment both jaws touch it.");
  f.field("color", s.color, Color{}, "Red, green, blue, and alpha.", kNotInModel);
}

namespace {

/// `all`, or a list of names.
struct Members {
  static std::string allowed() { return "all, or a list of names"; }
  static void read(const FieldValue& value, ScenarioProcess& s) {
    s.all_members = value.node.IsScalar() && value.node.Scalar() == "all";
    if (s.all_members) return;
    if (!value.node.IsSequence()) value.fail(describe_node(value.node), allowed());
    for (const YAML::Node& name : value.node) {
      if (!name.IsScalar()) value.part(name).fail(describe_node(name), "a name");
      s.members.push_back(name.Scalar());
    }
  }
  static YAML::Node write(const ScenarioProcess& s) {
    return s.all_members ? YAML::Node("all") : ListOf<Text>{}.write(s.members);
  }
  static KeyInfo info() {
    KeyInfo result = choice_of(std::vector<std::string>{"all"}).info();
    result.other_forms = {ListOf<Text>{}.info()};
    return result;
  }
};

}  // namespace

void describe(Fields& f, ScenarioProcess& s) {
  f.field("level_of_detail", s.level_of_detail, WholeRange{kMinLevelOfDetail, kMaxLevelOfDetail},
          "1: kinematic robots, holding springs; 2: dynamic robots; 3: surface contact.", kRequired);
  f.field("members", s, Members{}, "All, or names of parts, grounds, robots and grippers.");
}

void describe(Fields& f, ScenarioReportTime& s) {
  f.field("name", s.name, Text{}, "Name in the report.", kRequired | kNotInModel);
  f.field("time_s", s.time_s, not_negative("s"), "Simulated time.", kRequired | kNotInModel);
}

namespace {

struct PlacedPair {
  static std::string allowed() { return NamePair::allowed(); }
  static void read(const FieldValue& value, ScenarioCheckedPair& s) {
    NamePair::read(value, s.pair);
    s.place = value.place();
  }
  static YAML::Node write(const ScenarioCheckedPair& s) { return NamePair::write(s.pair); }
  static KeyInfo info() { return NamePair::info(); }
};

}  // namespace

void describe(Fields& f, ScenarioCheckedPair& s) {
  f.field("pair", s, PlacedPair{}, "Names or patterns of two bodies.", kRequired);
  f.field("min_clearance_m", s.min_clearance_m, kClearance, "A smaller distance of the two is reported.",
          kRequired);
}

void describe(Fields& f, ScenarioCollisionChecking& s) {
  bool on = s.enabled || !f.writing();
  const bool rules = !s.limits.empty() || !s.ignore.empty();
  f.field("enabled", on, Flag{}, "Default, where the section exists: true.", rules ? kAlwaysWritten : 0U);
  if (f.reading()) s.enabled = on;
  f.field("min_clearance_m", s.min_clearance_m, kClearance,
          "A smaller distance is reported, but between a gripper and a part; 0: only overlap is.");
  f.field("hysteresis_m", s.hysteresis_m, kClearance, "A report ends when the distance is larger by this.");
  f.list("limits", s.limits, "Clearances of pairs; of several that fit a pair the last one counts.",
         "a list of {pair: [NAME, NAME], min_clearance_m}");
  f.field("ignore", s.ignore, ListOf<PlacedPair>{{}, "a list of [NAME, NAME]"},
          "Pairs that are not checked.");
}

namespace {

std::vector<std::string_view> implicit_solver_names() {
  std::vector<std::string_view> names;
  for (const std::string_view name : solver_names())
    if (!solver_is_explicit(name)) names.push_back(name);
  return names;
}

template <class Names>
void describe_level_solver(Fields& f, Scenario::LevelSolver& s, const Names& names) {
  f.field("method", s.method, choice_of(names), "Method of integration.", kAlwaysWritten);
  f.field("tolerance", s.tolerance, kTolerance, "Relative tolerance of methods with error control.",
          kAlwaysWritten);
  f.field("step_s", s.step_s, kStep,
          "Communication step of a cell that begins at this level; without it: that of `solver`.");
}

void describe_solver(Fields& f, Scenario& s) {
  const auto written = [](bool stated) { return stated ? kAlwaysWritten : 0U; };
  if (f.reading()) s.solver_keys = {f.has("method"), f.has("tolerance"), f.has("contact")};
  using Matrix = SystemMatrix;
  f.field("method", s.solver, choice_of(solver_names()), "Method of integration at level of detail 1.",
          written(s.solver_keys.method));
  f.field("step_s", s.solver_step_s, kStep,
          "Step of methods without error control; communication step of the others.", kAlwaysWritten);
  if (f.reading()) s.tolerance = solver_default_tolerance(s.solver);
  if (!f.writing() || s.solver_keys.tolerance || s.tolerance != solver_default_tolerance(s.solver))
    f.field("tolerance", s.tolerance, kTolerance,
            "Relative tolerance of methods with error control; default: by method.", kAlwaysWritten);
  f.field(
      "matrix", s.matrix,
      Choice<Matrix>{
          {{"automatic", Matrix::automatic}, {"separate", Matrix::separate}, {"coupled", Matrix::coupled}}},
      "System matrix of implicit methods: a block for each model, or one for all.");
  if (!f.writing() || s.solver_keys.contact)
    f.section(
        "contact", "Solver while any process has level of detail 3; an implicit method.",
        [&] { describe_level_solver(f, s.contact_solver, implicit_solver_names()); }, kAlwaysWritten);
  f.section("dynamics",
            "Solver while the highest level of detail of all processes is 2; without it: the method of "
            "`solver`, or "
            "implicit where `solver` has none.",
            s.dynamics_solver,
            [&](Scenario::LevelSolver& own) { describe_level_solver(f, own, solver_names()); });
}

void describe_box(Fields& f, std::array<Vec3, 2>& box) {
  f.field("lower", box[0], vector3("m"), "Lower corner.", kRequired);
  f.field("upper", box[1], vector3("m"), "Upper corner.", kRequired);
  f.check((box[0].array() < box[1].array()).all(), "", "a lower that is not below upper along every axis",
          "{lower: [x, y, z], upper: [x, y, z]} with lower < upper");
}

void describe_world(Fields& f, Scenario& s) {
  f.field("gravity_m_per_s2", s.gravity_m_per_s2, vector3("m/s^2"), "Acceleration of gravity.");
  f.field("temperature_degC", s.temperature_degC, kTemperature_degC, "Temperature of the surroundings.");
  f.section("bounds_m", "Where parts may be; without it: around the cell, with room to spare.", s.bounds_m,
            [&](std::array<Vec3, 2>& bounds) { describe_box(f, bounds); });
  f.field("allow_overlap", s.allow_overlap, ListOf<NamePair>{{}, "a list of [NAME, NAME]"},
          "Pairs, names or patterns (*), that may stand inside each other at the start.", kNotInModel);
}

void describe_interaction(Fields& f, Scenario& s) {
  f.field("algorithm", s.algorithm, choice_of(kInteractionAlgorithmNames),
          "Rule that decides on the holder of a part, at levels of detail 1 and 2.");
  f.field("weight_feed_forward", s.weight_feed_forward, Flag{},
          "The holder of a part carries its weight by feed-forward; false: the spring alone does, and sags.");
  f.field("allowed_position_error_m", s.allowed_position_error_m, positive("m"),
          "Sag of a holding spring under the weight of its part: stiffness = m g / error.");
  f.field("damping_ratio", s.damping_ratio, kScale, "Damping of holding springs over critical damping.");
  f.field("contact_margin_m", s.contact_margin_m, not_negative("m"),
          "Components that are closer than this touch.");
  f.field("max_volume_error", s.max_volume_error, kVolumeError,
          "Share of the volume of a solid that its convex shapes may lose or gain without a note.",
          kNotInModel);
}

void describe_sleeping(Fields& f, ScenarioSleeping& s) {
  using Method = ScenarioSleeping::Method;
  f.field(
      "method", s.method,
      Choice<Method>{{{"threshold", Method::threshold}, {"exact", Method::exact}, {"never", Method::never}}},
      "Never: every part is computed in every step; exact: parts at rest are left out if that changes no "
      "bit; "
      "threshold: parts in surface contact are also left out after time_to_sleep_s below speed_m_per_s.",
      kNotInModel);
  f.field("speed_m_per_s", s.speed_m_per_s, positive("m/s"),
          "No point of a part that falls asleep is faster.", kNotInModel);
  f.field("time_to_sleep_s", s.time_to_sleep_s, not_negative("s"),
          "For how long, and no less than two steps.", kNotInModel);
}

const ListOf<Text> kTags{{}, "a list of words"};

}  // namespace

void describe(Fields& f, ScenarioNamedPose& s) {
  f.field("description", s.description, Text{}, "One sentence.");
  f.field("tags", s.tags, kTags, "Words by which clients choose poses.");
  f.pose("pose", s.X_WP, "Pose in the world.");
  f.section("bounds_m", "Room there, in the frame of the pose; without it: unbounded.", s.bounds_m,
            [&](std::array<Vec3, 2>& bounds) { describe_box(f, bounds); });
}

void describe(Fields& f, ScenarioHeading& s) {
  int format = 1;
  f.field("takt_scenario", format, WholeRange{1, 1}, "Version of the format.", kRequired | kNotInModel);
  f.field("name", s.name, Text{}, "Name of the scenario.", kRequired | kNotInModel);
  f.field("description", s.description, Text{}, "One sentence.", kNotInModel);
  f.field("tags", s.tags, kTags, "Words by which clients choose scenarios.", kNotInModel);
}

void describe(Fields& f, Scenario& s) {
  describe(f, static_cast<ScenarioHeading&>(s));
  f.field("duration_s", s.duration_s, not_negative("s"), "Simulated duration of a run; 0: open end.",
          kNotInModel);
  f.field("csv_period_s", s.csv_period_s, positive("s"), "Period of recordings of takt-run.", kNotInModel);
  f.section("world", "The surroundings.", [&] { describe_world(f, s); });
  f.section("solver", "Integration of the equations of motion.", [&] { describe_solver(f, s); });
  f.section("interaction", "Holders of parts at levels of detail 1 and 2, and contact of components.",
            [&] { describe_interaction(f, s); });
  f.section("sleeping", "Parts at rest.", [&] { describe_sleeping(f, s.sleeping); });
  f.entries("parts", s.parts, "The parts that are assembled.", "A rigid body that moves freely.",
            kNamesTopics);
  f.entries("pools", s.pools, "Identical parts that sources bring into the cell and sinks take out of it.",
            "Parts of one kind; parked, outside of the cell, at the start.", kNamesTopics);
  f.entries("grounds", s.grounds, "Bodies that stand still.", "A body that never moves.", kNamesTopics);
  f.entries("robots", s.robots, "Robot arms, and other machines with joints.",
            "A chain of joints from a URDF file.", kNamesTopics);
  f.entries("grippers", s.grippers, "Parallel grippers.", "A parallel gripper on the flange of a robot.",
            kNamesTopics);
  describe_devices(f, s.devices);
  f.field(
      "wires", s.wires, WireRule{},
      "Inputs that follow other signals, e.g. Gripper1.close: not Barrier1.clear. A wired input cannot be "
      "commanded.");
  f.entries("processes", s.processes,
            "Groups of components with a level of detail; without any: all, at level 1.", "One group.");
  s.contact.given = s.contact.given || f.has("contact");
  f.section("contact",
            "Surface contact (level of detail 3). With the section that level can be switched to while the "
            "cell runs.",
            s.contact, s.contact.given ? kAlwaysWritten : 0U);
  if (!f.reading() || f.has("collision_checking"))
    f.section("collision_checking", "Checks of robot programs for collisions. They report and never act.",
              s.collision_checking, s.collision_checking.enabled ? kAlwaysWritten : 0U);
  f.section(
      "controller", "Program of the emulated robot controller.",
      [&] {
        f.field("program", s.controller_program, f.file(), "Lua program.", kNotInModel);
        f.field("parameters", s.program_parameters, NumberMap{},
                "Numbers that replace defaults of the program.", kNotInModel);
      },
      kNotInModel);
  f.entries("named_poses", s.named_poses, "Poses that clients can ask for, e.g. places to put parts.",
            "A named pose.", kNotInModel);
  f.list("report_at", s.report_at, "Instants whose poses and forces go into the report.",
         "a list of {name, time_s}", kNotInModel);
  f.section(
      "expected", "Where parts must be at the end.",
      [&] { describe_expected(f, s.expected, s.expected_tolerance_m, f.name_of({"parts"}, "").names); },
      kNotInModel);
  describe_assertions(f, s);
}

}  // namespace takt

#pragma once
// A scenario: the user's description of a cell, as plain structs with defaults. scenario_reader reads it from
// YAML, or C++ code fills it; scenario_builder turns it into a CellModel. The describe() functions
// (server/fields/fields.h) in the *_fields.cpp files define the keys of the file, their meaning and their
// values.
#include <algorithm>
#include <array>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "plant_models/spatial.h"
#include "server/devices/device_type.h"
#include "server/fields/expected_poses.h"
#include "server/geometry/convex/decomposition.h"
#include "server/scenario/scenario_assertions.h"
#include "server/scenario/scenario_contact.h"
#include "server/scenario/scenario_dynamics.h"
#include "server/scenario/wires.h"
#include "server/simulation/model/cell_model.h"
#include "server/simulation/model/solver.h"

namespace takt {

/// Source of the convex shapes for the collision check.
struct ConvexSource {
  enum class Kind { hull, objects, file, vhacd } kind = Kind::hull;
  std::filesystem::path file;  ///< kind `file`: a hand-made decomposition, each object one convex part
  DecompositionParameters decomposition;  ///< kind `vhacd`
  /// Share of the solid's volume that may be lost or gained without a note; unset: that of `interaction`.
  std::optional<double> max_volume_error;
};

struct ScenarioPart {
  std::string name;
  std::filesystem::path mesh;  ///< or FILE.glb#NODE (split_mesh_path)
  double mesh_scale = 1.0;
  ConvexSource convex;
  bool at_node = false;  ///< X_WB is the pose of the GLB file, the component is where its node is in it
  double mass_kg = 0.0;
  int hierarchy = 1;
  Pose X_WB;
  Twist V_WB;  ///< at the start; of the origin of B, axes of the world
  std::array<float, 4> color{0.7F, 0.7F, 0.7F, 1.0F};
  /// Both or neither; the default follows from the closed mesh at uniform density.
  std::optional<Vec3> center_of_mass_m;
  std::optional<Mat3> inertia_kg_m2;
  // Spring that holds this Part at levels of detail 1 and 2; unset values come from `interaction`.
  std::optional<double> allowed_position_error_m, damping_ratio;
  std::optional<double> rotational_stiffness_N_m_per_rad, rotational_damping_N_m_s_per_rad;
  std::vector<StatedDevice> devices;  ///< of kinds that belong to a Part
  /// Its device of this kind, or null.
  const StatedDevice* device(std::string_view key) const {
    for (const StatedDevice& device : devices)
      if (key == device.type->key) return &device;
    return nullptr;
  }
};

/// Identical Parts that sources bring into the cell and sinks take out of it (server/devices/part_flow.h).
struct ScenarioPool {
  std::string name;
  int count = 0;      ///< of Parts, NAME_1 to NAME_count
  ScenarioPart part;  ///< each of them; without pose, twist and devices
  std::string part_name(int number) const { return name + "_" + std::to_string(number); }
};
inline constexpr int kMaxPool = 10000;

struct ScenarioGround {
  std::string name;
  std::filesystem::path mesh;  ///< or FILE.glb#NODE (split_mesh_path)
  double mesh_scale = 1.0;
  ConvexSource convex;
  bool at_node = false;  ///< X_WB is the pose of the GLB file, the component is where its node is in it
  Pose X_WB;
  std::array<float, 4> color{0.6F, 0.6F, 0.55F, 1.0F};
};

struct ScenarioRobot {
  std::string name;
  std::filesystem::path urdf;
  std::string base_link, flange_link;  ///< empty: urdf_ends()
  Pose X_WR;
  std::string mounted_on;  ///< a Ground; empty: the world
  std::vector<double>
      initial_joints_rad;         ///< m for prismatic joints; empty: 0, or the middle of ranges without 0
  std::optional<double> mass_kg;  ///< of the links without <inertial>, together
  double command_period_s = 0.008;
  ScenarioCommandDeadline deadline;
  // From LoD 2 on.
  ScenarioDrives drives;
  ScenarioPower power;
  std::optional<ScenarioTrajectory> trajectory;
};

/// Finger joints of a robot's URDF that make a gripper.
struct ScenarioFingers {
  std::vector<std::string> joints;  ///< left, right; empty: the two prismatic joints that the flange carries
};

struct ScenarioGripper {
  std::string name;
  std::string robot;
  Pose X_FG;  ///< mount
  Pose X_GT;  ///< tool centre point
  /// In place of mount and meshes, and of what else is not given below. build_cell() fills those members (with_fingers).
  std::optional<ScenarioFingers> fingers;
  std::filesystem::path body_mesh, jaw_mesh;
  double mesh_scale = 1.0;  ///< of both
  double max_width_m = 0.0;
  std::optional<double> initial_width_m;  ///< unset: the largest
  double jaw_speed_m_per_s = 0.0;
  double max_force_N = 0.0;
  double mass_kg = 0.0;               ///< all of it, jaws included
  std::optional<double> jaw_mass_kg;  ///< of each jaw; unset: a tenth of all
  GraspRule grasp = GraspRule::on_command;
  std::array<float, 4> color{0.25F, 0.25F, 0.28F, 1.0F};
};

struct ScenarioProcess {
  std::string name;
  int level_of_detail = 1;
  bool all_members = true;
  std::vector<std::string> members;  ///< components, robots, grippers
};

/// An instant whose poses and wrenches are reported.
struct ScenarioReportTime {
  std::string name;
  double time_s = 0.0;
};

/// Rule by which Parts at rest are left out of the computation.
struct ScenarioSleeping {
  enum class Method { threshold, exact, never } method = Method::threshold;
  double speed_m_per_s = SleepingParameters{}.speed_m_per_s;
  double time_to_sleep_s = SleepingParameters{}.time_to_sleep_s;
};

/// Two name patterns, `*` standing for any characters: names of parts, grounds and grippers,
/// gripper/left_jaw, robot/link. Which comes first does not matter.
struct ScenarioCheckedPair {
  std::array<std::string, 2> pair;
  double min_clearance_m = 0.0;  ///< of a limit
  std::string place;             ///< file, line, column and key
};

/// Collision checking of robot programs. It is off without the section.
struct ScenarioCollisionChecking {
  bool enabled = false;
  double min_clearance_m = 0.0;  ///< of pairs without a limit of their own, but for gripper and Part
  double hysteresis_m = 0.001;
  std::vector<ScenarioCheckedPair> limits;  ///< of several that fit a pair the last one counts
  std::vector<ScenarioCheckedPair> ignore;
};

/// A pose that clients can ask for, e.g. a place to put a Part.
struct ScenarioNamedPose {
  std::string name;
  std::string description;
  std::vector<std::string> tags;
  Pose X_WP;
  std::optional<std::array<Vec3, 2>> bounds_m;  ///< room there, in the frame of the pose: lower, upper
};

/// What lists of scenario files show.
struct ScenarioHeading {
  std::string name;
  std::string description;
  std::vector<std::string> tags;
};

/// Solver while any process has a higher level of detail than 1.
struct ScenarioLevelSolver {
  std::string method{kAutomaticSolver};
  double tolerance = solver_default_tolerance(kAutomaticSolver);
  std::optional<double> step_s;  ///< communication step of a cell that begins at that level
};

struct Scenario : ScenarioHeading {
  std::filesystem::path file;
  double duration_s = 0.0;  ///< 0: open end
  double csv_period_s = 0.01;
  Vec3 gravity_m_per_s2{0.0, 0.0, -9.80665};
  double temperature_degC = 20.0;  ///< of the surroundings
  /// `world.bounds_m`: where Parts may be; unset: around the cell, with room to spare.
  std::optional<std::array<Vec3, 2>> bounds_m;
  /// Angles in radians of more than a full turn, wherever the file has them.
  struct OddAngle {
    std::string owner, key;  ///< name of the component; dotted
    double value_rad = 0.0;
  };
  std::vector<OddAngle> odd_angles;
  /// `world.allow_overlap`: pairs of name patterns that may overlap at the start.
  std::vector<std::array<std::string, 2>> allow_overlap;
  /// Keys stated in the section `solver`; other values may follow from the rest of the section.
  struct SolverKeys {
    bool method = false, tolerance = false, contact = false;
  };
  SolverKeys solver_keys;
  std::string solver = "rk4";
  static constexpr double kDefaultStep_s = 0.001;
  double step_s = kDefaultStep_s;         ///< initial step: of the section of `solver` in effect at the start
  double solver_step_s = kDefaultStep_s;  ///< `solver.step_s`
  /// Without a named method the steps suit the default one.
  double level_1_step_s() const {
    return solver_keys.method ? solver_step_s : std::min(solver_step_s, kDefaultStep_s);
  }
  double tolerance = 1e-6;                        ///< of solvers with error control
  SystemMatrix matrix = SystemMatrix::automatic;  ///< solver.matrix: automatic, separate or coupled
  using LevelSolver = ScenarioLevelSolver;
  LevelSolver contact_solver;  ///< `solver.contact`: while any process has level 3
  /// `solver.dynamics`: else, while any has level 2; unset: `solver`.
  std::optional<LevelSolver> dynamics_solver;
  std::vector<ScenarioProcess> processes;
  bool begins_with(int level) const {
    for (const ScenarioProcess& process : processes)
      if (process.level_of_detail == level) return true;
    return false;
  }
  bool begins_with_contact() const { return begins_with(3); }
  /// The section of `solver` in effect at the start; nullptr: `solver` itself.
  const LevelSolver* initial_level_solver() const {
    if (begins_with_contact()) return &contact_solver;
    return dynamics_solver && begins_with(2) ? &*dynamics_solver : nullptr;
  }
  /// The solver at the start.
  const std::string& initial_solver() const {
    return initial_level_solver() != nullptr ? initial_level_solver()->method : solver;
  }
  double initial_tolerance() const {
    return initial_level_solver() != nullptr ? initial_level_solver()->tolerance : tolerance;
  }
  // interaction
  std::string algorithm = "partner_search";  ///< or substitute_force, extended_substitute_force
  bool weight_feed_forward = true;
  double allowed_position_error_m = 0.0001;
  double damping_ratio = 1.0;
  double contact_margin_m = 0.0002;
  /// Of the convex shapes of a component, as a share; a larger one is reported.
  double max_volume_error = 0.05;
  std::vector<ScenarioPart> parts;
  std::vector<ScenarioPool> pools;
  std::vector<std::string> deleted;  ///< by request: Parts that the file has, and its rules may name
  std::vector<ScenarioGround> grounds;
  std::vector<ScenarioRobot> robots;
  std::vector<ScenarioGripper> grippers;
  /// Of kinds that belong to the cell, by kind in the order of device_types().
  std::vector<StatedDevice> devices;
  std::vector<ScenarioWire> wires;
  ScenarioSleeping sleeping;
  ScenarioContact contact;
  ScenarioCollisionChecking collision_checking;
  std::filesystem::path controller_program;          ///< empty: without program
  std::map<std::string, double> program_parameters;  ///< instead of the program's own defaults
  std::vector<ScenarioNamedPose> named_poses;
  std::vector<ScenarioReportTime> report_at;
  std::vector<ExpectedPose> expected;  ///< analytic poses at the end
  double expected_tolerance_m = kExpectedTolerance_m;
  std::vector<ScenarioAssertion> assertions;
};

/// Levels of detail (thesis Table 3.4).
inline constexpr int kMinLevelOfDetail = 1;
inline constexpr int kMaxLevelOfDetail = 3;

void describe(Fields& f, Scenario& s);
/// Its first keys alone.
void describe(Fields& f, ScenarioHeading& s);

/// Bounds of the hierarchy of a Part.
inline constexpr int kMinHierarchy = 1;
inline constexpr int kMaxHierarchy = 1000;

}  // namespace takt

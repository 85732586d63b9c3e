#pragma once
// Everything about a loaded cell that is constant while it runs. Many simulations may share one model.
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "plant_models/gripper/parallel_gripper.h"
#include "plant_models/mechanics/rigid_body.h"
#include "plant_models/robot/detailed_drive.h"
#include "plant_models/robot/dynamic_robot.h"
#include "plant_models/robot/ideal_servo.h"
#include "plant_models/robot/kinematic_robot.h"
#include "plant_models/robot/signal_drive.h"
#include "plant_models/robot/simplified_drive.h"
#include "server/components/pair_generation.h"
#include "server/contact/clearance/clearance_model.h"
#include "server/contact/holding/component_interaction.h"
#include "server/contact/surface/contact_model.h"
#include "server/simulation/model/cell_description.h"
#include "server/simulation/model/part_mechanism.h"
#include "server/simulation/model/solver.h"

namespace takt {

/// Condition under which a closed gripper holds a Part at LoD 1.
enum class GraspRule : std::uint8_t {
  on_command,  ///< from the close command on, every Part in the space between the jaws (thesis 5.2.2)
  on_contact,  ///< from the moment both jaws touch the Part
};

struct GripperModel {
  ParallelGripperParameters parameters;
  GraspRule rule = GraspRule::on_command;
  double max_force_N = 0.0;
  std::vector<double> friction{};  ///< of the jaws, by component; empty: that of ContactParameters
  /// Advance of a jaw's reference beyond the contact at which the drive reaches its largest force.
  double press_m = 0.0;
  // Extent of the grip faces in the jaw frames: the grasp volume lies between them.
  double face_x_lower_m = 0.0, face_x_upper_m = 0.0, face_z_lower_m = 0.0, face_z_upper_m = 0.0;
};

struct GroundModel {
  int component = -1;
  Pose X_WB;
};

/// Result of the import of a component's mesh for the collision check. Shares are of the solid's volume.
struct ConvexImport {
  std::string component;
  std::string method;  ///< hull, objects, file, vhacd
  int hulls = 0;
  double lost = 0.0;    ///< share of the solid that no part covers
  double gained = 0.0;  ///< share that lies in parts outside the solid
  double solid_volume_m3 = 0.0, union_volume_m3 = 0.0;
  double seconds = 0.0;  ///< import time, if the importer was given a clock
  bool from_cache = false;
};

/// A result of the import that must be reported to the user: the convex shapes of a component are further
/// from the solid than allowed, its mesh was repaired or would falsify forces of surface contact, or the
/// inertias of a robot are physically impossible.
struct ImportNote {
  std::string component;  ///< or the robot
  std::string sentence;
  struct Shapes {
    int hulls = 0;
    double volume_error = 0.0;  ///< lost and gained together
  };
  std::optional<Shapes> shapes{};  ///< of a component
};

using DriveParameters = std::variant<IdealServoParameters, SimplifiedDriveParameters, DetailedDriveParameters,
                                     SignalDriveParameters>;

/// Dynamics of a robot above LoD 1.
struct RobotDynamics {
  DynamicRobotParameters parameters;
  std::vector<DriveParameters> drives;  ///< by joint of the arm
};
std::vector<std::unique_ptr<Drive>> make_drives(const std::vector<DriveParameters>& drives);

/// A plant model besides robots, grippers and Parts: a furnace, a press, a test's own. It moves no component.
/// One with signals is a DeviceModel and has its description at CellDescription::devices[device].
struct AuxiliaryModel {
  std::string name;
  std::function<std::unique_ptr<PlantModel>()> make;  ///< called once by every simulation
  int device = -1;                                    ///< -1: it has no signals
  std::uint64_t digest = 0;                           ///< hash of its parameters, part of the model hash
};

/// A mechanism that holds, moves or releases Parts between steps (part_mechanism.h).
struct MechanismModel {
  std::string name;
  std::shared_ptr<void> model{};                           ///< constant while the cell runs
  std::function<std::unique_ptr<PartMechanism>()> make{};  ///< called once by every simulation
};

/// Where Parts may be.
struct WorldBounds {
  Vec3 lower_W = Vec3::Zero(), upper_W = Vec3::Zero();
};

/// A Part that penetrates a Part or Ground in the initial state, deeper than any fit.
struct StartOverlap {
  int part = -1, other = -1;
  std::string sentence;
};

/// Identical Parts that sources and sinks bring into the cell and take out of it. All are parked at the start.
struct PartPool {
  std::string name;
  std::vector<int> parts;  ///< components, ascending
};

struct CellModel {
  CellDescription description;
  double step_s = 0.001;
  SolverParameters solver;
  SolverParameters contact_solver;  ///< while pairs act by surface contact
  /// Solver while a robot is dynamic; std::nullopt: `solver`.
  std::optional<SolverParameters> dynamics_solver;
  std::vector<Component> components;
  ComponentPairs pairs;
  InteractionParameters interaction;
  std::vector<RigidBodyParameters> parts;  ///< by Part, in order of component id
  std::vector<GroundModel> grounds;
  std::optional<WorldBounds> bounds;  ///< std::nullopt: Parts may be anywhere
  std::vector<KinematicRobotParameters> robots;
  std::vector<std::optional<RobotDynamics>> dynamics;     ///< by robot; std::nullopt: only kinematic
  std::vector<std::string> no_dynamics;                   ///< by robot: why, for error texts
  std::vector<int> robot_levels;                          ///< by robot: level of detail at the start
  std::vector<std::vector<TrajectoryKnot>> trajectories;  ///< by robot; followed from time 0 on, or empty
  std::vector<GripperModel> grippers;
  ContactModel contact;
  std::vector<AuxiliaryModel> auxiliary_models;
  std::vector<MechanismModel> mechanisms;
  std::vector<std::pair<int, int>> joined;  ///< components that a mechanism joins at the start: Part, holder
  ClearanceModel clearance;
  std::vector<ConvexImport> convex_imports;
  std::vector<ImportNote> import_notes;
  std::vector<StartOverlap> start_overlaps;  ///< with these the cell does not run
  std::vector<PartPool> pools;
};

/// X_WR of every robot; std::nullopt for one on a Ground, which may move.
inline std::vector<std::optional<Pose>> base_poses(const CellModel& cell) {
  std::vector<std::optional<Pose>> result;
  for (const KinematicRobotParameters& robot : cell.robots)
    result.push_back(robot.mount < 0 ? std::optional(robot.X_WR) : std::nullopt);
  return result;
}

}  // namespace takt

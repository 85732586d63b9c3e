#pragma once
// Requests of clients to the plant: joint set-points and trajectories, gripper and device commands, already
// validated against the cell.
//
// A command is fixed-size plain data, so that passing it on neither allocates nor locks for long. Only the
// functions below make commands, and they check every possible mistake of a sender: the simulation may apply
// every command.
#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "plant_models/device_model.h"
#include "plant_models/robot/arm_kinematics.h"
#include "plant_models/robot/joint_path.h"
#include "server/simulation/model/sim_time.h"
#include "takt_enumerations.h"

namespace takt {

struct CellDescription;

/// Joint set-point of one robot: be at `position` with `velocity` one command period after the command takes
/// effect; or torques of its joints.
struct JointCommand {
  int robot = -1;             ///< index into CellDescription::robots
  SimTime stamp;              ///< simulated time the sender meant
  double period_s = 0.0;      ///< the sender's command period; 0: the robot's own (RobotDescription)
  bool has_velocity = false;  ///< velocities were sent; otherwise they follow from successive positions
  bool has_effort = false;    ///< efforts were sent; otherwise they are zero from here on
  /// Efforts alone were sent: they move the joints, besides the torques that carry the robot's own weight,
  /// and there is no position control until the next set-point (LoD 2 and 3). Position and velocity are 0.
  bool torque_mode = false;
  JointArray position{};  ///< rad or m, in the order of the robot's joints
  JointArray velocity{};  ///< rad/s or m/s
  /// Feed-forward of the drives (LoD 2 and 3), at the joints: N m or N. It takes effect at once and lasts
  /// until the next command of the robot, a missed deadline or a reset.
  JointArray effort{};
};

struct GripperCommand {
  int gripper = -1;  ///< index into CellDescription::grippers
  SimTime stamp;     ///< simulated time the sender meant
  GripperAction action = GripperAction::open;
  double width_m = 0.0;      ///< target of `width`; for `open` and `close` the stroke's ends are meant
  double max_force_N = 0.0;  ///< 0: the gripper's own limit
};

/// A motion of all joints of one robot from its present position through the points of the path. It starts at
/// the stamp, or when the command takes effect; a part in the past is skipped. The robot's present motion
/// continues until the start. A set-point or another trajectory replaces it. The efforts of its points are
/// the drives' feed-forward during the motion; those of the last point stay.
struct TrajectoryCommand {
  int robot = -1;                         ///< index into CellDescription::robots
  SimTime stamp;                          ///< simulated time of the start; unset: at once
  std::shared_ptr<const JointPath> path;  ///< without points: the robot stops where it is
};

/// Signals of one device; its other signals keep their values.
struct DeviceCommand {
  int device = -1;  ///< index into CellDescription::devices
  SimTime stamp;    ///< simulated time the sender meant
  int count = 0;
  std::array<std::uint8_t, kMaxSignals> signals{};  ///< indices, of the first `count`
  std::array<double, kMaxSignals> values{};         ///< of each, in its own unit
};

using Command = std::variant<JointCommand, GripperCommand, TrajectoryCommand, DeviceCommand>;

/// Robots, grippers and devices together are "targets" of commands, numbered in that order.
int target_count(const CellDescription& cell);
int target_of(const CellDescription& cell, const Command& command);
std::string_view target_name(const CellDescription& cell, int target);
/// Index of the target with this name, or -1.
int find_target(const CellDescription& cell, std::string_view name);

/// Why a command was refused. `message` is a whole sentence with the joint, the value found and the allowed
/// range.
struct Rejection {
  RejectionCode code{};
  std::string subject;  ///< robot, gripper, device or topic
  std::string message;
};

/// A received joint command, not yet validated: names select joints, in any order; all of the robot's joints
/// must be present. `velocity` and `effort` are empty or as long as `position`; with `effort` alone the two
/// others are empty.
struct RawJointCommand {
  SimTime stamp;
  std::vector<std::string> names;
  std::vector<double> position, velocity, effort;
};

struct RawGripperCommand {
  SimTime stamp;
  GripperAction action = GripperAction::open;  ///< any number, as it arrived
  double width_m = 0.0;
  double max_force_N = 0.0;
};

/// Received points. `velocities` and `accelerations` are empty, or as long as `positions`; all points must
/// have them or all must lack them.
struct RawTrajectoryPoint {
  std::vector<double> positions, velocities, accelerations;
  std::vector<double> effort;  ///< N m or N, as `velocities` empty or as long as `positions`
  double time_from_start_s = 0.0;
};
struct RawTrajectory {
  SimTime stamp;
  std::vector<std::string> names;
  std::vector<RawTrajectoryPoint> points;
};

struct RawDeviceCommand {
  SimTime stamp;
  std::vector<std::string> signals;
  std::vector<double> values;
};

/// Most points of a trajectory.
inline constexpr std::size_t kMaxTrajectoryPoints = 10000;
/// Of trajectories: their start, and the time of their points. The time of a wall clock is beyond it.
inline constexpr double kLongestTime_s = 1e9;

/// Result of a validation: exactly one alternative.
template <typename T>
using Validated = std::variant<T, Rejection>;

/// `target`: that of the topic or port the command came in by; of the kind of the command.
Validated<JointCommand> validate(const CellDescription& cell, int target, const RawJointCommand& raw);
Validated<GripperCommand> validate(const CellDescription& cell, int target, const RawGripperCommand& raw);
/// Positions and velocities are checked along the whole path from the first point on. The piece from the
/// robot's own position to the first point can only be checked when the command takes effect.
Validated<TrajectoryCommand> validate(const CellDescription& cell, int target, const RawTrajectory& raw);
Validated<DeviceCommand> validate(const CellDescription& cell, int target, const RawDeviceCommand& raw);
/// Appends a signal (index) of the command's device with its value, or returns the reason of a refusal.
std::optional<Rejection> add_signal(const CellDescription& cell, DeviceCommand& command, int signal,
                                    double value);

/// Adds the signals of `earlier` that `newer`, a command of the same device, does not name.
void add_other_signals(const DeviceCommand& earlier, DeviceCommand& newer);

}  // namespace takt

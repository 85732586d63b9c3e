#pragma once
// What a client sees of a cell, as plain structs: the description (constant while a server runs), one instant
// of it (State), numbered events and the status of the service. No DDS type appears here.
//
// Frames and units: W is the world frame, z up; B the frame of a component. Everything is SI (m, rad, s, N, N
// m, W); times are simulated seconds since the last reset unless a name says wall. Components, robots,
// grippers and devices have the same order, and so the same index, in the description and in every state.
#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "takt_enumerations.h"
#include "takt_msgs.h"

namespace takt::client {

using takt_msgs::msg::Quaternion;
using takt_msgs::msg::Vector3;

/// A constant pose of the description: position, and the exact rotation matrix, row by row.
struct Transform {
  Vector3 position;
  std::array<double, 9> rotation{1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0};
};

using takt::ComponentType;
using takt::PartState;
using takt::SafeAction;
using takt::Severity;
using takt::SimulationState;

struct ComponentInfo {
  std::string name;
  ComponentType type = ComponentType::part;
  int hierarchy = 0;                                   ///< Parts: higher is further down the assembly
  double mass_kg = 0.0;                                ///< Parts
  Vector3 center_of_mass_m;                            ///< in B
  std::string mesh_uri;                                ///< where the geometry came from
  std::vector<float> vertices_m;                       ///< x, y, z of each vertex, in B
  std::vector<std::uint32_t> triangles;                ///< three vertex indices each
  std::array<float, 4> color{0.7F, 0.7F, 0.7F, 1.0F};  ///< r, g, b, a in 0..1
};

struct JointInfo {
  std::string name;
  bool prismatic = false;
  Transform X_PJ;  ///< joint frame in the parent link at position zero
  Vector3 axis;    ///< in the joint frame
  double lower = 0.0, upper = 0.0, max_velocity = 0.0,
         max_effort = 0.0;  ///< rad or m and their rates, N m or N
};

struct RobotInfo {
  std::string name;
  std::string urdf;  ///< text of the robot's URDF file
  std::vector<JointInfo> joints;
  Transform X_JF;                 ///< flange in the frame of the last joint
  Transform X_WR;                 ///< base in the world
  double command_period_s = 0.0;  ///< set-points are interpolated over this time
  /// A stream of set-points that is silent for longer (simulated) is followed by the safe action; 0: never.
  double command_deadline_s = 0.0;
  SafeAction safe_action = SafeAction::hold;
};

struct GripperInfo {
  std::string name;
  int robot = -1;                                ///< index of the robot that carries it
  int palm = -1, left_jaw = -1, right_jaw = -1;  ///< indices of its components
  Transform X_FG;                                ///< gripper frame in the flange frame
  Transform X_GT;                                ///< tool centre point in the gripper frame
  double max_width_m = 0.0;
  double max_force_N = 0.0;
  double jaw_speed_m_per_s = 0.0;
};

/// A named value of a device: temperature, door, energy, ...
struct SignalInfo {
  std::string name;
  std::string unit;                 ///< as the server names it (degC, W, rad/s, ...); empty: a pure number
  bool commanded = false;           ///< clients may set it
  double lower = 0.0, upper = 0.0;  ///< of what may be set, in `unit`; 0 where nothing may
};

/// What is neither robot nor gripper: a furnace, a screwdriver, the temperature of a Part.
struct DeviceInfo {
  std::string name;
  std::vector<SignalInfo> signals;
};

struct CellInfo {
  std::string cell;
  std::string scenario;                   ///< empty: none is loaded
  std::uint32_t scenario_generation = 0;  ///< counts what was loaded in this run of the server
  std::string server_version;
  double step_s = 0.0;
  int level_of_detail = 1;
  Vector3 gravity_m_per_s2;
  std::vector<ComponentInfo> components;
  std::vector<RobotInfo> robots;
  std::vector<GripperInfo> grippers;
  std::vector<DeviceInfo> devices;

  /// Index by name, or -1.
  int find_component(std::string_view name) const;
  int find_robot(std::string_view name) const;
  int find_gripper(std::string_view name) const;
  int find_device(std::string_view name) const;
};

struct ComponentState {
  Vector3 position_m;                         ///< p_WB
  Quaternion orientation;                     ///< q_WB
  Vector3 linear_velocity, angular_velocity;  ///< of the origin of B, in W
  Vector3 force_N, torque_Nm;                 ///< resultant of all pairs about the origin of B, in W
  PartState state = PartState::fixed;
  int partner = -1;  ///< index of the component that holds this Part, or -1
};

struct RobotState {
  std::vector<double> position, velocity, effort;  ///< in the order of RobotInfo::joints
  std::vector<double> motor_power_W;  ///< mechanical, of each joint's drive; empty below level of detail 2
};

/// `closed` is what was commanded; all else is measured.
struct GripperState {
  double width_m = 0.0;  ///< between the grip faces, never negative
  /// Of the jaws' drives, mean of both; at levels of detail 1 and 2 that with which they press on what they
  /// hold, where they hold something.
  double force_N = 0.0;
  bool closed = false;       ///< the last command closes the jaws, or they hold something
  bool moving = false;       ///< a jaw is faster than 1 mm/s against the palm
  bool in_position = false;  ///< the jaws stand, 0.1 mm from the commanded width at most
  int part = -1;             ///< index of the component that both jaws touch and hold, or -1
};

struct AppliedCommand {
  std::string target;           ///< robot, gripper or device
  std::uint64_t count = 0;      ///< commands applied since the last reset
  double newest_stamp_s = 0.0;  ///< stamp of the newest of them
};

/// One instant of the cell. The functions that take a name throw ClientError (not_found) with the names there
/// are.
struct State {
  double time_s = 0.0;
  std::uint64_t step = 0;
  std::uint32_t epoch = 0;  ///< counts resets
  std::uint64_t state_hash =
      0;  ///< chained over all steps since the last reset: equal runs have equal hashes
  std::vector<ComponentState> components;
  std::vector<RobotState> robots;
  std::vector<GripperState> grippers;
  std::vector<std::vector<double>> devices;  ///< signals in the order of DeviceInfo::signals
  std::vector<AppliedCommand> applied;

  std::shared_ptr<const CellInfo> cell;  ///< the description this state belongs to
  std::uint64_t sample_number =
      0;  ///< counts samples received; the server repeats an instant while it stands still

  const ComponentState& component(std::string_view name) const;
  const RobotState& robot(std::string_view name) const;
  const GripperState& gripper(std::string_view name) const;
  /// Name of the component that holds `name`, or "" when nothing does.
  std::string partner_of(std::string_view name) const;
  /// Name of the Part that both jaws of the gripper `name` touch and hold (of several the first), or "".
  std::string part_present(std::string_view name) const;
};

struct Event {
  std::uint64_t sequence_number = 0;  ///< counted from 1 in each run of the server
  std::uint64_t missed_before = 0;    ///< events lost directly before this one
  double time_s = 0.0;
  std::uint64_t step = 0;
  std::uint32_t epoch = 0;
  Severity severity = Severity::information;
  std::string code;     ///< e.g. connection_changed, command_rejected
  std::string subject;  ///< e.g. the Part, the robot
  std::string sender;   ///< identity of the sender whose command caused it, or empty
  std::string message;  ///< a whole sentence
};

/// What a robot draws, from level of detail 2 on, or a device with signals `power` and `energy`, always.
struct PowerConsumer {
  std::string name;  ///< the robot or device
  /// Of each drive on its joint; arm, then left and right jaw. Empty for devices, whose other mechanical
  /// values are 0.
  std::vector<double> mechanical_W;
  double mechanical_total_W = 0.0;   ///< their sum
  double electrical_W = 0.0;         ///< idle power included
  double mechanical_energy_J = 0.0;  ///< of all the time at level of detail 2 since the last reset
  double electrical_energy_J = 0.0;
};

/// Power of all robots that have dynamics at an instant, then of the devices.
struct Power {
  double time_s = 0.0;
  std::uint64_t step = 0;
  std::uint32_t epoch = 0;
  std::vector<PowerConsumer> consumers;
  std::uint64_t sample_number = 0;  ///< counts samples received
};

/// Two components that press upon each other by surface contact, from level of detail 3 on. Elements of the
/// base's surface press into the target's.
struct Contact {
  std::string base, target;
  Vector3 force_N, torque_Nm;  ///< on the base; the target gets the opposite; torque about the next
  Vector3 center_of_pressure_m;
  std::uint32_t elements = 0;                           ///< of the base, with force
  double area_m2 = 0.0;                                 ///< of those
  double normal_force_N = 0.0, friction_force_N = 0.0;  ///< sums over the elements
  double largest_pressure_Pa = 0.0, largest_penetration_m = 0.0;
};

/// All that presses at an instant.
struct Contacts {
  double time_s = 0.0;
  std::uint64_t step = 0;
  std::uint32_t epoch = 0;
  std::vector<Contact> contacts;    ///< in the order of the cell's components: by base, then target
  std::uint64_t omitted = 0;        ///< pairs that press too: there were too many
  std::uint64_t sample_number = 0;  ///< counts samples received
};

/// A process and its level of detail at present.
struct ProcessStatus {
  std::string name;
  int level_of_detail = 1;
};

/// Three figures of a distribution, in seconds.
struct Percentiles {
  double p50_s = 0.0, p99_s = 0.0, max_s = 0.0;
};

/// How the service is doing; published ten times a second also while paused.
struct Status {
  double time_s = 0.0;
  std::uint64_t step = 0;
  std::uint32_t epoch = 0;
  std::uint32_t scenario_generation = 0;  ///< that of the description
  SimulationState state = SimulationState::no_world;
  std::string pace;  ///< realtime, free or lockstep
  double pace_factor = 1.0;
  double wall_time_s = 0.0;        ///< since the server started
  double real_time_factor = 0.0;   ///< simulated time / wall time, over the last second
  double computation_ratio = 0.0;  ///< computation time / simulated time, over the last second
  double lag_s = 0.0;              ///< behind schedule
  std::uint64_t overruns = 0, max_consecutive_overruns = 0, schedule_resets = 0;
  Percentiles step_time, wakeup_latency, command_latency;
  std::uint64_t commands_applied = 0, commands_rejected = 0;
  std::uint64_t mpr_calls = 0, mpr_skipped = 0;
  std::string solver;
  /// Of the solver, since the last reset or change of a level of detail.
  std::uint64_t solver_steps = 0, solver_rejected_steps = 0;
  /// Surface contact, from level of detail 3 on: pairs that press now; since the last reset evaluations made
  /// and left out, elements with force in them, and candidate lists made anew.
  std::uint32_t contact_pairs = 0;
  std::uint64_t contact_calls = 0, contact_calls_skipped = 0, contact_elements = 0, contact_rebuilds = 0;
  std::vector<ProcessStatus> processes;
  std::vector<std::string> waiting_for;  ///< lockstep: controllers whose command is missing
  std::string scheduling;                ///< what was obtained from the operating system
  std::string fault;                     ///< why the simulation stopped, or empty
  std::uint64_t sample_number = 0;       ///< counts samples received
};

}  // namespace takt::client

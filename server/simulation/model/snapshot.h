#pragma once
// One instant of the cell, copied out of the simulation between two steps. Plain data; sized once per cell,
// so that filling it again does not allocate.
#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "plant_models/device_model.h"
#include "plant_models/electrical/robot_power.h"
#include "plant_models/robot/arm_kinematics.h"
#include "plant_models/robot/drive.h"
#include "plant_models/spatial.h"
#include "server/contact/surface/contact_sample.h"
#include "server/simulation/model/sim_time.h"

namespace takt {

struct ComponentSample {
  Vec3 p_WB = Vec3::Zero();
  Quat q_WB = Quat::Identity();
  Twist V_WB;     ///< of the origin of B
  Wrench F_Bo_W;  ///< resultant wrench of all pairs on this component, about the origin of B; gravity not
                  ///< included
  PartState state = PartState::fixed;
  int partner = -1;  ///< component that holds this Part, or -1
};

struct RobotSample {
  JointArray position{}, velocity{};
  JointArray effort{};  ///< torque of each drive on its joint; from LoD 2 on (also those below), jaws last
  int level_of_detail = 1;
  std::array<DriveSample, kMaxJoints> drives{};
  RobotPower power;
  Wrench flange_load_W;    ///< of gripper and load on the flange, about the flange origin
  Wrench base_reaction_W;  ///< on the foundation, about the base origin
  std::uint64_t commands_applied = 0;
  SimTime newest_stamp;  ///< of the newest command applied that had one
};

/// `closed` is the commanded state; all other members are measured.
struct GripperSample {
  double width_m = 0.0;  ///< between the grip faces, never negative
  /// Force of the jaws' drives, mean of both. At levels of detail without force between jaw and Part (1 and
  /// 2): the force with which the drives press on the held Part; without a held Part 0 at level 1.
  double force_N = 0.0;
  bool closed = false;       ///< the last command closes the jaws, or they hold a Part
  bool moving = false;       ///< a jaw is faster than 1 mm/s against the palm
  bool in_position = false;  ///< the jaws stand, 0.1 mm from the commanded width at most
  int part = -1;             ///< component that both jaws touch and hold (the first of several), or -1
  std::uint32_t forced = 0;  ///< bit i: signal i of GripperSignal is forced
  std::uint64_t commands_applied = 0;
  SimTime newest_stamp;
};

struct DeviceSample {
  std::array<double, kMaxSignals> signals{};  ///< in the order of the device's description
  std::uint32_t forced = 0;                   ///< bit i: signal i is forced
  std::uint64_t commands_applied = 0;
  SimTime newest_stamp;
};

/// Largest number of contacts in a snapshot.
inline constexpr std::size_t kMaxContactSamples = 1024;

/// Pairs with pressure by surface contact.
struct ContactsSample {
  bool acting = false;                 ///< some process is at level of detail 3
  std::vector<ContactSample> samples;  ///< one for each pair of the cell, at most kMaxContactSamples
  std::size_t count = 0;               ///< number of those in `samples`, in the order of the cell's pairs
  std::size_t omitted = 0;             ///< that press too, but do not fit
  std::span<const ContactSample> pressing() const { return {samples.data(), count}; }
};

struct Snapshot {
  std::uint64_t step = 0;
  std::uint32_t epoch = 0;  ///< counts resets
  double time_s = 0.0;
  std::uint64_t state_hash = 0;  ///< chained over the states of all steps since the last reset
  std::vector<ComponentSample> components;
  std::vector<RobotSample> robots;
  std::vector<GripperSample> grippers;
  std::vector<DeviceSample> devices;
  ContactsSample contacts;
};

/// A notice about the commanded motion of a robot.
struct MotionNotice {
  enum class Kind : std::uint8_t {
    trajectory_done,      ///< its last point is reached
    trajectory_replaced,  ///< by another command ahead of its end
    trajectory_refused,   ///< it cannot be followed from where the robot is: joint, value, limit
    trajectory_past,      ///< its end was over when it took effect; value: its end (s)
    motion_refused,       ///< a safety device stops the cell; once in a stop, and for each trajectory
    deadline_missed,      ///< no set-point for longer than allowed; value: how long (s)
    torques_refused,      ///< the robot takes none; joint: whose drive takes none, or -1; once in a row
    torques_ended,        ///< they would move `joint` out of its limits: value, limit
  };
  Kind kind{};
  double time_s = 0.0;
  std::uint64_t step = 0;
  int robot = -1;
  int joint = -1;
  bool velocity = false;  ///< refused for a velocity; else for a position
  double value = 0.0;     ///< of `joint`
  double lower = 0.0, upper = 0.0;
};

/// A notice of a device.
struct DeviceNotice {
  enum class Kind : std::uint8_t {
    part_entered,      ///< a source brings a Part into the cell
    part_removed,      ///< a sink takes a Part out of the cell
    part_taken_off,    ///< the same, from a component that held it; other: that component
    part_lost,         ///< the load of a holder exceeds its force
    axis_overloaded,   ///< the load of an axis exceeds what its drive has, in N
    table_overloaded,  ///< the same of a rotary one, in N m
    motion_stopped,    ///< emergency stop or open door: nothing may move
    motion_released,   ///< by a reset
  };
  Kind kind{};
  double time_s = 0.0;
  std::uint64_t step = 0;
  int device = -1;
  int part = -1;   ///< component
  int other = -1;  ///< component
  /// Of a holder that lost its Part, or of an axis; torques of a rotary one (N m).
  double load_N = 0.0, force_N = 0.0;
};

/// Load of the friction at a gripper, at levels of detail 1 and 2 (simulation/step/grip_loads.h).
struct GripLoad {
  int part = -1;          ///< component that the jaws touch, or -1
  double needed_N = 0.0;  ///< with which each jaw must press
  double force_N = 0.0;   ///< with which it presses
};

/// The load of a gripper exceeds its friction. Reported once per grip.
struct WeakGrip {
  double time_s = 0.0;
  std::uint64_t step = 0;
  int gripper = -1;       ///< index
  int part = -1;          ///< component that the jaws touch
  double needed_N = 0.0;  ///< of each jaw
  double force_N = 0.0;   ///< with which it presses
};

/// A device has failed, or something went wrong in it (DeviceModel::take_message).
struct DeviceMessage {
  double time_s = 0.0;
  std::uint64_t step = 0;
  int device = -1;  ///< index
  std::string sentence;
};

/// The contact force on a Part changes to and fro from step to step (simulation/step/force_alternation.h).
struct AlternatingForce {
  double time_s = 0.0;
  std::uint64_t step = 0;
  int part = -1;
  int other = -1;         ///< component that presses most upon it, or -1
  double change_N = 0.0;  ///< relative to the previous step
};

/// A change of the component that holds a Part.
struct ConnectionChange {
  double time_s = 0.0;
  std::uint64_t step = 0;
  int part = -1;
  int from = -1;  ///< component or -1
  int to = -1;    ///< component or -1
};

}  // namespace takt

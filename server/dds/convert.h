#pragma once
// Wire types from and to the core's plain structs. Nothing is decided here: what is wrong with a command is
// said by takt::validate.
#include <string>
#include <string_view>
#include <variant>

#include "server/runtime/loop/loop_output.h"
#include "server/runtime/requests/event.h"
#include "server/simulation/model/cell_description.h"
#include "server/simulation/model/command.h"
#include "server/simulation/model/pressed_elements.h"
#include "server/simulation/model/snapshot.h"
#include "takt_msgs.h"

namespace takt {

/// No stamp is zero on the wire.
builtin_interfaces::msg::Time to_time(SimTime time);
builtin_interfaces::msg::Time to_time(double time_s);

/// `target`: name of the robot, gripper or device, for a rejection. Rejection: nanoseconds that are none, or a time
/// before 0.
Validated<SimTime> from_stamp(const builtin_interfaces::msg::Time& stamp, std::string_view target);

/// What the message has is moved out of it.
Validated<RawJointCommand> from_message(std::string_view target, sensor_msgs::msg::JointState&& message);
Validated<RawTrajectory> from_message(std::string_view target,
                                      trajectory_msgs::msg::JointTrajectory&& message);
Validated<RawDeviceCommand> from_message(std::string_view target, takt_msgs::msg::DeviceCommand&& message);
Validated<RawGripperCommand> from_message(std::string_view target, takt_msgs::msg::GripperCommand&& message);

/// More triangles than this in one mesh are refused when the cell is described.
inline constexpr std::size_t kMaxTriangles = 4'000'000;

/// Throws DdsError for what does not fit the wire type: a name or a text that is too long, a mesh that is too
/// large.
takt_msgs::msg::CellDescription to_message(const CellDescription& cell, const std::string& server_version);

/// A state message with everything that does not change between instants filled in; fill() does the rest and
/// does not allocate.
takt_msgs::msg::CellState make_state_message(const CellDescription& cell);
void fill(takt_msgs::msg::CellState& message, const CellDescription& cell, const Snapshot& snapshot);

sensor_msgs::msg::JointState make_joint_states_message(const RobotDescription& robot);
void fill(sensor_msgs::msg::JointState& message, const Snapshot& snapshot, std::size_t robot);

/// The message has room for every robot and device; fill() lists the robots that have dynamics at this
/// instant, then the devices with a meter, and says whether there is one. It does not allocate from the
/// second time on.
takt_msgs::msg::Power make_power_message(const CellDescription& cell);
bool fill(takt_msgs::msg::Power& message, const CellDescription& cell, const Snapshot& snapshot);

/// The message with room for so many contacts; fill() lists those that press and says whether a process is at
/// level of detail 3. It does not allocate.
takt_msgs::msg::Contacts make_contacts_message(const CellDescription& cell, std::size_t room);
bool fill(takt_msgs::msg::Contacts& message, const Snapshot& snapshot);

/// Allocates where there are more elements than ever.
void fill(takt_msgs::msg::ContactPressures& message, const CellDescription& cell, const Snapshot& snapshot,
          const std::vector<PressedPair>& pairs);

takt_msgs::msg::Status to_message(const LoopStatus& status, const CellDescription& cell);
/// Sequence number and sender are the caller's to fill in.
takt_msgs::msg::Event to_message(const EventRecord& event, const CellDescription& cell);

}  // namespace takt

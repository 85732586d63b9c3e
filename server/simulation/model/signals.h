#pragma once
// The signals of a cell under one numbering, as a programmable controller sees them: those of devices, grippers and
// robots, each by OWNER.SIGNAL. Devices state theirs (DeviceDescription::signals); those of grippers are the words of
// GripperSignal; a robot has the position of each joint, under the name of the joint.
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "server/simulation/model/cell_description.h"
#include "takt_enumerations.h"

namespace takt {

/// A signal whose value is given by request, until it is released.
struct ForcedSignal {
  SignalRef ref;
  double value = 0.0;
  /// Of an input: what it has after the release; of a gripper's: the width, with the action.
  double underneath = 0.0;
  GripperAction action = GripperAction::open;
  double max_force_N = 0.0;  ///< of a gripper's input: with the action; 0: the gripper's own limit
};

/// A value for an input.
struct InputValue {
  SignalRef ref;
  double value = 0.0;
};

enum class SignalOwnerKind : std::uint8_t { device, gripper, robot };

/// The owner of a signal: its kind, and its index in that vector of the description.
struct SignalOwner {
  SignalOwnerKind kind = SignalOwnerKind::device;
  std::size_t index = 0;
};
SignalOwner signal_owner(const CellDescription& cell, int device);
/// SignalRef::device of a gripper.
int gripper_as_device(const CellDescription& cell, std::size_t gripper);

/// Of all owners together: devices, grippers, robots.
int signal_owner_count(const CellDescription& cell);
std::string_view signal_owner_name(const CellDescription& cell, int device);
/// By its name, or -1.
int find_signal_owner(const CellDescription& cell, std::string_view name);

std::vector<SignalDescription> signals_of(const CellDescription& cell, int device);
SignalDescription describe_signal(const CellDescription& cell, SignalRef ref);
/// OWNER.SIGNAL
std::string signal_name(const CellDescription& cell, SignalRef ref);
std::optional<SignalRef> find_signal(const CellDescription& cell, std::string_view owner_and_signal);
/// Says what exists in place of this text, which find_signal() does not find.
std::string signals_there(const CellDescription& cell, std::string_view owner_and_signal);
/// Why the signal cannot have this value, as a part of a sentence; empty if it can. Only commanded signals have limits.
std::string wrong_value(const SignalDescription& signal, double value);

/// The wire that drives this input; nullptr: none.
const SignalWire* wire_to(const CellDescription& cell, SignalRef ref);

}  // namespace takt

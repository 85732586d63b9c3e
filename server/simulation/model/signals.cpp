#include "server/simulation/model/signals.h"

#include <algorithm>
#include <cmath>
#include <sstream>

namespace takt {

namespace {

template <class Items>
int find_by_name(const Items& items, std::string_view name) {
  for (std::size_t i = 0; i < items.size(); ++i)
    if (items[i].name == name) return static_cast<int>(i);
  return -1;
}

SignalDescription describe(const GripperDescription& gripper, GripperSignal signal, std::size_t components) {
  const auto flag = [](bool commanded) {
    return SignalDescription{"", "", commanded, 0.0, commanded ? 1.0 : 0.0, SignalType::boolean};
  };
  SignalDescription result;
  switch (signal) {
    case GripperSignal::close:
      result = flag(true);
      break;
    case GripperSignal::set_width:
      result = {"", "m", true, 0.0, gripper.max_width_m, SignalType::real};
      break;
    case GripperSignal::closed:
    case GripperSignal::moving:
    case GripperSignal::in_position:
    case GripperSignal::part_present:
      result = flag(false);
      break;
    case GripperSignal::width:
      result = {"", "m", false, 0.0, 0.0, SignalType::real};
      break;
    case GripperSignal::force:
      result = {"", "N", false, 0.0, 0.0, SignalType::real};
      break;
    case GripperSignal::part:
      result = {"", "", false, -1.0, static_cast<double>(components) - 1.0, SignalType::integer};
      break;
  }
  result.name = to_string(signal);
  return result;
}

}  // namespace

SignalOwner signal_owner(const CellDescription& cell, int device) {
  auto index = static_cast<std::size_t>(device);
  if (index < cell.devices.size()) return {SignalOwnerKind::device, index};
  index -= cell.devices.size();
  if (index < cell.grippers.size()) return {SignalOwnerKind::gripper, index};
  return {SignalOwnerKind::robot, index - cell.grippers.size()};
}

int gripper_as_device(const CellDescription& cell, std::size_t gripper) {
  return static_cast<int>(cell.devices.size() + gripper);
}

int signal_owner_count(const CellDescription& cell) {
  return static_cast<int>(cell.devices.size() + cell.grippers.size() + cell.robots.size());
}

std::string_view signal_owner_name(const CellDescription& cell, int device) {
  const auto [kind, index] = signal_owner(cell, device);
  switch (kind) {
    case SignalOwnerKind::device:
      return cell.devices[index].name;
    case SignalOwnerKind::gripper:
      return cell.grippers[index].name;
    case SignalOwnerKind::robot:
      return cell.robots[index].name;
  }
  return "";
}

int find_signal_owner(const CellDescription& cell, std::string_view name) {
  const int count = signal_owner_count(cell);
  for (int device = 0; device < count; ++device)
    if (signal_owner_name(cell, device) == name) return device;
  return -1;
}

std::vector<SignalDescription> signals_of(const CellDescription& cell, int device) {
  const auto [kind, index] = signal_owner(cell, device);
  if (kind == SignalOwnerKind::device) return cell.devices[index].signals;
  std::vector<SignalDescription> result;
  if (kind == SignalOwnerKind::gripper) {
    for (const EnumeratorInfo& one : kEnumeration<GripperSignal>.enumerators)
      result.push_back(
          describe(cell.grippers[index], static_cast<GripperSignal>(one.value), cell.components.size()));
    return result;
  }
  for (const JointModel& joint : cell.robots[index].arm.joints)
    result.push_back(
        {joint.name, joint.type == JointType::revolute ? "rad" : "m", false, 0.0, 0.0, SignalType::real});
  return result;
}

SignalDescription describe_signal(const CellDescription& cell, SignalRef ref) {
  return signals_of(cell, ref.device)[static_cast<std::size_t>(ref.signal)];
}

std::string signal_name(const CellDescription& cell, SignalRef ref) {
  return std::string(signal_owner_name(cell, ref.device)) + "." + describe_signal(cell, ref).name;
}

std::optional<SignalRef> find_signal(const CellDescription& cell, std::string_view owner_and_signal) {
  const std::size_t dot = owner_and_signal.find('.');
  if (dot == std::string_view::npos) return std::nullopt;
  const int device = find_signal_owner(cell, owner_and_signal.substr(0, dot));
  if (device < 0) return std::nullopt;
  const int signal = find_by_name(signals_of(cell, device), owner_and_signal.substr(dot + 1));
  if (signal < 0) return std::nullopt;
  return SignalRef{device, signal};
}

std::string signals_there(const CellDescription& cell, std::string_view owner_and_signal) {
  const std::string_view name = owner_and_signal.substr(0, owner_and_signal.find('.'));
  const int device = find_signal_owner(cell, name);
  std::string list;
  if (device < 0) {
    for (int i = 0; i < signal_owner_count(cell); ++i)
      list.append(list.empty() ? "" : ", ").append(signal_owner_name(cell, i));
    return "NAME.SIGNAL of a device, gripper or robot of this scenario: " + (list.empty() ? "none" : list);
  }
  for (const SignalDescription& signal : signals_of(cell, device))
    list.append(list.empty() ? "" : ", ").append(signal.name);
  return "signals of " + std::string(name) + ": " + list;
}

std::string wrong_value(const SignalDescription& signal, double value) {
  std::ostringstream text;
  text.precision(12);
  text << "is " << value;
  if (!std::isfinite(value)) return text.str() + "; a finite number is needed";
  if (signal.type == SignalType::boolean && value != 0.0 && value != 1.0)
    return text.str() + "; it is boolean: 0 or 1";
  if (signal.type == SignalType::integer && value != std::floor(value))
    return text.str() + "; it is a whole number";
  if (signal.lower < signal.upper && (value < signal.lower || value > signal.upper)) {
    text << " " << signal.unit << ", outside [" << signal.lower << ", " << signal.upper << "] "
         << signal.unit;
    return text.str();
  }
  return "";
}

const SignalWire* wire_to(const CellDescription& cell, SignalRef ref) {
  const auto found = std::find_if(cell.wires.begin(), cell.wires.end(),
                                  [&](const SignalWire& wire) { return wire.to == ref; });
  return found == cell.wires.end() ? nullptr : &*found;
}

}  // namespace takt

#include "client_lib/cell.h"

#include "client_lib/client_impl.h"

namespace takt {
namespace {

template <typename T>
int find_by_name(const std::vector<T>& items, std::string_view name) {
  for (std::size_t i = 0; i < items.size(); ++i)
    if (items[i].name == name) return static_cast<int>(i);
  return -1;
}

}  // namespace

int CellInfo::find_component(std::string_view name) const {
  return find_by_name(components, name);
}
int CellInfo::find_robot(std::string_view name) const {
  return find_by_name(robots, name);
}
int CellInfo::find_gripper(std::string_view name) const {
  return find_by_name(grippers, name);
}
int CellInfo::find_device(std::string_view name) const {
  return find_by_name(devices, name);
}

std::string CellInfo::component_name(int index) const {
  const std::string* name = lists.name_of("components", index);
  return name == nullptr ? std::string() : *name;
}

const ComponentState& State::component(std::string_view name) const {
  return components.at(require_by_name("component", cell->components, name));
}
const RobotState& State::robot(std::string_view name) const {
  return robots.at(require_by_name("robot", cell->robots, name));
}
const GripperState& State::gripper(std::string_view name) const {
  return grippers.at(require_by_name("gripper", cell->grippers, name));
}
const DeviceState& State::device(std::string_view name) const {
  return devices.at(require_by_name("device", cell->devices, name));
}
std::map<std::string, double> State::signals(std::string_view device) const {
  const std::size_t index = require_by_name("device", cell->devices, device);
  std::map<std::string, double> values;
  const auto& described = cell->devices[index].signals;
  for (std::size_t i = 0; i < described.size(); ++i)
    values[described[i].name] = devices.at(index).signals.at(i);
  return values;
}
std::string State::partner_of(std::string_view name) const {
  return cell->component_name(component(name).partner);
}
std::string State::part_present(std::string_view name) const {
  return cell->component_name(gripper(name).part);
}

}  // namespace takt

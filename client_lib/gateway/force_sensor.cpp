#include "client_lib/gateway/force_sensor.h"

#include <algorithm>

#include "client_lib/kinematics/arm.h"

namespace takt::gateway {
namespace {

constexpr const char* kSection = "force_torque_sensors";
constexpr std::array<const char*, 6> kSignals{"force_x",  "force_y",  "force_z",
                                              "torque_x", "torque_y", "torque_z"};

}  // namespace

void describe_force_sensor(Fields& f, std::string& device, const CellInfo& cell, const std::string& robot,
                           const char* doc) {
  std::vector<std::string> names;
  const int carrier = cell.find_robot(robot);
  for (const auto& one : cell.devices)
    if (one.type == kSection && carrier >= 0 && one.robot == carrier) names.push_back(one.name);
  f.field("force_sensor", device, NameOf{names, "a force-torque sensor on the robot's flange"}, doc);
}

ForceSensor::ForceSensor(const CellInfo& cell, const std::string& device) {
  const int index = cell.find_device(device);
  if (index < 0) throw ScenarioError("force_sensor: the cell has no device '" + device + "'");
  device_ = static_cast<std::size_t>(index);
  const auto& description = cell.devices[device_];
  for (std::size_t i = 0; i < kSignals.size(); ++i) {
    const auto found = std::find_if(description.signals.begin(), description.signals.end(),
                                    [&](const auto& signal) { return signal.name == kSignals.at(i); });
    if (found == description.signals.end() || description.robot < 0)
      throw ScenarioError("force_sensor: found '" + device + "'; allowed: a device of the section " +
                          kSection);
    place_.at(i) = static_cast<std::size_t>(found - description.signals.begin());
  }
  X_FS_ = pose_of(description.mount);
}

std::array<double, 6> ForceSensor::values(const State& state) const {
  std::array<double, 6> read{};
  for (std::size_t i = 0; i < read.size(); ++i)
    read.at(i) = state.devices.at(device_).signals.at(place_.at(i));
  return read;
}

Wrench ForceSensor::wrench_S(const State& state) const {
  const std::array<double, 6> v = values(state);
  return {Vec3(v[0], v[1], v[2]), Vec3(v[3], v[4], v[5])};
}

Wrench ForceSensor::wrench_F(const State& state) const {
  const Wrench at_S = wrench_S(state);
  const Vec3 force = X_FS_.R * at_S.f;
  return {force, X_FS_.R * at_S.t + X_FS_.p.cross(force)};
}

}  // namespace takt::gateway

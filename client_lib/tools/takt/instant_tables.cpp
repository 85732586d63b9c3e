// takt state, contacts and power: instants of the cell, as tables for a person or as JSON.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <stdexcept>

#include "client_lib/tools/takt/commands.h"
#include "client_lib/tools/takt/follow.h"
#include "client_lib/tools/takt/sample_json.h"
#include "idl/common/text.h"

namespace takt::tool {
namespace {

using takt_msgs::msg::DeviceDescription;
using takt_msgs::msg::Quaternion;
using takt_msgs::msg::Vector3;

/// Roll, pitch, yaw (fixed axes, as in URDF) of a unit quaternion, in degrees.
Vector3 rpy_deg(const Quaternion& q) {
  const double degree = 180.0 / M_PI;
  const double sin_pitch = std::fmax(-1.0, std::fmin(1.0, 2.0 * (q.w * q.y - q.z * q.x)));
  return {degree * std::atan2(2.0 * (q.w * q.x + q.y * q.z), 1.0 - 2.0 * (q.x * q.x + q.y * q.y)),
          degree * std::asin(sin_pitch),
          degree * std::atan2(2.0 * (q.w * q.z + q.x * q.y), 1.0 - 2.0 * (q.y * q.y + q.z * q.z))};
}

/// One line a signal; those that can be commanded with their limits.
void print(const DeviceDescription& device, const DeviceState& state) {
  for (std::size_t k = 0; k < device.signals.size(); ++k) {
    const auto& signal = device.signals[k];
    std::printf("%-24s %-24s %12.6g %-8s", device.name.c_str(), signal.name.c_str(), state.signals[k],
                signal.unit.c_str());
    if (signal.commanded) std::printf(" can be set: %g to %g", signal.lower, signal.upper);
    std::printf("\n");
  }
}

void print(const std::string& name, const GripperState& gripper, const std::string& part) {
  const char* stands = gripper.moving ? "moving" : gripper.in_position ? "in position" : "stands";
  std::printf("%-24s width %.2f mm, %s, %s, %.4g N%s%s\n", name.c_str(), 1e3 * gripper.width,
              gripper.closed ? "closed" : "open", stands, gripper.force, part.empty() ? "" : ", on ",
              part.c_str());
}

void print(const State& s) {
  const CellInfo& info = *s.cell;
  std::printf("time %.3f s, step %llu, epoch %u, hash %s\n\n", s.time,
              static_cast<unsigned long long>(s.step), s.epoch, hexadecimal_text(s.state_hash).c_str());
  std::printf("%-24s %10s %10s %10s   %8s %8s %8s   %-10s %s\n", "component", "x [m]", "y [m]", "z [m]",
              "roll [°]", "pitch", "yaw", "state", "held by");
  for (std::size_t i = 0; i < s.components.size(); ++i) {
    const auto& c = s.components[i];
    const Vector3 rpy = rpy_deg(c.orientation);
    std::printf("%-24s %10.5f %10.5f %10.5f   %7.2f %8.2f %8.2f   %-10s %s\n",
                info.components[i].name.c_str(), c.position.x, c.position.y, c.position.z, rpy.x, rpy.y,
                rpy.z, std::string(to_string(c.state)).c_str(), info.component_name(c.partner).c_str());
  }
  std::printf("\n");
  for (std::size_t i = 0; i < s.robots.size(); ++i) {
    std::printf("%-24s joints", info.robots[i].name.c_str());
    for (const double q : s.robots[i].position) std::printf(" %9.5f", q);
    std::printf("\n");
  }
  for (std::size_t i = 0; i < s.grippers.size(); ++i)
    print(info.grippers[i].name, s.grippers[i], info.component_name(s.grippers[i].part));
  for (std::size_t i = 0; i < s.devices.size(); ++i) print(info.devices[i], s.devices[i]);
}

void print(const Contacts& contacts) {
  if (contacts.contacts.empty()) {
    std::printf("%9.3f s  nothing presses\n", contacts.time);
    return;
  }
  const auto pair = [&](const Contact& c) {
    return contacts.cell->component_name(c.base) + " - " + contacts.cell->component_name(c.target);
  };
  int width = 4;
  for (const Contact& c : contacts.contacts) width = std::max(width, static_cast<int>(pair(c).size()));
  std::printf("%9.3f s  %-*s %12s %12s %11s %13s %10s\n", contacts.time, width, "pair", "normal N",
              "friction N", "area mm2", "pressure kPa", "depth um");
  for (const Contact& c : contacts.contacts)
    std::printf("%11s  %-*s %12.4f %12.4f %11.2f %13.3f %10.3f\n", "", width, pair(c).c_str(), c.normal_force,
                c.friction_force, 1e6 * c.area, 1e-3 * c.largest_pressure, 1e6 * c.largest_penetration);
  if (contacts.omitted > 0)
    std::printf("%11s  and %llu more\n", "", static_cast<unsigned long long>(contacts.omitted));
}

void print(const Power& power) {
  for (const auto& c : power.consumers) {
    std::printf("%9.3f s  %-16s ", power.time, c.name.c_str());
    if (c.mechanical_power.empty())
      std::printf("%37s", "");  // devices have none
    else
      std::printf("mechanical %9.2f W %10.2f J   ", c.mechanical_total, c.mechanical_energy);
    std::printf("electrical %9.2f W %10.2f J\n", c.electrical_power, c.electrical_energy);
  }
}

template <typename Sample>
void show(const Common& common, const Sample& sample) {
  if (common.json)
    print_json(json_of(sample));
  else
    print(sample);
  std::fflush(stdout);
}

bool has_meter(const DeviceDescription& device) {
  const auto has = [&](const char* name) {
    return std::ranges::find(device.signals, name, &takt_msgs::msg::SignalDescription::name) !=
           device.signals.end();
  };
  return has("power") && has("energy");
}

bool all_below(const Status& status, int level) {
  return std::ranges::all_of(status.processes, [&](const auto& p) { return p.level_of_detail < level; });
}

}  // namespace

int state(const Common& common) {
  const State s = (*Session(common)).state();
  if (common.json) {
    auto document = json_of(s);
    // Unit and limits of each signal.
    for (const DeviceDescription& device : s.cell->devices)
      document["description"]["devices"][device.name] = recording::message_json(device, s.cell->lists);
    print_json(document, 2);
  } else {
    print(s);
  }
  return kOk;
}

int contacts(const Common& common, const FollowOptions& options) {
  Session cell(common);
  if (all_below(cell->status(), 3))
    throw std::runtime_error(
        "There is no surface contact: every process is below level of detail 3. 'takt lod 3' changes that.");
  return follow(common, options, *cell, topics::contacts, [&](const auto& sample) { show(common, sample); });
}

int power(const Common& common, const FollowOptions& options) {
  Session cell(common);
  if (all_below(cell->status(), 2) && std::ranges::none_of(cell->cell()->devices, has_meter))
    throw std::runtime_error(
        "Nothing has a power: no device draws any, and every robot's process is at level of detail 1. 'takt "
        "lod 2' changes that.");
  return follow(common, options, *cell, topics::power, [&](const auto& sample) { show(common, sample); });
}

}  // namespace takt::tool

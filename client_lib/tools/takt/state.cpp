// takt state: one instant of the cell.
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "client_lib/recording/json_text.h"
#include "client_lib/tools/takt/commands.h"
#include "client_lib/tools/takt/signals_json.h"
#include "client_lib/tools/takt/vector_json.h"

namespace takt::tool {
namespace {

using client::Quaternion;
using client::Vector3;

/// Roll, pitch, yaw (fixed axes, as in URDF) of a unit quaternion, in degrees.
Vector3 rpy_deg(const Quaternion& q) {
  const double degree = 180.0 / M_PI;
  const double sin_pitch = std::fmax(-1.0, std::fmin(1.0, 2.0 * (q.w * q.y - q.z * q.x)));
  return {degree * std::atan2(2.0 * (q.w * q.x + q.y * q.z), 1.0 - 2.0 * (q.x * q.x + q.y * q.y)),
          degree * std::asin(sin_pitch),
          degree * std::atan2(2.0 * (q.w * q.z + q.x * q.y), 1.0 - 2.0 * (q.y * q.y + q.z * q.z))};
}

nlohmann::json json_of(const client::DeviceInfo& device, const std::vector<double>& values) {
  nlohmann::json document{{"signals", signals_json(device, values)}};
  for (const client::SignalInfo& signal : device.signals) {
    document["units"][signal.name] = signal.unit;
    if (signal.commanded) document["limits"][signal.name] = {signal.lower, signal.upper};
  }
  return document;
}

/// One line a signal; those that can be commanded with their limits.
void print(const client::DeviceInfo& device, const std::vector<double>& values) {
  for (std::size_t k = 0; k < device.signals.size(); ++k) {
    const client::SignalInfo& signal = device.signals[k];
    std::printf("%-24s %-24s %12.6g %-8s", device.name.c_str(), signal.name.c_str(), values[k],
                signal.unit.c_str());
    if (signal.commanded) std::printf(" can be set: %g to %g", signal.lower, signal.upper);
    std::printf("\n");
  }
}

void print(const std::string& name, const client::GripperState& gripper, const std::string& part) {
  const char* stands = gripper.moving ? "moving" : gripper.in_position ? "in position" : "stands";
  std::printf("%-24s width %.2f mm, %s, %s, %.4g N%s%s\n", name.c_str(), 1e3 * gripper.width_m,
              gripper.closed ? "closed" : "open", stands, gripper.force_N, part.empty() ? "" : ", on ",
              part.c_str());
}

}  // namespace

int state(const Common& common) {
  Session session(common);
  const Client& cell = *session;
  const client::State s = cell.state();
  const auto& info = *s.cell;
  if (common.json) {
    nlohmann::json document{
        {"time", s.time_s}, {"step", s.step}, {"epoch", s.epoch}, {"state_hash", hash_text(s.state_hash)}};
    for (std::size_t i = 0; i < s.components.size(); ++i) {
      const auto& c = s.components[i];
      document["components"][info.components[i].name] = {{"position", c.position_m},
                                                         {"orientation", c.orientation},
                                                         {"linear_velocity", c.linear_velocity},
                                                         {"angular_velocity", c.angular_velocity},
                                                         {"force", c.force_N},
                                                         {"torque", c.torque_Nm},
                                                         {"type", to_string(info.components[i].type)},
                                                         {"state", to_string(c.state)},
                                                         {"partner", s.partner_of(info.components[i].name)}};
    }
    for (std::size_t i = 0; i < s.robots.size(); ++i)
      document["robots"][info.robots[i].name] = {{"position", s.robots[i].position},
                                                 {"velocity", s.robots[i].velocity},
                                                 {"effort", s.robots[i].effort}};
    for (std::size_t i = 0; i < s.grippers.size(); ++i)
      document["grippers"][info.grippers[i].name] = {{"width", s.grippers[i].width_m},
                                                     {"force", s.grippers[i].force_N},
                                                     {"closed", s.grippers[i].closed},
                                                     {"moving", s.grippers[i].moving},
                                                     {"in_position", s.grippers[i].in_position},
                                                     {"part_present", s.part_present(info.grippers[i].name)}};
    for (std::size_t i = 0; i < s.devices.size(); ++i)
      document["devices"][info.devices[i].name] = json_of(info.devices[i], s.devices[i]);
    std::printf("%s\n", recording::json_text(document, 2).c_str());
    return 0;
  }
  std::printf("time %.3f s, step %llu, epoch %u, hash %s\n\n", s.time_s,
              static_cast<unsigned long long>(s.step), s.epoch, hash_text(s.state_hash).c_str());
  std::printf("%-24s %10s %10s %10s   %8s %8s %8s   %-10s %s\n", "component", "x [m]", "y [m]", "z [m]",
              "roll [°]", "pitch", "yaw", "state", "held by");
  for (std::size_t i = 0; i < s.components.size(); ++i) {
    const auto& c = s.components[i];
    const Vector3 rpy = rpy_deg(c.orientation);
    std::printf("%-24s %10.5f %10.5f %10.5f   %7.2f %8.2f %8.2f   %-10s %s\n",
                info.components[i].name.c_str(), c.position_m.x, c.position_m.y, c.position_m.z, rpy.x, rpy.y,
                rpy.z, std::string(to_string(c.state)).c_str(),
                s.partner_of(info.components[i].name).c_str());
  }
  std::printf("\n");
  for (std::size_t i = 0; i < s.robots.size(); ++i) {
    std::printf("%-24s joints", info.robots[i].name.c_str());
    for (const double q : s.robots[i].position) std::printf(" %9.5f", q);
    std::printf("\n");
  }
  for (std::size_t i = 0; i < s.grippers.size(); ++i)
    print(info.grippers[i].name, s.grippers[i], s.part_present(info.grippers[i].name));
  for (std::size_t i = 0; i < s.devices.size(); ++i) print(info.devices[i], s.devices[i]);
  return 0;
}

}  // namespace takt::tool

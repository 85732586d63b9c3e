// takt state and check: positions of the components as a table, alone or beside the expected ones.
#include <yaml-cpp/yaml.h>

#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "client_lib/tools/takt/commands.h"

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

Quaternion from_rpy_rad(const Vector3& rpy) {
  const double cr = std::cos(rpy.x / 2), sr = std::sin(rpy.x / 2), cp = std::cos(rpy.y / 2),
               sp = std::sin(rpy.y / 2), cy = std::cos(rpy.z / 2), sy = std::sin(rpy.z / 2);
  return {sr * cp * cy - cr * sp * sy, cr * sp * cy + sr * cp * sy, cr * cp * sy - sr * sp * cy,
          cr * cp * cy + sr * sp * sy};
}

double distance_m(const Vector3& a, const Vector3& b) {
  return std::hypot(a.x - b.x, a.y - b.y, a.z - b.z);
}

/// Angle of the rotation between two orientations. By the chord of the quaternions, which is exact for small
/// angles.
double angle_rad(const Quaternion& a, const Quaternion& b) {
  const double sign = a.x * b.x + a.y * b.y + a.z * b.z + a.w * b.w < 0.0 ? -1.0 : 1.0;
  const double chord = std::hypot(std::hypot(a.x - sign * b.x, a.y - sign * b.y),
                                  std::hypot(a.z - sign * b.z, a.w - sign * b.w));
  return 4.0 * std::asin(std::fmin(1.0, chord / 2.0));
}

nlohmann::json json_of(const Vector3& v) {
  return {v.x, v.y, v.z};
}
nlohmann::json json_of(const Quaternion& q) {
  return {q.x, q.y, q.z, q.w};
}

struct Expected {
  std::string part;
  Vector3 position_m;
  Quaternion orientation;
};

struct Expectation {
  std::vector<Expected> parts;
  double tolerance_m = 0.0;
};

/// Error in a scenario file, for the person who wrote it.
[[noreturn]] void bad(const std::string& file, const YAML::Mark& mark, const std::string& what) {
  throw std::runtime_error(file + ":" + std::to_string(mark.line + 1) + ":" +
                           std::to_string(mark.column + 1) + ": " + what);
}

Vector3 read_vector(const std::string& file, const YAML::Node& parent, const std::string& key,
                    const std::string& path, bool required) {
  const YAML::Node node = parent[key];
  if (!node && !required) return {};
  if (!node) bad(file, parent.Mark(), "'" + path + "' has no key '" + key + "'; it needs three numbers.");
  try {
    if (node.IsSequence() && node.size() == 3) {
      const Vector3 v{node[0].as<double>(), node[1].as<double>(), node[2].as<double>()};
      if (std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z)) return v;
    }
  } catch (const YAML::BadConversion&) {  // told below
  }
  bad(file, node.Mark(), "'" + path + "." + key + "' must be three finite numbers [x, y, z].");
}

Expectation read_expectation(const std::string& file) {
  YAML::Node root;
  try {
    root = YAML::LoadFile(file);
  } catch (const YAML::ParserException& error) {
    bad(file, error.mark, error.msg + ".");
  } catch (const YAML::BadFile&) {
    throw std::runtime_error(file + ": cannot be read.");
  }
  const YAML::Node expected = root.IsMap() ? root["expected"] : YAML::Node();
  if (!expected || !expected.IsMap() || !expected["parts"] || !expected["parts"].IsMap() ||
      expected["parts"].size() == 0)
    throw std::runtime_error(
        file + ": the scenario has no section 'expected' with 'parts', so there is nothing to check.");
  Expectation expectation;
  const YAML::Node tolerance = expected["tolerance_m"];
  if (!tolerance)
    bad(file, expected.Mark(), "'expected' has no key 'tolerance_m'; it needs a length above 0.");
  try {
    expectation.tolerance_m = tolerance.as<double>();
  } catch (const YAML::BadConversion&) {  // told below: it has stayed 0
  }
  if (!(expectation.tolerance_m > 0.0) || !std::isfinite(expectation.tolerance_m))
    bad(file, tolerance.Mark(), "'expected.tolerance_m' must be a number above 0.");
  for (const auto& entry : expected["parts"]) {
    const auto name = entry.first.as<std::string>();
    const std::string path = "expected.parts." + name;
    if (!entry.second.IsMap())
      bad(file, entry.first.Mark(), "'" + path + "' must hold 'position_m' and 'rpy_rad'.");
    expectation.parts.push_back({name, read_vector(file, entry.second, "position_m", path, true),
                                 from_rpy_rad(read_vector(file, entry.second, "rpy_rad", path, false))});
  }
  return expectation;
}

}  // namespace

int state(const Common& common) {
  const Client cell(common.client);
  const client::State s = cell.state();
  const auto& info = *s.cell;
  if (common.json) {
    nlohmann::json document{{"time", s.time_s},
                            {"step", s.step},
                            {"epoch", s.epoch},
                            {"state_hash", std::to_string(s.state_hash)}};
    for (std::size_t i = 0; i < s.components.size(); ++i) {
      const auto& c = s.components[i];
      document["components"][info.components[i].name] = {{"position", json_of(c.position_m)},
                                                         {"orientation", json_of(c.orientation)},
                                                         {"linear_velocity", json_of(c.linear_velocity)},
                                                         {"angular_velocity", json_of(c.angular_velocity)},
                                                         {"force", json_of(c.force_N)},
                                                         {"torque", json_of(c.torque_Nm)},
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
                                                     {"closed", s.grippers[i].closed}};
    std::printf("%s\n", document.dump(2).c_str());
    return 0;
  }
  std::printf("time %.3f s, step %llu, epoch %u, hash %016llx\n\n", s.time_s,
              static_cast<unsigned long long>(s.step), s.epoch,
              static_cast<unsigned long long>(s.state_hash));
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
    std::printf("%-24s width %.2f mm, %s\n", info.grippers[i].name.c_str(), 1e3 * s.grippers[i].width_m,
                s.grippers[i].closed ? "closed" : "open");
  return 0;
}

int check(const Common& common, const CheckOptions& options) {
  const Expectation expectation = read_expectation(options.scenario_file);
  const Client cell(common.client);
  const client::State s = cell.state();
  bool all_hold = true;
  nlohmann::json document{{"time", s.time_s}, {"tolerance_m", expectation.tolerance_m}};
  if (!common.json)
    std::printf("At %.3f s, tolerance %g mm\n%-12s %32s   %32s   %10s %10s\n", s.time_s,
                1e3 * expectation.tolerance_m, "Part", "position [m]", "expected [m]", "error [mm]",
                "turn [°]");
  for (const auto& part : expectation.parts) {
    const auto& found = s.component(part.part);
    const double error_m = distance_m(found.position_m, part.position_m);
    const double turn_rad = angle_rad(found.orientation, part.orientation);
    // A Part is as far off as its farthest point may be: the turn counts on a lever of 0.1 m.
    const bool holds = error_m <= expectation.tolerance_m && 0.1 * turn_rad <= expectation.tolerance_m;
    all_hold = all_hold && holds;
    if (common.json)
      document["parts"][part.part] = {{"position", json_of(found.position_m)},
                                      {"expected_position", json_of(part.position_m)},
                                      {"error_m", error_m},
                                      {"error_rad", turn_rad},
                                      {"ok", holds}};
    else
      std::printf("%-12s %10.6f %10.6f %10.6f   %10.6f %10.6f %10.6f   %10.4f %10.4f  %s\n",
                  part.part.c_str(), found.position_m.x, found.position_m.y, found.position_m.z,
                  part.position_m.x, part.position_m.y, part.position_m.z, 1e3 * error_m,
                  turn_rad * 180.0 / M_PI, holds ? "ok" : "NOT THERE");
  }
  document["ok"] = all_hold;
  if (common.json)
    std::printf("%s\n", document.dump(2).c_str());
  else
    std::printf("%s\n",
                all_hold ? "All Parts are where they should be." : "Not all Parts are where they should be.");
  return all_hold ? 0 : 1;
}

}  // namespace takt::tool

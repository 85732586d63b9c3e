// takt check: the present positions beside those a scenario expects at its end.
#include <yaml-cpp/yaml.h>

#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "client_lib/recording/json_text.h"
#include "client_lib/tools/takt/commands.h"
#include "client_lib/tools/takt/sample_json.h"

namespace takt::tool {
namespace {

using takt_msgs::msg::Quaternion;
using takt_msgs::msg::Vector3;

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

struct Expected {
  std::string part;
  Vector3 position_m;
  Quaternion orientation;
};

struct Expectation {
  std::vector<Expected> parts;
  double tolerance_m = 0.0;
};

/// Reads the section `expected` of a scenario file. Its errors address the author of the file.
class ExpectationReader {
 public:
  explicit ExpectationReader(const std::string& file) : file_(file) {}

  Expectation read() const {
    YAML::Node root;
    try {
      root = YAML::LoadFile(file_);
    } catch (const YAML::ParserException& error) {
      fail(error.mark, error.msg + ".");
    } catch (const YAML::BadFile&) {
      throw std::runtime_error(file_ + ": cannot be read.");
    }
    const YAML::Node expected = root.IsMap() ? root["expected"] : YAML::Node();
    if (!expected || !expected.IsMap() || !expected["parts"] || !expected["parts"].IsMap() ||
        expected["parts"].size() == 0)
      throw std::runtime_error(file_ +
                               ": the scenario has no section 'expected' with 'parts': nothing to check.");
    Expectation expectation;
    const YAML::Node tolerance = expected["tolerance_m"];
    if (!tolerance) fail(expected.Mark(), "'expected' has no key 'tolerance_m'; it needs a length above 0.");
    expectation.tolerance_m = number(tolerance);
    if (!(expectation.tolerance_m > 0.0))
      fail(tolerance.Mark(), "'expected.tolerance_m' must be a finite number above 0.");
    for (const auto& entry : expected["parts"]) {
      const auto name = entry.first.as<std::string>();
      const std::string path = "expected.parts." + name;
      if (!entry.second.IsMap() || !entry.second["position_m"])
        fail(entry.first.Mark(), "'" + path + "' must hold 'position_m' (and may hold an orientation).");
      const auto p = numbers(entry.second, "position_m", path, 3);
      expectation.parts.push_back({name, {p[0], p[1], p[2]}, orientation(entry.second, path)});
    }
    return expectation;
  }

 private:
  [[noreturn]] void fail(const YAML::Mark& mark, const std::string& what) const {
    throw std::runtime_error(file_ + ":" + std::to_string(mark.line + 1) + ":" +
                             std::to_string(mark.column + 1) + ": " + what);
  }

  /// Not a number when it is none, or none that is finite.
  static double number(const YAML::Node& node) {
    double value = NAN;
    if (!node.IsScalar() || !YAML::convert<double>::decode(node, value) || !std::isfinite(value)) return NAN;
    return value;
  }

  std::vector<double> numbers(const YAML::Node& parent, const std::string& key, const std::string& path,
                              std::size_t count) const {
    const YAML::Node node = parent[key];
    std::vector<double> values;
    if (node.IsSequence())
      for (const auto& item : node) values.push_back(number(item));
    bool good = values.size() == count;
    for (const double value : values) good = good && std::isfinite(value);
    if (!good)
      fail(node.Mark(),
           "'" + path + "." + key + "' must be a list of " + std::to_string(count) + " finite numbers.");
    return values;
  }

  /// At most one of the three ways a scenario has of telling an orientation; none: not turned.
  Quaternion orientation(const YAML::Node& part, const std::string& path) const {
    if ((part["rpy_rad"] ? 1 : 0) + (part["rpy_deg"] ? 1 : 0) + (part["quaternion_xyzw"] ? 1 : 0) > 1)
      fail(part.Mark(), "'" + path + "' may have only one of rpy_rad, rpy_deg, quaternion_xyzw.");
    if (part["quaternion_xyzw"]) {
      const auto q = numbers(part, "quaternion_xyzw", path, 4);
      const double length = std::hypot(std::hypot(q[0], q[1]), std::hypot(q[2], q[3]));
      if (std::abs(length - 1.0) > 1e-3)
        fail(part["quaternion_xyzw"].Mark(), "'" + path + ".quaternion_xyzw' must have length 1.");
      return {q[0] / length, q[1] / length, q[2] / length, q[3] / length};
    }
    const bool degrees = static_cast<bool>(part["rpy_deg"]);
    if (!degrees && !part["rpy_rad"]) return {};
    const auto rpy = numbers(part, degrees ? "rpy_deg" : "rpy_rad", path, 3);
    const double unit = degrees ? M_PI / 180.0 : 1.0;
    return from_rpy_rad({unit * rpy[0], unit * rpy[1], unit * rpy[2]});
  }

  const std::string& file_;
};

}  // namespace

int check(const Common& common, const CheckOptions& options) {
  const Expectation expectation = ExpectationReader(options.scenario_file).read();
  Session session(common);
  const Client& cell = *session;
  const State s = cell.state();
  bool all_hold = true;
  nlohmann::json document{{"time", s.time}, {"tolerance", expectation.tolerance_m}};
  if (!common.json)
    std::printf("At %.3f s, tolerance %g mm\n%-12s %32s   %32s   %10s %10s\n", s.time,
                1e3 * expectation.tolerance_m, "Part", "position [m]", "expected [m]", "error [mm]",
                "turn [°]");
  for (const auto& part : expectation.parts) {
    const auto& found = s.component(part.part);
    const double error_m = distance_m(found.position, part.position_m);
    const double turn_rad = angle_rad(found.orientation, part.orientation);
    // A Part is as far off as its farthest point may be: the turn counts on a lever of 0.1 m.
    const bool holds = error_m <= expectation.tolerance_m && 0.1 * turn_rad <= expectation.tolerance_m;
    all_hold = all_hold && holds;
    if (common.json)
      document["parts"][part.part] = {{"position", recording::message_json(found.position, {})},
                                      {"expected_position", recording::message_json(part.position_m, {})},
                                      {"position_error", error_m},
                                      {"orientation_error", turn_rad},
                                      {"ok", holds}};
    else
      std::printf("%-12s %10.6f %10.6f %10.6f   %10.6f %10.6f %10.6f   %10.4f %10.4f  %s\n",
                  part.part.c_str(), found.position.x, found.position.y, found.position.z, part.position_m.x,
                  part.position_m.y, part.position_m.z, 1e3 * error_m, turn_rad * 180.0 / M_PI,
                  holds ? "ok" : "NOT THERE");
  }
  document["ok"] = all_hold;
  if (common.json)
    std::printf("%s\n", recording::json_text(document, 2).c_str());
  else
    std::printf("%s\n",
                all_hold ? "All Parts are where they should be." : "Not all Parts are where they should be.");
  return all_hold ? 0 : 1;
}

}  // namespace takt::tool

#include "server/scenario/yaml_fields.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <sstream>
#include <utility>

#include "idl/common/text.h"
#include "server/scenario/scenario_reader.h"

namespace takt {

namespace {
std::string number_in_text(double value) {
  std::ostringstream out;
  out.precision(12);
  out << value;
  return out.str();
}
}  // namespace

std::string NumberRange::text() const {
  const bool below = std::isfinite(lower);
  const bool above = std::isfinite(upper);
  std::string result = "a number";
  if (below && above) {
    result += std::string(" in ") + (lower_open ? "(" : "[") + number_in_text(lower) + ", " +
              number_in_text(upper) + "]";
  } else if (below) {
    result += std::string(lower_open ? " > " : " >= ") + number_in_text(lower);
  } else if (above) {
    result += " <= " + number_in_text(upper);
  }
  return *unit != '\0' ? result + " " + unit : result;
}

std::string describe(const YAML::Node& node) {
  if (!node.IsDefined()) return "nothing";
  if (node.IsNull()) return "an empty value";
  if (node.IsScalar()) return "'" + node.Scalar() + "'";
  if (node.IsSequence()) return "a list of " + std::to_string(node.size()) + " values";
  return "a mapping";
}

YamlFields::YamlFields(const YamlSource& source, const YAML::Node& node, std::string path)
    : source_(&source), node_(node), path_(std::move(path)) {
  if (!node_.IsMap()) fail_at(node_, "", describe(node_), "a mapping of keys to values");
}

void YamlFields::fail(const std::string& key, const std::string& found, const std::string& allowed) const {
  const YAML::Node node = std::as_const(node_)[key];
  fail_at(node.IsDefined() ? node : node_, key, found, allowed);
}

std::string YamlFields::place_of(const YAML::Node& node, const std::string& key) const {
  const std::string full = key.empty() ? path_ : dotted(key);
  std::string place = source_->file.string();
  bool from_command_line = false;
  for (const std::string& overridden : source_->overridden) {
    from_command_line = from_command_line || full == overridden || full.rfind(overridden + ".", 0) == 0;
  }
  if (from_command_line) {
    place = "--set";
  } else if (node.IsDefined() && !node.Mark().is_null()) {
    place += ":" + std::to_string(node.Mark().line + 1) + ":" + std::to_string(node.Mark().column + 1);
  }
  return place + ": " + (full.empty() ? "the file" : full);
}

void YamlFields::fail_at(const YAML::Node& node, const std::string& key, const std::string& found,
                         const std::string& allowed) const {
  throw ScenarioError(place_of(node, key) + ": found " + found + "; allowed: " + allowed);
}

bool YamlFields::has(const std::string& key) {
  return optional(key).IsDefined();
}

YAML::Node YamlFields::optional(const std::string& key) {
  known_.insert(key);
  return std::as_const(node_)[key];
}

YAML::Node YamlFields::required(const std::string& key, const char* what) {
  YAML::Node node = optional(key);
  if (!node.IsDefined() || node.IsNull()) fail(key, "nothing (the key is missing)", what);
  return node;
}

YamlFields YamlFields::mapping(const std::string& key) {
  const YAML::Node node = optional(key);
  return {*source_, node.IsDefined() ? node : YAML::Node(YAML::NodeType::Map), dotted(key)};
}

std::vector<std::pair<std::string, YamlFields>> YamlFields::entries(const std::string& key) {
  std::vector<std::pair<std::string, YamlFields>> result;
  const YAML::Node node = optional(key);
  if (!node.IsDefined() || node.IsNull()) return result;
  if (!node.IsMap()) fail(key, describe(node), "a mapping of names to mappings");
  for (const auto& entry : node) {
    const std::string name = entry.first.Scalar();
    for (const auto& [other, fields] : result) {
      if (other == name) fail_at(entry.first, key, "the name '" + name + "' twice", "each name once");
    }
    if (!entry.second.IsMap())
      fail_at(entry.first, key + "." + name, describe(entry.second), "a mapping of keys to values");
    result.emplace_back(name, YamlFields(*source_, entry.second, dotted(key) + "." + name));
  }
  return result;
}

std::string YamlFields::text(const std::string& key) {
  const YAML::Node node = required(key, "a text");
  if (!node.IsScalar() || node.Scalar().empty()) fail(key, describe(node), "a text");
  return node.Scalar();
}

std::string YamlFields::text_or(const std::string& key, const std::string& fallback) {
  return has(key) ? text(key) : fallback;
}

double YamlFields::to_number(const YAML::Node& node, const std::string& key, const NumberRange& range) const {
  double value = 0.0;
  if (!node.IsScalar() || !YAML::convert<double>::decode(node, value))
    fail_at(node, key, describe(node), range.text());
  const bool inside = std::isfinite(value) && value <= range.upper &&
                      (range.lower_open ? value > range.lower : value >= range.lower);
  if (!inside) fail_at(node, key, node.Scalar(), range.text());
  return value;
}

double YamlFields::number(const std::string& key, const NumberRange& range) {
  const YAML::Node node = optional(key);
  if (!node.IsDefined()) fail(key, "nothing (the key is missing)", range.text());
  return to_number(node, key, range);
}

double YamlFields::number_or(const std::string& key, const NumberRange& range, double fallback) {
  return has(key) ? number(key, range) : fallback;
}

std::optional<double> YamlFields::number_if(const std::string& key, const NumberRange& range) {
  if (!has(key)) return std::nullopt;
  return number(key, range);
}

int YamlFields::integer(const std::string& key, int lower, int upper) {
  const std::string allowed =
      "a whole number in [" + std::to_string(lower) + ", " + std::to_string(upper) + "]";
  const YAML::Node node = required(key, allowed.c_str());
  int value = 0;
  if (!node.IsScalar() || !YAML::convert<int>::decode(node, value) || value < lower || value > upper) {
    fail(key, describe(node), allowed);
  }
  return value;
}

int YamlFields::integer_or(const std::string& key, int lower, int upper, int fallback) {
  return has(key) ? integer(key, lower, upper) : fallback;
}

bool YamlFields::boolean_or(const std::string& key, bool fallback) {
  const YAML::Node node = optional(key);
  if (!node.IsDefined()) return fallback;
  bool value = false;
  if (!node.IsScalar() || !YAML::convert<bool>::decode(node, value))
    fail(key, describe(node), "true or false");
  return value;
}

std::vector<double> YamlFields::numbers(const std::string& key, std::size_t count, const NumberRange& range) {
  const std::string allowed = count == 0
                                  ? "a list of numbers"
                                  : "a list of " + std::to_string(count) + " numbers" +
                                        (*range.unit != '\0' ? std::string(" ") + range.unit : std::string());
  const YAML::Node node = required(key, allowed.c_str());
  if (!node.IsSequence() || (count != 0 && node.size() != count)) fail(key, describe(node), allowed);
  std::vector<double> values;
  for (const YAML::Node& item : node) values.push_back(to_number(item, key, range));
  return values;
}

Vec3 YamlFields::vector_or(const std::string& key, const Vec3& fallback, const char* unit) {
  if (!has(key)) return fallback;
  NumberRange range;
  range.unit = unit;
  const std::vector<double> v = numbers(key, 3, range);
  return {v[0], v[1], v[2]};
}

std::vector<double> YamlFields::angles(const std::string& name, std::size_t count) {
  const std::string radians = name + "_rad", degrees = name + "_deg";
  if (!has(degrees)) return numbers(radians, count);
  if (has(radians)) fail(radians, degrees + " as well", "one of " + radians + " and " + degrees);
  std::vector<double> values = numbers(degrees, count);
  for (double& value : values) value *= std::numbers::pi / 180.0;
  return values;
}

Pose YamlFields::pose_or_identity(const std::string& key) {
  if (!has(key)) return {};
  YamlFields fields = mapping(key);
  Pose X;
  X.p = fields.vector_or("position_m", Vec3::Zero(), "m");
  const int given = static_cast<int>(fields.has("rpy_rad")) + static_cast<int>(fields.has("rpy_deg")) +
                    static_cast<int>(fields.has("quaternion_xyzw"));
  if (given > 1) {
    fail(key, "several orientations", "at most one of rpy_rad, rpy_deg, quaternion_xyzw");
  }
  if (fields.has("rpy_rad")) X.R = rotation_from_rpy(fields.vector_or("rpy_rad", Vec3::Zero(), "rad"));
  if (fields.has("rpy_deg")) {
    X.R = rotation_from_rpy(fields.vector_or("rpy_deg", Vec3::Zero(), "deg") * (std::numbers::pi / 180.0));
  }
  if (fields.has("quaternion_xyzw")) {
    const std::vector<double> q = fields.numbers("quaternion_xyzw", 4);
    Quat quaternion(q[3], q[0], q[1], q[2]);
    if (std::abs(quaternion.norm() - 1.0) > 1e-3) {
      fields.fail("quaternion_xyzw", "length " + number_in_text(quaternion.norm()),
                  "a unit quaternion x, y, z, w");
    }
    X.R = quaternion.normalized().toRotationMatrix();
  }
  fields.finish();
  return X;
}

std::filesystem::path YamlFields::existing_file(const std::string& key) {
  return existing_file(required(key, "a path relative to the scenario file"), key);
}

std::filesystem::path YamlFields::existing_file(const YAML::Node& node, const std::string& key) {
  if (!node.IsScalar() || node.Scalar().empty()) {
    fail_at(node, key, describe(node), "a path relative to the scenario file");
  }
  const std::filesystem::path given = node.Scalar();
  const std::filesystem::path file = given.is_absolute() ? given : source_->file.parent_path() / given;
  if (!std::filesystem::is_regular_file(file)) {
    throw MissingFileError(place_of(node, key) + ": found '" + given.string() +
                           "', which does not exist (looked for " + file.string() +
                           "); allowed: an existing file, by a path relative to the scenario file");
  }
  return file;
}

std::string YamlFields::choice(const std::string& key, const std::vector<std::string>& allowed,
                               const std::string& fallback) {
  const std::string value = text_or(key, fallback);
  if (std::find(allowed.begin(), allowed.end(), value) != allowed.end()) return value;
  fail(key, "'" + value + "'", list_names(allowed));
}

void YamlFields::finish() const {
  std::set<std::string> seen;
  for (const auto& entry : node_) {
    const std::string key = entry.first.IsScalar() ? entry.first.Scalar() : "?";
    if (!seen.insert(key).second) fail_at(entry.first, key, "the key twice", "each key once");
    if (known_.count(key) != 0) continue;
    fail_at(entry.first, key, "an unknown key", list_names(known_));
  }
}

}  // namespace takt

#include "server/fields/fields.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <numbers>

namespace takt {

namespace {

std::string text_of(const YAML::Node& node) {
  YAML::Emitter out;
  out << YAML::Flow << node;
  return out.c_str();
}

std::string dotted(const std::string& path, const std::string& key) {
  return path.empty() || key.empty() ? path + key : path + "." + key;
}

/// How a file states a pose.
struct StatedPose {
  Vec3 position_m = Vec3::Zero();
  std::optional<Vec3> rpy_rad{}, rpy_deg{};
  std::optional<std::vector<double>> quaternion_xyzw{}, rotation_matrix{};
};

Mat3 rotation_of(const StatedPose& s) {
  if (s.rpy_rad) return rotation_from_rpy(*s.rpy_rad);
  if (s.rpy_deg) return rotation_from_rpy(*s.rpy_deg * (std::numbers::pi / 180.0));
  if (s.quaternion_xyzw) {
    const std::vector<double>& q = *s.quaternion_xyzw;
    return Quat(q[3], q[0], q[1], q[2]).normalized().toRotationMatrix();
  }
  if (s.rotation_matrix)
    return Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(s.rotation_matrix->data());
  return Mat3::Identity();
}

/// Roll, pitch and yaw.
Vec3 rpy_from_rotation(const Mat3& R) {
  const double pitch = std::atan2(-R(2, 0), std::hypot(R(0, 0), R(1, 0)));
  return {std::atan2(R(2, 1), R(2, 2)), pitch, std::atan2(R(1, 0), R(0, 0))};
}

bool same_bits(const Mat3& a, const Mat3& b) {
  return std::equal(a.data(), a.data() + a.size(), b.data(), [](double x, double y) {
    return std::bit_cast<std::uint64_t>(x) == std::bit_cast<std::uint64_t>(y);
  });
}

/// The first readable form that gives these bits; else the matrix.
StatedPose statement_of(const Pose& X) {
  StatedPose result{.position_m = X.p};
  if (same_bits(X.R, Mat3::Identity())) return result;
  const Vec3 rpy = rpy_from_rotation(X.R);
  for (const double digits : {1e6, 1e12}) {
    StatedPose degrees = result;
    degrees.rpy_deg = ((rpy * (180.0 / std::numbers::pi)) * digits).array().round() / digits;
    *degrees.rpy_deg += Vec3::Zero();  // no -0
    if (same_bits(rotation_of(degrees), X.R)) return degrees;
  }
  StatedPose radians = result;
  radians.rpy_rad = rpy;
  if (same_bits(rotation_of(radians), X.R)) return radians;
  const Eigen::Matrix<double, 3, 3, Eigen::RowMajor> rows = X.R;
  result.rotation_matrix.emplace(rows.data(), rows.data() + 9);
  return result;
}

void describe(Fields& f, StatedPose& s) {
  f.field("position_m", s.position_m, vector3("m"), "Origin.");
  f.field("rpy_rad", s.rpy_rad, vector3("rad"), "Rotations about the fixed axes x, y, z, in this order.");
  f.field("rpy_deg", s.rpy_deg, vector3("deg"), "The same in degrees.");
  f.field("quaternion_xyzw", s.quaternion_xyzw, Numbers{4}, "Unit quaternion.");
  f.field("rotation_matrix", s.rotation_matrix, Numbers{9}, "Rotation matrix, row by row.");
  f.alternatives({"rpy_rad", "rpy_deg", "quaternion_xyzw", "rotation_matrix"}, 0, 1, "",
                 "several orientations", "at most one of rpy_rad, rpy_deg, quaternion_xyzw, rotation_matrix");
  if (s.quaternion_xyzw) {
    const double length = Eigen::Map<const Eigen::Vector4d>(s.quaternion_xyzw->data()).norm();
    f.check(std::abs(length - 1.0) <= 1e-3, "quaternion_xyzw", "length " + rounded_number(length),
            "a unit quaternion x, y, z, w");
  }
  if (s.rotation_matrix) {
    const Mat3 R = rotation_of(s);
    f.check((R.transpose() * R - Mat3::Identity()).norm() <= 1e-6 && R.determinant() > 0.0, "rotation_matrix",
            "rows that are not orthonormal and right-handed", "a rotation matrix");
  }
}

}  // namespace

Fields::Fields(const YamlSource& source, const YAML::Node& root) : pass_(Pass::read), source_(source) {
  frames_.push_back({.node = root, .path = "", .generic = ""});
  if (!root.IsMap()) here("").fail(describe_node(root), "a mapping of keys to values");
}

Fields::Fields(std::filesystem::path directory) : pass_(Pass::write), directory_(std::move(directory)) {
  frames_.push_back({.node = {}, .path = "", .generic = ""});
}

Fields::Fields() : pass_(Pass::info) {
  frames_.push_back({.node = {}, .path = "", .generic = ""});
}

FieldValue Fields::here(const std::string& key) const {
  const Frame& frame = frames_.back();
  const YAML::Node node = key.empty() ? frame.node : std::as_const(frame.node)[key];
  return {&source_, node.IsDefined() ? node : frame.node, dotted(frame.path, key)};
}

void Fields::fail(const std::string& key, const std::string& found, const std::string& allowed) const {
  here(key).fail(found, allowed);
}

std::string Fields::place(const std::string& key) const {
  return reading() ? here(key).place() : std::string();
}

bool Fields::has(const std::string& key) const {
  return reading() && std::as_const(frames_.back().node)[key].IsDefined();
}

std::optional<FieldValue> Fields::find(const std::string& key) {
  frames_.back().known.push_back(key);
  if (!has(key)) return std::nullopt;
  return here(key);
}

void Fields::begin(const char* key, const char* generic, const char* doc, unsigned flags,
                   const char* shared) {
  const Frame& above = frames_.back();
  Frame frame{.node = {}, .path = dotted(above.path, key), .generic = dotted(above.generic, generic)};
  frame.key = key;
  frame.always = (flags & kAlwaysWritten) != 0;
  if (reading()) {
    const auto value = find(key);
    frame.node.reset(value && !(value->node.IsNull() && *generic != '*') ? value->node
                                                                         : YAML::Node(YAML::NodeType::Map));
    if (!frame.node.IsMap()) value->fail(describe_node(value->node), "a mapping of keys to values");
  }
  frame.info.key = key;
  frame.info.doc = doc;
  frame.info.shared = shared;
  frame.info.scenario_names = (flags & kNamesTopics) != 0;
  frame.info.required = (flags & kRequired) != 0;
  frame.info.in_model = (flags & kNotInModel) == 0;
  frames_.push_back(std::move(frame));
}

void Fields::begin_element(const char* key, const YAML::Node& node) {
  const Frame& above = frames_.back();
  Frame frame{.node = node, .path = dotted(above.path, key), .generic = dotted(above.generic, key)};
  frame.key = key;
  frame.element = frame.always = true;
  frames_.push_back(std::move(frame));
  if (reading() && !node.IsMap()) here("").fail(describe_node(node), "a mapping of keys to values");
}

void Fields::end() {
  if (reading()) check_keys();
  Frame frame = std::move(frames_.back());
  frames_.pop_back();
  Frame& above = frames_.back();
  if (pass_ == Pass::write && (frame.always || frame.written.size() > 0)) {
    if (frame.written.size() == 0) frame.written = YAML::Node(YAML::NodeType::Map);
    if (frame.element)
      above.written[frame.key].push_back(frame.written);
    else
      above.written[frame.key] = frame.written;
  }
  if (pass_ == Pass::info) above.info.items.push_back(std::move(frame.info));
}

void Fields::finish() {
  check_keys();
}

YAML::Node Fields::take_written() {
  return frames_.back().written;
}

KeyInfo Fields::take_info() {
  KeyInfo result = std::move(frames_.back().info);
  frames_.pop_back();
  return result;
}

void Fields::put(const std::string& key, const YAML::Node& value, unsigned flags) {
  Frame& frame = frames_.back();
  const std::string path = dotted(frame.generic, key), text = text_of(value);
  if (pass_ == Pass::defaults) {
    defaults_[path] = text;
    return;
  }
  const auto fallback = defaults_.find(path);
  const bool always = (flags & (kRequired | kAlwaysWritten)) != 0;
  if (always || fallback == defaults_.end() || fallback->second != text) frame.written[key] = value;
}

void Fields::add(const std::string& key, KeyInfo info, const char* doc, unsigned flags,
                 const YAML::Node& fallback) {
  info.key = key;
  info.doc = doc;
  info.required = (flags & kRequired) != 0;
  info.in_model = (flags & kNotInModel) == 0;
  if (!fallback.IsNull()) info.default_text = fallback.IsScalar() ? fallback.Scalar() : text_of(fallback);
  frames_.back().info.items.push_back(std::move(info));
}

std::vector<std::string> Fields::names_in() const {
  std::vector<std::string> result;
  const Frame& frame = frames_.back();
  for (const auto& entry : frame.node) {
    const FieldValue at{&source_, entry.first, frame.path};
    if (!entry.first.IsScalar() || entry.first.Scalar().empty())
      at.fail(describe_node(entry.first), "a name");
    const std::string name = entry.first.Scalar();
    if (std::find(result.begin(), result.end(), name) != result.end())
      at.fail("the name '" + name + "' twice", "each name once");
    if (!entry.second.IsMap())
      FieldValue{&source_, entry.first, dotted(frame.path, name)}.fail(describe_node(entry.second),
                                                                       "a mapping of keys to values");
    result.push_back(name);
  }
  return result;
}

std::vector<YAML::Node> Fields::nodes_in(const char* key, const char* what) {
  std::vector<YAML::Node> result;
  const auto value = find(key);
  if (!value || value->node.IsNull()) return result;
  if (!value->node.IsSequence()) value->fail(describe_node(value->node), what);
  for (const YAML::Node& node : value->node) result.push_back(node);
  return result;
}

void Fields::check_keys() const {
  const Frame& frame = frames_.back();
  std::vector<std::string> seen;
  for (const auto& entry : frame.node) {
    const std::string key = entry.first.IsScalar() ? entry.first.Scalar() : "?";
    const FieldValue at{&source_, entry.first, dotted(frame.path, key)};
    if (std::find(seen.begin(), seen.end(), key) != seen.end()) at.fail("the key twice", "each key once");
    seen.push_back(key);
    if (std::find(frame.known.begin(), frame.known.end(), key) != frame.known.end()) continue;
    std::string list;
    for (const std::string& known : std::set<std::string>(frame.known.begin(), frame.known.end()))
      list += (list.empty() ? "" : ", ") + known;
    at.fail("an unknown key", list);
  }
}

void Fields::pose(const char* key, Pose& pose, const char* doc, unsigned flags) {
  StatedPose stated = writing() ? statement_of(pose) : StatedPose{};
  section(key, doc, stated, flags, "pose");
  if (reading()) pose = {rotation_of(stated), stated.position_m};
}

void Fields::angles(const std::string& name, std::vector<double>& angles_rad, std::size_t count,
                    const char* doc, unsigned flags) {
  const std::string radians = name + "_rad", degrees = name + "_deg";
  std::vector<double> angles_deg;
  const bool in_degrees = has(degrees);
  field(radians.c_str(), angles_rad, Numbers{count, {.unit = "rad"}}, doc,
        in_degrees || informing() ? flags & ~kRequired : flags);
  if (reading() || informing())
    field(degrees.c_str(), angles_deg, Numbers{count, {.unit = "deg"}}, "The same in degrees.");
  alternatives({radians, degrees}, flags & kRequired, 1, radians, degrees + " as well",
               "one of " + radians + " and " + degrees);
  if (!in_degrees) return;
  angles_rad.clear();
  for (const double angle : angles_deg) angles_rad.push_back(angle * (std::numbers::pi / 180.0));
}

void Fields::alternatives(const std::vector<std::string>& keys, std::size_t least, std::size_t most,
                          const std::string& place, const std::string& found, const std::string& allowed) {
  if (informing()) frames_.back().info.alternatives.push_back({keys, least, most});
  const auto given = static_cast<std::size_t>(
      std::count_if(keys.begin(), keys.end(), [&](const std::string& key) { return has(key); }));
  check(given >= least && given <= most, place, found, allowed);
}

void Fields::together(const char* a, const char* b) {
  if (informing()) frames_.back().info.together.push_back({a, b});
  check(has(a) == has(b), has(a) ? a : b, "one of the two",
        std::string(a) + " and " + b + " together, or neither");
}

NameOf Fields::name_of(const std::vector<const char*>& sections, const char* what) const {
  NameOf result{{}, what};
  for (const char* section : sections)
    for (const auto& [group, name] : names_)
      if (group == section) result.names.push_back(name);
  return result;
}

}  // namespace takt

#pragma once
// A YAML mapping read field by field: every key must be asked for, every value checked where it is read, and
// every error says file, line, column, key, what was found and what is allowed.
#include <yaml-cpp/yaml.h>

#include <filesystem>
#include <limits>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "plant_models/spatial.h"

namespace takt {

/// Where values come from: the file, and the keys that --set replaced.
struct YamlSource {
  std::filesystem::path file;
  std::set<std::string> overridden;  ///< dotted keys
};

/// Allowed interval of a number, with its unit for error texts.
struct NumberRange {
  double lower = -std::numeric_limits<double>::infinity();
  double upper = std::numeric_limits<double>::infinity();
  bool lower_open = false;
  const char* unit = "";
  std::string text() const;
};
inline NumberRange positive(const char* unit) {
  return {.lower = 0.0, .lower_open = true, .unit = unit};
}
inline NumberRange not_negative(const char* unit) {
  return {.lower = 0.0, .unit = unit};
}

class YamlFields {
 public:
  /// `node` must be a mapping.
  YamlFields(const YamlSource& source, const YAML::Node& node, std::string path);

  const std::string& path() const { return path_; }
  bool has(const std::string& key);
  /// The node of a key, or an undefined node; marks the key as known.
  YAML::Node optional(const std::string& key);
  YAML::Node required(const std::string& key, const char* what);
  /// A mapping below this one; for an absent key an empty mapping.
  YamlFields mapping(const std::string& key);
  /// (name, fields) of every entry of a mapping of mappings, in file order.
  std::vector<std::pair<std::string, YamlFields>> entries(const std::string& key);

  std::string text(const std::string& key);
  std::string text_or(const std::string& key, const std::string& fallback);
  double number(const std::string& key, const NumberRange& range);
  double number_or(const std::string& key, const NumberRange& range, double fallback);
  std::optional<double> number_if(const std::string& key, const NumberRange& range);
  int integer(const std::string& key, int lower, int upper);
  int integer_or(const std::string& key, int lower, int upper, int fallback);
  bool boolean_or(const std::string& key, bool fallback);
  std::vector<double> numbers(const std::string& key, std::size_t count, const NumberRange& range = {});
  /// Angles (rad) under NAME_rad or NAME_deg, one of which must be there.
  std::vector<double> angles(const std::string& name, std::size_t count);
  Vec3 vector_or(const std::string& key, const Vec3& fallback, const char* unit);
  /// {position_m, and at most one of rpy_rad, rpy_deg, quaternion_xyzw}; absent: identity.
  Pose pose_or_identity(const std::string& key);
  /// Relative to the scenario file; must exist.
  std::filesystem::path existing_file(const std::string& key);
  std::filesystem::path existing_file(const YAML::Node& node, const std::string& key);
  std::string choice(const std::string& key, const std::vector<std::string>& allowed,
                     const std::string& fallback);

  /// Throws if a key was not asked for.
  void finish() const;

  [[noreturn]] void fail(const std::string& key, const std::string& found, const std::string& allowed) const;
  /// "file:line:column: dotted.key", for an error that is found only later.
  std::string place_of(const YAML::Node& node, const std::string& key) const;
  [[noreturn]] void fail_at(const YAML::Node& node, const std::string& key, const std::string& found,
                            const std::string& allowed) const;

 private:
  double to_number(const YAML::Node& node, const std::string& key, const NumberRange& range) const;
  std::string dotted(const std::string& key) const { return path_.empty() ? key : path_ + "." + key; }
  const YamlSource* source_;
  YAML::Node node_;
  std::string path_;
  std::set<std::string> known_;
};

/// What a node holds, for error texts.
std::string describe(const YAML::Node& node);

}  // namespace takt

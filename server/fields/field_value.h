#pragma once
// A value of a YAML file and its place in the file.
#include <yaml-cpp/yaml.h>

#include <filesystem>
#include <map>
#include <string>

#include "server/fields/scenario_error.h"

namespace takt {

/// Where values come from: the file, and the command line.
struct YamlSource {
  std::filesystem::path file;
  std::map<std::string, std::string> overridden{};  ///< dotted keys, and the option that replaced each
};

/// A text with at most a million values. Throws YAML::ParserException.
YAML::Node parse_yaml(const std::string& text);
/// The whole file, up to 16 MB. Throws ScenarioError.
YAML::Node load_yaml(const std::filesystem::path& file);
/// The same of a text in place of the content of the file.
YAML::Node parse_yaml_of(const std::filesystem::path& file, const std::string& text);

struct FieldValue {
  const YamlSource* source = nullptr;
  YAML::Node node;
  std::string path;  ///< dotted key

  /// "file:line:column: dotted.key", for a later error message.
  std::string place() const;
  /// Throws ScenarioError.
  [[noreturn]] void fail(const std::string& found, const std::string& allowed) const;
  /// The same for a part of this value, e.g. an element of a list.
  FieldValue part(const YAML::Node& inner) const { return {source, inner, path}; }
};

/// Describes the content of a node, for error texts.
std::string describe_node(const YAML::Node& node);
/// The shortest text that reads back to the same bits.
std::string exact_number(double value);
/// For error texts: 12 digits.
std::string rounded_number(double value);

}  // namespace takt

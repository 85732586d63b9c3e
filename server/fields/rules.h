#pragma once
// Rules of values: the values that a key of a scenario may have, and how they are read, checked and written
// back.
//
// A rule has four functions: read() throws ScenarioError for a wrong value; write() gives a node that reads
// back to the same bits; info() describes the rule as data; allowed() describes it in words.
#include <algorithm>
#include <array>
#include <map>
#include <optional>
#include <utility>

#include "idl/common/enumeration.h"
#include "plant_models/spatial.h"
#include "server/fields/field_value.h"
#include "server/fields/key_info.h"

namespace takt {

/// A number (double) in an interval.
struct NumberRange {
  double lower = -std::numeric_limits<double>::infinity();
  double upper = std::numeric_limits<double>::infinity();
  bool lower_open = false;
  const char* unit = "";
  std::string allowed() const;
  void read(const FieldValue& value, double& number) const;
  static YAML::Node write(double number) { return YAML::Node(exact_number(number)); }
  KeyInfo info() const;
};
inline NumberRange positive(const char* unit) {
  return {.lower = 0.0, .lower_open = true, .unit = unit};
}
inline NumberRange not_negative(const char* unit) {
  return {.lower = 0.0, .unit = unit};
}
inline constexpr NumberRange kTemperature_degC{.lower = -273.0, .upper = 5000.0, .unit = "degC"};

struct WholeRange {
  int lower = 0, upper = 0;
  std::string allowed() const;
  void read(const FieldValue& value, int& number) const;
  static YAML::Node write(int number) { return YAML::Node(number); }
  KeyInfo info() const;
};

struct Flag {
  static std::string allowed() { return "true or false"; }
  static void read(const FieldValue& value, bool& flag);
  static YAML::Node write(bool flag) { return YAML::Node(flag); }
  static KeyInfo info() { return {.kind = KeyInfo::Kind::flag}; }
};

struct Text {
  static std::string allowed() { return "a text"; }
  static void read(const FieldValue& value, std::string& text);
  static YAML::Node write(const std::string& text) { return YAML::Node(text); }
  static KeyInfo info() { return {.kind = KeyInfo::Kind::text}; }
};

/// The name of an entry of the scenario.
struct NameOf {
  std::vector<std::string> names;
  const char* what = "";  ///< "a robot"
  const char* also = "";  ///< a word besides, e.g. "nothing"
  std::string allowed() const;
  void read(const FieldValue& value, std::string& name) const;
  static YAML::Node write(const std::string& name) { return YAML::Node(name); }
  static KeyInfo info() { return Text::info(); }
};

/// An existing file, by a path relative to the scenario file.
struct ExistingFile {
  std::filesystem::path directory;  ///< of the scenario file that is written
  static std::string allowed() { return "a path relative to the scenario file"; }
  static void read(const FieldValue& value, std::filesystem::path& file);
  YAML::Node write(const std::filesystem::path& file) const;
  static KeyInfo info() { return {.kind = KeyInfo::Kind::file}; }
};

/// An existing mesh file, or FILE.glb#NODE (split_mesh_path).
struct ExistingMesh : ExistingFile {
  static void read(const FieldValue& value, std::filesystem::path& file);
};

/// One of several words, each standing for a value.
template <class Value>
struct Choice {
  std::vector<std::pair<std::string, Value>> words;
  std::string allowed() const {
    std::string list;
    for (const auto& [word, meant] : words) list += (list.empty() ? "" : ", ") + word;
    return list;
  }
  void read(const FieldValue& at, Value& value) const {
    std::string text;
    Text::read(at, text);
    const auto found =
        std::find_if(words.begin(), words.end(), [&](const auto& word) { return word.first == text; });
    if (found == words.end()) at.fail("'" + text + "'", allowed());
    value = found->second;
  }
  const std::string& word(const Value& value) const {
    return std::find_if(words.begin(), words.end(), [&](const auto& w) { return w.second == value; })->first;
  }
  YAML::Node write(const Value& value) const { return YAML::Node(word(value)); }
  KeyInfo info() const {
    KeyInfo result{.kind = KeyInfo::Kind::choice};
    for (const auto& [word, meant] : words) result.choices.push_back(word);
    return result;
  }
};
/// The words of an enumeration of the IDL.
template <TabledEnumeration Enumeration>
Choice<Enumeration> choice_of() {
  Choice<Enumeration> result;
  for (const EnumeratorInfo& one : kEnumeration<Enumeration>.enumerators)
    result.words.emplace_back(one.name, static_cast<Enumeration>(one.value));
  return result;
}
/// Words without associated values.
template <class Words>
Choice<std::string> choice_of(const Words& words) {
  Choice<std::string> result;
  for (const auto& word : words) result.words.emplace_back(word, word);
  return result;
}

/// A list of numbers, each in the range.
struct Numbers {
  std::size_t count = 0;  ///< 0: any
  NumberRange range{};
  std::string allowed() const;
  void read(const FieldValue& value, std::vector<double>& numbers) const;
  YAML::Node write(const std::vector<double>& numbers) const;
  KeyInfo info() const;
};

/// Three numbers.
struct Vector3 {
  NumberRange range{};
  std::string allowed() const { return Numbers{3, range}.allowed(); }
  void read(const FieldValue& value, Vec3& vector) const;
  YAML::Node write(const Vec3& v) const { return Numbers{3, range}.write({v.x(), v.y(), v.z()}); }
  KeyInfo info() const { return Numbers{3, range}.info(); }
};
inline Vector3 vector3(const char* unit) {
  return {{.unit = unit}};
}

/// A number for all joints, or a list with one for each.
struct ForJoints {
  NumberRange range{};
  std::string allowed() const { return "a number, or one for each joint"; }
  void read(const FieldValue& value, std::vector<double>& numbers) const;
  YAML::Node write(const std::vector<double>& numbers) const;
  KeyInfo info() const;
};

/// Red, green, blue, and optionally alpha.
struct Color {
  static std::string allowed() { return "three or four numbers in [0, 1]: red, green, blue, alpha"; }
  static void read(const FieldValue& value, std::array<float, 4>& color);
  static YAML::Node write(const std::array<float, 4>& color);
  static KeyInfo info();
};

/// xx, yy, zz, xy, xz, yz of a positive definite tensor.
struct InertiaTensor {
  static std::string allowed() { return "a list of 6 numbers"; }
  static void read(const FieldValue& value, Mat3& inertia);
  static YAML::Node write(const Mat3& inertia);
  static KeyInfo info() { return Numbers{6, {.unit = "kg m^2"}}.info(); }
};

/// Two names or patterns.
struct NamePair {
  static std::string allowed() {
    return "two names, e.g. [Robot1/forearm_link, Table1]; * stands for any characters";
  }
  static void read(const FieldValue& value, std::array<std::string, 2>& pair);
  static YAML::Node write(const std::array<std::string, 2>& pair);
  static KeyInfo info();
};

/// A list of values of one rule.
template <class Rule>
struct ListOf {
  Rule rule;
  const char* what = "";  ///< "a list of [NAME, NAME]"
  std::size_t least = 0;
  std::string allowed() const { return what; }
  template <class Value>
  void read(const FieldValue& at, std::vector<Value>& values) const {
    if (at.node.IsNull() && least == 0) return;
    if (!at.node.IsSequence() || at.node.size() < least) at.fail(describe_node(at.node), allowed());
    for (const YAML::Node& node : at.node) rule.read(at.part(node), values.emplace_back());
  }
  template <class Value>
  YAML::Node write(const std::vector<Value>& values) const {
    YAML::Node result(YAML::NodeType::Sequence);
    for (const Value& value : values) result.push_back(rule.write(value));
    return result;
  }
  KeyInfo info() const { return {.kind = KeyInfo::Kind::list, .min_items = least, .items = {rule.info()}}; }
};

/// Names, each with a number.
struct NumberMap {
  static std::string allowed() { return "a mapping of names to numbers"; }
  static void read(const FieldValue& value, std::map<std::string, double>& numbers);
  static YAML::Node write(const std::map<std::string, double>& numbers);
  static KeyInfo info();
};

}  // namespace takt

#include "server/fields/rules.h"

#include <yaml-cpp/eventhandler.h>

#include <charconv>
#include <cmath>
#include <sstream>

#include "idl/common/bounded_file.h"
#include "idl/common/mesh_path.h"

namespace takt {

using Kind = KeyInfo::Kind;

namespace {

constexpr std::size_t kLargestScenario_MB = 16;
constexpr std::size_t kMaxValues = 1'000'000;  ///< a cell of 4096 Parts has some 100 000

/// Counts the values of a document while it is parsed, without a tree of them, which takes hundreds of bytes for each.
class ValueCount : public YAML::EventHandler {
 public:
  void OnDocumentStart(const YAML::Mark&) override {}
  void OnDocumentEnd() override {}
  void OnNull(const YAML::Mark& mark, YAML::anchor_t) override { count(mark); }
  void OnAlias(const YAML::Mark& mark, YAML::anchor_t) override { count(mark); }
  void OnScalar(const YAML::Mark& mark, const std::string&, YAML::anchor_t, const std::string&) override {
    count(mark);
  }
  void OnSequenceStart(const YAML::Mark& mark, const std::string&, YAML::anchor_t,
                       YAML::EmitterStyle::value) override {
    count(mark);
  }
  void OnSequenceEnd() override {}
  void OnMapStart(const YAML::Mark& mark, const std::string&, YAML::anchor_t,
                  YAML::EmitterStyle::value) override {
    count(mark);
  }
  void OnMapEnd() override {}

 private:
  void count(const YAML::Mark& mark) {
    if (++values_ > kMaxValues)
      throw YAML::ParserException(mark, "more than " + std::to_string(kMaxValues) + " values");
  }

  std::size_t values_ = 0;
};

}  // namespace

YAML::Node parse_yaml(const std::string& text) {
  std::istringstream stream(text);
  YAML::Parser parser(stream);
  ValueCount count;
  parser.HandleNextDocument(count);
  return YAML::Load(text);
}

YAML::Node load_yaml(const std::filesystem::path& file) {
  std::error_code unknown;
  if (std::filesystem::is_directory(file, unknown))
    throw ScenarioError(file.string() + ": a directory; a scenario is a file, NAME.yaml");
  const FileText read = read_bounded_file(file, kLargestScenario_MB);
  if (!read.problem.empty())
    throw ScenarioError(file.string() + ": the scenario file cannot be opened: " + read.problem);
  return parse_yaml_of(file, read.text);
}

YAML::Node parse_yaml_of(const std::filesystem::path& file, const std::string& text) {
  try {
    return parse_yaml(text);
  } catch (const YAML::ParserException& error) {
    throw ScenarioError(file.string() + ":" + std::to_string(error.mark.line + 1) + ":" +
                        std::to_string(error.mark.column + 1) + ": not valid YAML: " + error.msg);
  }
}

std::string FieldValue::place() const {
  for (const auto& [key, option] : source->overridden)
    if (path == key || path.starts_with(key + ".") || (!node.IsMap() && key.starts_with(path + ".")))
      return option == "--set" ? "--set: " + path : option;
  std::string result = source->file.string();
  if (node.IsDefined() && !node.Mark().is_null())
    result += ":" + std::to_string(node.Mark().line + 1) + ":" + std::to_string(node.Mark().column + 1);
  return result + ": " + (path.empty() ? "the file" : path);
}

void FieldValue::fail(const std::string& found, const std::string& allowed) const {
  throw ScenarioError(place() + ": found " + found + "; allowed: " + allowed);
}

std::string describe_node(const YAML::Node& node) {
  if (!node.IsDefined()) return "nothing";
  if (node.IsNull()) return "an empty value";
  if (node.IsScalar()) return "'" + node.Scalar() + "'";
  if (node.IsSequence()) return "a list of " + std::to_string(node.size()) + " values";
  return "a mapping";
}

namespace {
template <class Number>
std::string exact_text(Number value) {
  if (std::isinf(value)) return value < 0 ? "-.inf" : ".inf";
  char digits[32];
  const auto end = std::to_chars(std::begin(digits), std::end(digits), value).ptr;
  std::string text(std::begin(digits), end);
  // A number with a decimal point and digits on both sides is valid in YAML 1.1 (not 1e-07) and in JSON (not
  // 1.e-07).
  const auto exponent = text.find('e');
  if (exponent != std::string::npos && text.find('.') == std::string::npos) text.insert(exponent, ".0");
  return text;
}
}  // namespace

std::string exact_number(double value) {
  return exact_text(value);
}

std::string rounded_number(double value) {
  std::ostringstream out;
  out.precision(12);
  out << value;
  return out.str();
}

std::string NumberRange::allowed() const {
  std::string result = "a number";
  if (std::isfinite(lower) && std::isfinite(upper)) {
    result += std::string(" in ") + (lower_open ? "(" : "[") + rounded_number(lower) + ", " +
              rounded_number(upper) + "]";
  } else if (std::isfinite(lower)) {
    result += std::string(lower_open ? " > " : " >= ") + rounded_number(lower);
  } else if (std::isfinite(upper)) {
    result += " <= " + rounded_number(upper);
  }
  return *unit != '\0' ? result + " " + unit : result;
}

void NumberRange::read(const FieldValue& value, double& number) const {
  if (!value.node.IsScalar() || !YAML::convert<double>::decode(value.node, number))
    value.fail(describe_node(value.node), allowed());
  const bool inside =
      std::isfinite(number) && number <= upper && (lower_open ? number > lower : number >= lower);
  if (!inside) value.fail(value.node.Scalar(), allowed());
}

KeyInfo NumberRange::info() const {
  return {.kind = Kind::number, .unit = unit, .lower = lower, .upper = upper, .lower_open = lower_open};
}

std::string WholeRange::allowed() const {
  return "a whole number in [" + std::to_string(lower) + ", " + std::to_string(upper) + "]";
}

void WholeRange::read(const FieldValue& value, int& number) const {
  if (!value.node.IsScalar() || !YAML::convert<int>::decode(value.node, number) || number < lower ||
      number > upper)
    value.fail(describe_node(value.node), allowed());
}

KeyInfo WholeRange::info() const {
  return {.kind = Kind::whole, .lower = static_cast<double>(lower), .upper = static_cast<double>(upper)};
}

void Flag::read(const FieldValue& value, bool& flag) {
  if (!value.node.IsScalar() || !YAML::convert<bool>::decode(value.node, flag))
    value.fail(describe_node(value.node), allowed());
}

void Text::read(const FieldValue& value, std::string& text) {
  if (!value.node.IsScalar() || value.node.Scalar().empty()) value.fail(describe_node(value.node), allowed());
  text = value.node.Scalar();
}

std::string NameOf::allowed() const {
  std::string list;
  for (const std::string& name : names) list += (list.empty() ? "" : ", ") + name;
  return std::string(what) + " of this scenario: " + (list.empty() ? "none" : list);
}

void NameOf::read(const FieldValue& value, std::string& name) const {
  Text::read(value, name);
  if (name != also && std::find(names.begin(), names.end(), name) == names.end())
    value.fail("'" + name + "'", allowed());
}

namespace {

template <class Exists>
void read_path(const FieldValue& value, std::filesystem::path& file, const Exists& exists) {
  if (!value.node.IsScalar() || value.node.Scalar().empty())
    value.fail(describe_node(value.node), ExistingFile::allowed());
  const std::filesystem::path given = value.node.Scalar();
  file = given.is_absolute() ? given : value.source->file.parent_path() / given;
  if (!exists(file)) {
    throw MissingFileError(value.place() + ": found '" + given.string() +
                           "', which does not exist (looked for " + file.string() +
                           "); allowed: an existing file, by a path relative to the scenario file");
  }
}

}  // namespace

void ExistingFile::read(const FieldValue& value, std::filesystem::path& file) {
  read_path(value, file, [](const std::filesystem::path& f) { return std::filesystem::is_regular_file(f); });
}

void ExistingMesh::read(const FieldValue& value, std::filesystem::path& file) {
  read_path(value, file, [](const std::filesystem::path& f) {
    return std::filesystem::is_regular_file(split_mesh_path(f).file);
  });
}

YAML::Node ExistingFile::write(const std::filesystem::path& file) const {
  if (file.empty()) return YAML::Node(std::string());
  return YAML::Node(std::filesystem::proximate(file, directory).string());
}

std::string Numbers::allowed() const {
  if (count == 0) return "a list of numbers";
  const std::string list = "a list of " + std::to_string(count) + " numbers";
  return *range.unit != '\0' ? list + " " + range.unit : list;
}

void Numbers::read(const FieldValue& value, std::vector<double>& numbers) const {
  if (!value.node.IsSequence() || (count != 0 && value.node.size() != count))
    value.fail(describe_node(value.node), allowed());
  numbers.clear();
  for (const YAML::Node& item : value.node) range.read(value.part(item), numbers.emplace_back());
}

YAML::Node Numbers::write(const std::vector<double>& numbers) const {
  return ListOf<NumberRange>{range}.write(numbers);
}

KeyInfo Numbers::info() const {
  return {.kind = Kind::list, .min_items = count, .max_items = count, .items = {range.info()}};
}

void Vector3::read(const FieldValue& value, Vec3& vector) const {
  std::vector<double> numbers;
  Numbers{3, range}.read(value, numbers);
  vector = {numbers[0], numbers[1], numbers[2]};
}

void ForJoints::read(const FieldValue& value, std::vector<double>& numbers) const {
  if (value.node.IsSequence()) return Numbers{0, range}.read(value, numbers);
  numbers.assign(1, 0.0);
  range.read(value, numbers.front());
}

YAML::Node ForJoints::write(const std::vector<double>& numbers) const {
  return numbers.size() == 1 ? range.write(numbers.front()) : Numbers{0, range}.write(numbers);
}

KeyInfo ForJoints::info() const {
  KeyInfo result = range.info();
  result.other_forms = {Numbers{0, range}.info()};
  return result;
}

namespace {
constexpr NumberRange kShare{.lower = 0.0, .upper = 1.0};
}

void Color::read(const FieldValue& value, std::array<float, 4>& color) {
  std::vector<double> shares;
  if (!value.node.IsSequence() || (value.node.size() != 3 && value.node.size() != 4))
    value.fail(describe_node(value.node), allowed());
  Numbers{0, kShare}.read(value, shares);
  color = {0.0F, 0.0F, 0.0F, 1.0F};
  for (std::size_t i = 0; i < shares.size(); ++i) color[i] = static_cast<float>(shares[i]);
}

YAML::Node Color::write(const std::array<float, 4>& color) {
  YAML::Node result(YAML::NodeType::Sequence);
  for (std::size_t i = 0; i < (color[3] == 1.0F ? 3U : 4U); ++i) result.push_back(exact_text(color[i]));
  return result;
}

KeyInfo Color::info() {
  return {.kind = Kind::list, .min_items = 3, .max_items = 4, .items = {kShare.info()}};
}

void InertiaTensor::read(const FieldValue& value, Mat3& inertia) {
  std::vector<double> i;
  Numbers{6}.read(value, i);
  inertia << i[0], i[3], i[4], i[3], i[1], i[5], i[4], i[5], i[2];
  if (!(inertia.diagonal().minCoeff() > 0.0) || !(inertia.determinant() > 0.0))
    value.fail(describe_node(value.node),
               "xx, yy, zz, xy, xz, yz of a positive definite tensor about the centre of mass");
}

YAML::Node InertiaTensor::write(const Mat3& i) {
  return Numbers{}.write({i(0, 0), i(1, 1), i(2, 2), i(0, 1), i(0, 2), i(1, 2)});
}

void NamePair::read(const FieldValue& value, std::array<std::string, 2>& pair) {
  if (!value.node.IsSequence() || value.node.size() != 2) value.fail(describe_node(value.node), allowed());
  for (std::size_t i = 0; i < 2; ++i) {
    const YAML::Node name = value.node[i];
    if (!name.IsScalar() || name.Scalar().empty()) value.part(name).fail(describe_node(name), allowed());
    pair[i] = name.Scalar();
  }
}

YAML::Node NamePair::write(const std::array<std::string, 2>& pair) {
  YAML::Node result(YAML::NodeType::Sequence);
  for (const std::string& name : pair) result.push_back(name);
  return result;
}

KeyInfo NamePair::info() {
  return {.kind = Kind::list, .min_items = 2, .max_items = 2, .items = {Text::info()}};
}

void NumberMap::read(const FieldValue& value, std::map<std::string, double>& numbers) {
  if (!value.node.IsMap()) value.fail(describe_node(value.node), "a mapping of keys to values");
  for (const auto& entry : value.node) {
    if (!entry.first.IsScalar()) value.fail(describe_node(entry.first), "a name");
    const std::string name = entry.first.Scalar();
    NumberRange{}.read({value.source, entry.second, value.path + "." + name}, numbers[name]);
  }
}

YAML::Node NumberMap::write(const std::map<std::string, double>& numbers) {
  YAML::Node result(YAML::NodeType::Map);
  for (const auto& [name, number] : numbers) result[name] = exact_number(number);
  return result;
}

KeyInfo NumberMap::info() {
  KeyInfo any = NumberRange{}.info();
  any.key = "*";
  return {.kind = Kind::section, .items = {any}};
}

}  // namespace takt

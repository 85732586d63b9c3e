#include "server/fmu/model_description.h"

#include <tinyxml2.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <map>
#include <sstream>

#include "idl/common/parse.h"
#include "idl/common/utf8.h"

namespace takt {
namespace {

using tinyxml2::XMLElement;

constexpr std::size_t kMostVariables = 500'000;
constexpr std::size_t kMostElements = 10'000;  // of an array that is used

constexpr std::array<std::string_view, 15> kTypes{"Float64", "Float32",     "Int8",   "UInt8",  "Int16",
                                                  "UInt16",  "Int32",       "UInt32", "Int64",  "UInt64",
                                                  "Boolean", "Enumeration", "String", "Binary", "Clock"};
/// Types of FMI 2.0.
const std::map<std::string_view, FmuType> kTypes2{{"Real", FmuType::float64},
                                                  {"Integer", FmuType::int32},
                                                  {"Boolean", FmuType::boolean},
                                                  {"String", FmuType::text},
                                                  {"Enumeration", FmuType::enumeration}};

std::string text_of(const XMLElement& element, const char* name) {
  const char* value = element.Attribute(name);
  return value != nullptr ? value : "";
}

/// Of a text that people read.
std::string shown(const XMLElement& element, const char* name) {
  return utf8_sanitize(text_of(element, name));
}

std::string at(const XMLElement& element) {
  return "modelDescription.xml, line " + std::to_string(element.GetLineNum()) + ": ";
}

bool flag_of(const XMLElement& element, const char* name) {
  const std::string text = text_of(element, name);
  return text == "true" || text == "1";
}

/// Numbers may stand between white space.
std::string_view trimmed(std::string_view text) {
  constexpr std::string_view kSpace = " \t\r\n";
  const std::size_t first = std::min(text.find_first_not_of(kSpace), text.size());
  return text.substr(first, text.find_last_not_of(kSpace) + 1 - first);
}

/// Infinity, NaN and numbers beyond those of the machine, in the spellings of XML Schema and of programming languages.
bool is_no_finite_number(std::string_view text) {
  const std::string word(text);
  char* end = nullptr;
  const double value = std::strtod(word.c_str(), &end);
  return end == word.c_str() + word.size() && !std::isfinite(value);
}

/// None: no attribute, or a number that limits nothing.
std::optional<double> number_of(const XMLElement& element, const char* name) {
  const std::string stated = text_of(element, name);
  const std::string_view text = trimmed(stated);
  if (text.empty() || is_no_finite_number(text)) return {};
  const auto value = finite_number(text);
  if (!value)
    throw FmuError(at(element) + "the attribute " + name + " is '" + stated.substr(0, 40) +
                   "'; allowed is a number");
  return value;
}

/// FMI demands UTF-8; what is not is taken for Latin 1, which some tools write.
std::string in_utf8(std::string_view text) {
  if (find_invalid_utf8(text) == text.size()) return std::string(text);
  std::string result;
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if (byte < 0x80U)
      result += c;
    else
      result += {static_cast<char>(0xc0U | (byte >> 6U)), static_cast<char>(0x80U | (byte & 0x3fU))};
  }
  return result;
}

std::uint32_t reference_of(const XMLElement& element, const char* name) {
  const auto value = finite_number(trimmed(text_of(element, name)));
  if (!value || *value < 0.0 || *value > 4294967295.0 || *value != std::floor(*value))
    throw FmuError(at(element) + "the attribute " + name + " is '" + text_of(element, name).substr(0, 40) +
                   "'; allowed is a whole number, 0 or more");
  return static_cast<std::uint32_t>(*value);
}

std::vector<std::string> words(const std::string& text) {
  std::istringstream in(text);
  std::vector<std::string> result;
  for (std::string word; in >> word;) {
    if (result.size() == kMostElements) break;
    result.push_back(word);
  }
  return result;
}

/// Units and limits that variables take from a type of the section TypeDefinitions.
struct DeclaredType {
  std::string unit;
  std::optional<double> lower, upper;
  std::shared_ptr<std::map<std::string, std::string>> items{};
};

class Reader {
 public:
  Reader(const XMLElement& root, const std::map<std::string, std::string>& structural)
      : root_(root), structural_(structural) {}

  FmuDescription read() {
    const std::string version = text_of(root_, "fmiVersion");
    if (version == "2.0" || version.starts_with("2.0."))
      d_.version = 2;
    else if (version == "3.0" || version.starts_with("3.0."))
      d_.version = 3;
    else
      throw FmuError("it follows FMI '" + version.substr(0, 40) + "'; takt takes FMI 2.0 and 3.0");
    d_.model_name = shown(root_, "modelName");
    d_.token = text_of(root_, d_.version == 2 ? "guid" : "instantiationToken");
    d_.generation_tool = shown(root_, "generationTool");
    d_.license = shown(root_, "license");
    read_interface();
    if (const XMLElement* experiment = root_.FirstChildElement("DefaultExperiment"); experiment != nullptr) {
      d_.default_step_s = std::max(0.0, number_of(*experiment, "stepSize").value_or(0.0));
      d_.tolerance = std::max(0.0, number_of(*experiment, "tolerance").value_or(0.0));
    }
    read_units();
    read_types();
    read_variables();
    return std::move(d_);
  }

 private:
  void read_interface() {
    const XMLElement* slave = root_.FirstChildElement("CoSimulation");
    if (slave == nullptr) {
      const char* has = root_.FirstChildElement("ModelExchange") != nullptr        ? "model exchange"
                        : root_.FirstChildElement("ScheduledExecution") != nullptr ? "scheduled execution"
                                                                                   : "no interface";
      throw FmuError(
          std::string("it has ") + has +
          " and no co-simulation; takt takes co-simulation alone. Most tools can export the model so");
    }
    d_.identifier = text_of(*slave, "modelIdentifier");
    // It is the name of a file. FMI allows the letters of a C identifier; more are in use.
    if (d_.identifier.empty() || d_.identifier.size() > 200 || d_.identifier.starts_with('.') ||
        std::any_of(d_.identifier.begin(), d_.identifier.end(),
                    [](char c) { return c == '/' || c == '\\' || static_cast<unsigned char>(c) < 0x20; }))
      throw FmuError(at(*slave) + "the attribute modelIdentifier is '" +
                     shown(*slave, "modelIdentifier").substr(0, 40) + "'; allowed is the name of a file");
    d_.needs_tool = flag_of(*slave, "needsExecutionTool");
    d_.has_event_mode = flag_of(*slave, "hasEventMode");
    d_.variable_step = flag_of(*slave, "canHandleVariableCommunicationStepSize");
    const bool two = d_.version == 2;
    d_.can_copy_state = flag_of(*slave, two ? "canGetAndSetFMUstate" : "canGetAndSetFMUState");
    d_.can_serialise_state =
        d_.can_copy_state && flag_of(*slave, two ? "canSerializeFMUstate" : "canSerializeFMUState");
    d_.fixed_step_s = two ? 0.0 : std::max(0.0, number_of(*slave, "fixedInternalStepSize").value_or(0.0));
  }

  void read_units() {
    const XMLElement* all = root_.FirstChildElement("UnitDefinitions");
    if (all == nullptr) return;
    for (const XMLElement* stated = all->FirstChildElement("Unit"); stated != nullptr;
         stated = stated->NextSiblingElement("Unit")) {
      const XMLElement* base = stated->FirstChildElement("BaseUnit");
      if (base == nullptr) continue;
      FmuUnit unit;
      for (std::size_t i = 0; i < kFmuBaseUnits.size(); ++i)
        unit.exponents[i] =
            static_cast<int>(std::clamp(number_of(*base, kFmuBaseUnits[i]).value_or(0.0), -100.0, 100.0));
      unit.factor = number_of(*base, "factor").value_or(1.0);
      unit.offset = number_of(*base, "offset").value_or(0.0);
      if (unit.factor != 0.0) d_.units[shown(*stated, "name")] = unit;
    }
  }

  void read_types() {
    const XMLElement* all = root_.FirstChildElement("TypeDefinitions");
    if (all == nullptr) return;
    for (const XMLElement* type = all->FirstChildElement(); type != nullptr;
         type = type->NextSiblingElement()) {
      const XMLElement* of = d_.version == 2 ? type->FirstChildElement() : type;
      if (of == nullptr) continue;
      DeclaredType& declared = types_[text_of(*type, "name")];
      declared = {shown(*of, "unit"), number_of(*of, "min"), number_of(*of, "max"), {}};
      // Of an enumeration: the values of its items.
      for (const XMLElement* item = of->FirstChildElement("Item"); item != nullptr;
           item = item->NextSiblingElement("Item")) {
        const double value = number_of(*item, "value").value_or(0.0);
        declared.lower = std::min(declared.lower.value_or(value), value);
        declared.upper = std::max(declared.upper.value_or(value), value);
        if (!declared.items) declared.items = std::make_shared<std::map<std::string, std::string>>();
        declared.items->emplace(text_of(*item, "name"), trimmed(text_of(*item, "value")));
      }
    }
  }

  void read_variables() {
    const XMLElement* all = root_.FirstChildElement("ModelVariables");
    if (all == nullptr) throw FmuError("its modelDescription.xml has no section ModelVariables");
    for (const XMLElement* e = all->FirstChildElement(); e != nullptr; e = e->NextSiblingElement()) {
      if (d_.variables.size() == kMostVariables)
        throw FmuError("it has more than " + std::to_string(kMostVariables) +
                       " variables; takt takes no more");
      read_variable(*e);
    }
    if (d_.version == 3) count_elements();
  }

  void read_variable(const XMLElement& e) {
    FmuVariable v;
    v.name = text_of(e, "name");
    if (v.name.empty()) throw FmuError(at(e) + "a variable has no name");
    v.reference = reference_of(e, "valueReference");
    const XMLElement* typed = &e;
    if (d_.version == 2) {
      for (typed = e.FirstChildElement(); typed != nullptr; typed = typed->NextSiblingElement())
        if (kTypes2.contains(typed->Name())) break;
      if (typed == nullptr) throw FmuError(at(e) + "the variable '" + v.name + "' has no type of FMI 2.0");
      v.type = kTypes2.at(typed->Name());
    } else {
      const auto found = std::find(kTypes.begin(), kTypes.end(), e.Name());
      if (found == kTypes.end())
        throw FmuError(at(e) + "the variable '" + v.name + "' has the type '" + e.Name() +
                       "', which FMI 3.0 does not know");
      v.type = static_cast<FmuType>(found - kTypes.begin());
    }
    if (const std::string causality = text_of(e, "causality"); !causality.empty()) v.causality = causality;
    v.variability = text_of(e, "variability");
    v.initial = text_of(e, "initial");
    v.unit = shown(*typed, "unit");
    v.lower = number_of(*typed, "min"), v.upper = number_of(*typed, "max");
    if (const auto declared = types_.find(text_of(*typed, "declaredType")); declared != types_.end()) {
      if (v.unit.empty()) v.unit = declared->second.unit;
      if (!v.lower) v.lower = declared->second.lower;
      if (!v.upper) v.upper = declared->second.upper;
      v.items = declared->second.items;
    }
    v.start = start_of(*typed, v.type);
    if (const auto chosen = structural_.find(v.name);
        chosen != structural_.end() && v.causality == "structuralParameter")
      v.start = {chosen->second};
    v.is_array = e.FirstChildElement("Dimension") != nullptr && d_.version == 3;
    if (v.type == FmuType::clock) read_clock(e, v);
    for (const std::string& clock : words(text_of(e, "clocks")))
      if (const auto reference = finite_number(clock);
          reference && *reference >= 0.0 && *reference < 4294967296.0)
        v.clocks.push_back(static_cast<std::uint32_t>(*reference));
    if (v.is_array) arrays_.emplace_back(d_.variables.size(), &e);
    add_name(e, v.name);
    if (d_.version == 3)
      for (const XMLElement* alias = e.FirstChildElement("Alias"); alias != nullptr;
           alias = alias->NextSiblingElement("Alias"))
        add_name(*alias, text_of(*alias, "name"));
    by_reference_.emplace(v.reference, d_.variables.size());
    d_.variables.push_back(std::move(v));
  }

  /// Its interval stands in the clock or its type, in seconds or as a count of a resolution; clocks that the FMU or others
  /// trigger have none.
  void read_clock(const XMLElement& e, FmuVariable& v) {
    d_.uses_event_mode = d_.has_event_mode;
    const XMLElement* type = root_.FirstChildElement("TypeDefinitions");
    type = type == nullptr ? nullptr : type->FirstChildElement("ClockType");
    while (type != nullptr && text_of(*type, "name") != text_of(e, "declaredType"))
      type = type->NextSiblingElement("ClockType");
    const auto stated = [&](const char* name) {
      const auto own = number_of(e, name);
      return own || type == nullptr ? own : number_of(*type, name);
    };
    const auto seconds = [&](const char* decimal, const char* counter) {
      const double resolution = stated("resolution").value_or(0.0);
      return stated(decimal).value_or(resolution > 0.0 ? stated(counter).value_or(0.0) / resolution : 0.0);
    };
    std::string kind = text_of(e, "intervalVariability");
    if (kind.empty() && type != nullptr) kind = text_of(*type, "intervalVariability");
    v.is_triggered_clock = kind == "triggered" && d_.uses_event_mode;
    if (v.causality != "input" || v.is_triggered_clock) return;
    const double interval_s = seconds("intervalDecimal", "intervalCounter");
    if (interval_s <= 0.0)
      d_.silent_clocks.push_back(v.name);
    else
      d_.clocks.push_back({v.name, v.reference, interval_s, seconds("shiftDecimal", "shiftCounter")});
  }

  /// Texts of FMI 3.0 stand in elements of their own.
  std::vector<std::string> start_of(const XMLElement& typed, FmuType type) const {
    std::vector<std::string> result;
    if (d_.version == 3 && type == FmuType::text) {
      for (const XMLElement* one = typed.FirstChildElement("Start");
           one != nullptr && result.size() < kMostElements; one = one->NextSiblingElement("Start"))
        result.push_back(text_of(*one, "value"));
    } else if (const char* start = typed.Attribute("start"); start != nullptr) {
      if (d_.version == 3)
        result = words(start);
      else
        result.emplace_back(type == FmuType::text ? std::string_view(start) : trimmed(start));
    }
    return result;
  }

  /// Of the variable that is read.
  void add_name(const XMLElement& e, const std::string& name) {
    if (!d_.by_name.emplace(name, d_.variables.size()).second)
      throw FmuError(at(e) + "two variables have the name '" + name + "'");
  }

  /// Dimensions are numbers, or variables with a start value. An array without a size, or with too many elements, is
  /// refused where it is used.
  void count_elements() {
    for (const auto& [index, e] : arrays_) {
      FmuVariable& v = d_.variables[index];
      for (const XMLElement* dimension = e->FirstChildElement("Dimension");
           dimension != nullptr && v.unusable.empty();
           dimension = dimension->NextSiblingElement("Dimension")) {
        std::string size = text_of(*dimension, "start");
        if (size.empty()) {
          const auto of = by_reference_.find(reference_of(*dimension, "valueReference"));
          if (of != by_reference_.end() && !d_.variables[of->second].start.empty())
            size = d_.variables[of->second].start.front();
        }
        const auto number = finite_number(trimmed(size));
        const double elements = static_cast<double>(v.elements) * number.value_or(0.0);
        if (!number || *number < 0.0 || *number != std::floor(*number))
          v.unusable = at(*dimension) + "a dimension of '" + v.name + "' has no size";
        else if (elements > static_cast<double>(kMostElements))
          v.unusable = at(*dimension) + "the array '" + v.name + "' has more than " +
                       std::to_string(kMostElements) + " elements; takt takes no more";
        else
          v.elements = static_cast<std::size_t>(elements);
      }
      if (!v.unusable.empty()) v.elements = 0;
    }
  }

  const XMLElement& root_;
  const std::map<std::string, std::string>& structural_;
  FmuDescription d_;
  std::map<std::string, DeclaredType> types_;
  std::vector<std::pair<std::size_t, const XMLElement*>> arrays_;
  std::unordered_map<std::uint32_t, std::size_t> by_reference_;
};

}  // namespace

std::string signal_name(const std::string& variable) {
  std::string name;
  for (const char c : variable) {
    const bool usual = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9');
    if (usual)
      name += c;
    else if (!name.empty() && name.back() != '_')
      name += '_';
  }
  while (name.ends_with('_')) name.pop_back();
  if (name.empty() || (name.front() >= '0' && name.front() <= '9')) name = "v" + name;
  return name;
}

std::string_view name_of(FmuType type) {
  return kTypes[static_cast<std::size_t>(type)];
}

FmuDescription::Element FmuDescription::find(const std::string& name) const {
  if (const auto found = by_name.find(name); found != by_name.end()) {
    const FmuVariable& v = variables[found->second];
    if (!v.unusable.empty()) throw FmuError(v.unusable);
    if (v.is_array)
      throw FmuError("'" + name + "' is an array with " + std::to_string(v.elements) +
                     " elements; a signal is one of them, e.g. " + name + "[1]");
    return {&v, 0};
  }
  const std::size_t bracket = name.rfind('[');
  if (bracket != std::string::npos && name.ends_with(']')) {
    const auto of = by_name.find(name.substr(0, bracket));
    const auto number = finite_number(name.substr(bracket + 1, name.size() - bracket - 2));
    if (of != by_name.end() && variables[of->second].is_array && number) {
      const FmuVariable& v = variables[of->second];
      if (!v.unusable.empty()) throw FmuError(v.unusable);
      if (!(*number >= 1.0 && *number <= static_cast<double>(v.elements)) || *number != std::floor(*number))
        throw FmuError("'" + name + "' is no element of the array, which has " + std::to_string(v.elements));
      return {&v, static_cast<std::size_t>(*number) - 1};
    }
  }
  std::string few;
  for (std::size_t i = 0; i < std::min<std::size_t>(variables.size(), 8); ++i)
    few += (i == 0 ? "" : ", ") + variables[i].name;
  throw FmuError("it has no variable '" + name.substr(0, 200) + "'; it has " + few +
                 (variables.size() > 8 ? " and " + std::to_string(variables.size() - 8) + " more" : ""));
}

FmuDescription read_model_description(std::string_view stated,
                                      const std::map<std::string, std::string>& structural) {
  const std::string xml = in_utf8(stated);
  tinyxml2::XMLDocument document;
  if (document.Parse(xml.data(), xml.size()) != tinyxml2::XML_SUCCESS)
    throw FmuError("its modelDescription.xml is no XML in UTF-8, line " +
                   std::to_string(document.ErrorLineNum()));
  const XMLElement* root = document.FirstChildElement("fmiModelDescription");
  if (root == nullptr) throw FmuError("its modelDescription.xml has no element fmiModelDescription");
  return Reader(*root, structural).read();
}

}  // namespace takt

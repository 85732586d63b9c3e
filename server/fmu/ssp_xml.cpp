#include "server/fmu/ssp_xml.h"

#include <tinyxml2.h>

#include <algorithm>
#include <set>

#include "idl/common/bounded_file.h"
#include "idl/common/parse.h"
#include "idl/common/text.h"
#include "server/fmu/fmu_archive.h"
#include "server/fmu/model_description.h"

namespace takt::ssp {

SspXml::SspXml(const std::filesystem::path& directory, const std::string& name)
    : name_(name), document_(std::make_unique<tinyxml2::XMLDocument>()) {
  const FileText text = read_bounded_file(directory / name, kLargestDescription_bytes >> 20U);
  if (!text.problem.empty()) throw FmuError("its " + name + ": " + text.problem);
  if (document_->Parse(text.text.data(), text.text.size()) != tinyxml2::XML_SUCCESS)
    throw FmuError("its " + name + ", line " + std::to_string(document_->ErrorLineNum()) + ", is no XML");
}

SspXml::~SspXml() = default;

const XMLElement& SspXml::root(std::string_view expected) const {
  const XMLElement* root = document_->RootElement();
  if (root == nullptr || local_name(*root) != expected)
    throw FmuError("its " + name_ + ": found the element '" +
                   std::string(root != nullptr ? local_name(*root) : "") +
                   "'; allowed: " + std::string(expected));
  return *root;
}

void SspXml::fail(const XMLElement& at, const std::string& found, const std::string& allowed) const {
  throw FmuError(place(at) + ": found " + found + "; allowed: " + allowed);
}

std::string SspXml::place(const XMLElement& at) const {
  return name_ + ", line " + std::to_string(at.GetLineNum()) + ", " + std::string(local_name(at));
}

std::string_view SspXml::local_name(const XMLElement& element) {
  const std::string_view name = element.Name();
  const auto colon = name.find(':');
  return colon == std::string_view::npos ? name : name.substr(colon + 1);
}

std::string SspXml::text(const XMLElement& element, const char* attribute) {
  const char* value = element.Attribute(attribute);
  return value != nullptr ? value : "";
}

std::string SspXml::required(const XMLElement& element, const char* attribute) const {
  std::string value = text(element, attribute);
  if (value.empty()) fail(element, std::string("no attribute ") + attribute, "a text");
  return value;
}

double SspXml::number(const XMLElement& element, const char* attribute, double usual) const {
  const std::string stated = text(element, attribute);
  if (stated.empty()) return usual;
  const auto value = finite_number(stated);
  if (!value) fail(element, std::string(attribute) + "='" + stated.substr(0, 40) + "'", "a finite number");
  return *value;
}

bool SspXml::flag(const XMLElement& element, const char* attribute) const {
  const std::string stated = text(element, attribute);
  if (stated.empty() || stated == "false" || stated == "0") return false;
  if (stated != "true" && stated != "1")
    fail(element, std::string(attribute) + "='" + stated.substr(0, 40) + "'", "true or false");
  return true;
}

void SspXml::children(const XMLElement& element, const std::vector<std::string_view>& names,
                      const std::function<void(const XMLElement&, std::string_view)>& visit) const {
  static const std::set<std::string_view> silent{
      "Annotations",       "ElementGeometry",   "ConnectorGeometry", "SystemGeometry", "ConnectionGeometry",
      "GraphicalElements", "DefaultExperiment", "Enumerations",      "MetaData",       "Signature"};
  for (const XMLElement* child = element.FirstChildElement(); child != nullptr;
       child = child->NextSiblingElement()) {
    const std::string_view name = local_name(*child);
    if (std::find(names.begin(), names.end(), name) != names.end())
      visit(*child, name);
    else if (!silent.contains(name))
      fail(*child, "the element '" + std::string(name) + "' in " + std::string(local_name(element)),
           names.empty() ? "no elements with a meaning" : join(names, ", "));
  }
}

std::string unit_name(const std::string& stated) {
  return stated.size() > 2 && stated.front() == '[' && stated.back() == ']'
             ? stated.substr(1, stated.size() - 2)
             : stated;
}

std::map<std::string, FmuUnit> read_units(const SspXml& file, const XMLElement& units) {
  std::map<std::string, FmuUnit> result;
  file.children(units, {"Unit"}, [&](const XMLElement& element, std::string_view) {
    FmuUnit unit;
    file.children(element, {"BaseUnit"}, [&](const XMLElement& base, std::string_view) {
      for (std::size_t i = 0; i < kFmuBaseUnits.size(); ++i) {
        const double exponent = file.number(base, kFmuBaseUnits[i], 0.0);
        if (exponent != static_cast<int>(std::clamp(exponent, -100.0, 100.0)))
          file.fail(base, std::string(kFmuBaseUnits[i]) + "='" + SspXml::text(base, kFmuBaseUnits[i]) + "'",
                    "a whole number from -100 to 100");
        unit.exponents[i] = static_cast<int>(exponent);
      }
      unit.factor = file.number(base, "factor", 1.0);
      unit.offset = file.number(base, "offset", 0.0);
      if (unit.factor == 0.0) file.fail(base, "factor='0'", "another number");
    });
    result[unit_name(file.required(element, "name"))] = unit;
  });
  return result;
}

void read_parameter_set(const SspXml& file, const XMLElement& set, const std::string& prefix,
                        Values& values) {
  std::map<std::string, FmuUnit> units;
  const std::vector<std::string_view> parts{"Parameters", "Units"};
  file.children(set, parts, [&](const XMLElement& part, std::string_view kind) {
    if (kind == "Units") units = read_units(file, part);
  });
  file.children(set, parts, [&](const XMLElement& parameters, std::string_view part) {
    if (part == "Units") return;
    file.children(parameters, {"Parameter"}, [&](const XMLElement& parameter, std::string_view) {
      const std::string name = file.required(parameter, "name");
      file.children(parameter,
                    {"Real", "Integer", "Boolean", "String", "Enumeration", "Float64", "Float32", "Int8",
                     "UInt8", "Int16", "UInt16", "Int32", "UInt32", "Int64", "UInt64"},
                    [&](const XMLElement& value, std::string_view) {
                      FmuRequest::Value& read = values[prefix + name];
                      read = {SspXml::text(value, "value"), unit_name(SspXml::text(value, "unit")), {}};
                      if (const auto unit = units.find(read.unit); unit != units.end())
                        read.defined = unit->second;
                    });
    });
  });
}

void transform(const SspXml& file, const XMLElement& element, FmuRequest::Value& value) {
  file.children(element, {"LinearTransformation"}, [&](const XMLElement& linear, std::string_view) {
    const auto number = finite_number(value.text);
    if (!number) file.fail(linear, "a transformation of '" + value.text.substr(0, 40) + "'", "numbers");
    value.text =
        exact_text(file.number(linear, "factor", 1.0) * *number + file.number(linear, "offset", 0.0));
    value.unit.clear();
  });
}

Values mapped(const SspXml& file, const XMLElement& mapping, const Values& values) {
  Values result;
  file.children(mapping, {"MappingEntry"}, [&](const XMLElement& entry, std::string_view) {
    if (entry.Attribute("source", "") != nullptr) return;  // tools write it for variables without a value
    const std::string source = file.required(entry, "source");
    const auto found = values.find(source);
    if (found == values.end()) {
      std::vector<std::string> known;
      for (const auto& [name, value] : values) known.push_back(name);
      file.fail(entry, "the source '" + source.substr(0, 200) + "'",
                known.empty() ? "none, there are no values" : join(known, ", ").substr(0, 1000));
    }
    FmuRequest::Value value = found->second;
    if (file.flag(entry, "suppressUnitConversion")) value.unit.clear();
    transform(file, entry, value);
    result[file.required(entry, "target")] = value;
  });
  return result;
}

}  // namespace takt::ssp

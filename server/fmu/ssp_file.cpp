#include "server/fmu/ssp_file.h"

#include <tinyxml2.h>

#include <algorithm>
#include <array>
#include <set>

#include "idl/common/bounded_file.h"
#include "idl/common/parse.h"
#include "idl/common/text.h"
#include "server/fmu/fmu_archive.h"
#include "server/fmu/model_description.h"

namespace takt {
namespace {

using tinyxml2::XMLElement;

constexpr std::size_t kMostElements = 1000, kMostConnections = 10'000;

/// An XML file of the SSP, and errors with its name and lines.
class XmlFile {
 public:
  XmlFile(const std::filesystem::path& directory, const std::string& name) : name_(name) {
    const FileText text = read_bounded_file(directory / name, kLargestDescription_bytes >> 20U);
    if (!text.problem.empty()) throw FmuError("its " + name + ": " + text.problem);
    if (document_.Parse(text.text.data(), text.text.size()) != tinyxml2::XML_SUCCESS)
      throw FmuError("its " + name + ", line " + std::to_string(document_.ErrorLineNum()) + ", is no XML");
  }
  const XMLElement& root(std::string_view expected) const {
    const XMLElement* root = document_.RootElement();
    if (root == nullptr || local_name(*root) != expected)
      throw FmuError("its " + name_ + ": found the element '" +
                     std::string(root != nullptr ? local_name(*root) : "") +
                     "'; allowed: " + std::string(expected));
    return *root;
  }
  const std::string& name() const { return name_; }

  [[noreturn]] void fail(const XMLElement& at, const std::string& found, const std::string& allowed) const {
    throw FmuError(place(at) + ": found " + found + "; allowed: " + allowed);
  }
  std::string place(const XMLElement& at) const {
    return name_ + ", line " + std::to_string(at.GetLineNum()) + ", " + std::string(local_name(at));
  }
  /// Without its prefix.
  static std::string_view local_name(const XMLElement& element) {
    const std::string_view name = element.Name();
    const auto colon = name.find(':');
    return colon == std::string_view::npos ? name : name.substr(colon + 1);
  }
  static std::string text(const XMLElement& element, const char* attribute) {
    const char* value = element.Attribute(attribute);
    return value != nullptr ? value : "";
  }
  std::string required(const XMLElement& element, const char* attribute) const {
    std::string value = text(element, attribute);
    if (value.empty()) fail(element, std::string("no attribute ") + attribute, "a text");
    return value;
  }
  double number(const XMLElement& element, const char* attribute, double usual) const {
    const std::string stated = text(element, attribute);
    if (stated.empty()) return usual;
    const auto value = finite_number(stated);
    if (!value) fail(element, std::string(attribute) + "='" + stated.substr(0, 40) + "'", "a finite number");
    return *value;
  }
  bool flag(const XMLElement& element, const char* attribute) const {
    const std::string stated = text(element, attribute);
    if (stated.empty() || stated == "false" || stated == "0") return false;
    if (stated != "true" && stated != "1")
      fail(element, std::string(attribute) + "='" + stated.substr(0, 40) + "'", "true or false");
    return true;
  }
  /// Calls visit(child, local name) for the children with these names; passes over pictures and annotations; refuses others.
  template <class Visit>
  void children(const XMLElement& element, const std::vector<std::string_view>& names,
                const Visit& visit) const {
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

 private:
  std::string name_;
  tinyxml2::XMLDocument document_;
};

std::map<std::string, FmuSystem::Unit> read_units(const XmlFile& file, const XMLElement& units) {
  std::map<std::string, FmuSystem::Unit> result;
  file.children(units, {"Unit"}, [&](const XMLElement& element, std::string_view) {
    FmuSystem::Unit unit;
    file.children(element, {"BaseUnit"}, [&](const XMLElement& base, std::string_view) {
      constexpr std::array<const char*, 8> kBases{"kg", "m", "s", "A", "K", "mol", "cd", "rad"};
      for (std::size_t i = 0; i < kBases.size(); ++i) {
        const double exponent = file.number(base, kBases[i], 0.0);
        if (exponent != static_cast<int>(std::clamp(exponent, -100.0, 100.0)))
          file.fail(base, std::string(kBases[i]) + "='" + XmlFile::text(base, kBases[i]) + "'",
                    "a whole number from -100 to 100");
        unit.exponents[i] = static_cast<int>(exponent);
      }
      unit.factor = file.number(base, "factor", 1.0);
      unit.offset = file.number(base, "offset", 0.0);
      if (unit.factor == 0.0) file.fail(base, "factor='0'", "another number");
    });
    result[file.required(element, "name")] = unit;
  });
  return result;
}

/// Values by name.
using Values = std::map<std::string, FmuRequest::Value>;

void read_parameter_set(const XmlFile& file, const XMLElement& set, const std::string& prefix,
                        Values& values) {
  file.children(set, {"Parameters", "Units"}, [&](const XMLElement& parameters, std::string_view part) {
    if (part == "Units") return;
    file.children(parameters, {"Parameter"}, [&](const XMLElement& parameter, std::string_view) {
      const std::string name = file.required(parameter, "name");
      file.children(parameter,
                    {"Real", "Integer", "Boolean", "String", "Float64", "Float32", "Int8", "UInt8", "Int16",
                     "UInt16", "Int32", "UInt32", "Int64", "UInt64"},
                    [&](const XMLElement& value, std::string_view) {
                      values[prefix + name] = {XmlFile::text(value, "value"), XmlFile::text(value, "unit")};
                    });
    });
  });
}

class SystemReader {
 public:
  explicit SystemReader(const std::filesystem::path& directory)
      : directory_(directory), file_(directory, "SystemStructure.ssd") {}

  FmuSystem read() {
    const XMLElement& root = file_.root("SystemStructureDescription");
    if (const std::string version = XmlFile::text(root, "version"); version != "1.0" && version != "2.0")
      file_.fail(root, "version='" + version.substr(0, 40) + "'", "1.0 or 2.0");
    const XMLElement* system = nullptr;
    file_.children(root, {"System", "Units"}, [&](const XMLElement& part, std::string_view name) {
      if (name == "Units")
        system_.units = read_units(file_, part);
      else
        system = &part;
    });
    if (system == nullptr) file_.fail(root, "no System", "a System");
    // Elements first: connections name them.
    const std::vector<std::string_view> parts{"Connectors", "Elements", "Connections", "ParameterBindings"};
    const auto each = [&](std::string_view wanted, const auto& read_it) {
      file_.children(*system, parts, [&](const XMLElement& part, std::string_view name) {
        if (name == wanted) read_it(part);
      });
    };
    each("Connectors", [&](const XMLElement& part) { read_ports(part); });
    each("Elements", [&](const XMLElement& part) { read_elements(part); });
    each("ParameterBindings", [&](const XMLElement& part) { bind_all(read_bindings(part)); });
    each("Connections", [&](const XMLElement& part) { read_connections(part); });
    if (system_.elements.empty()) file_.fail(*system, "no Component", "at least one");
    return std::move(system_);
  }

 private:
  struct Connector {
    std::string kind, unit;
    SignalType type = SignalType::real;
    bool is_number = true;
  };
  using Connectors = std::map<std::string, Connector>;

  Connectors read_connectors(const XMLElement& element) const {
    Connectors result;
    file_.children(element, {"Connector"}, [&](const XMLElement& stated, std::string_view) {
      Connector connector;
      connector.kind = file_.required(stated, "kind");
      file_.children(stated,
                     {"Real", "Integer", "Boolean", "String", "Enumeration", "Binary", "Float64", "Float32",
                      "Int8", "UInt8", "Int16", "UInt16", "Int32", "UInt32", "Int64", "UInt64"},
                     [&](const XMLElement& type, std::string_view name) {
                       connector.unit = XmlFile::text(type, "unit");
                       connector.is_number = name != "String" && name != "Binary";
                       connector.type = name == "Boolean" ? SignalType::boolean
                                        : name == "Real" || name == "Float64" || name == "Float32"
                                            ? SignalType::real
                                            : SignalType::integer;
                     });
      if (!result.emplace(file_.required(stated, "name"), connector).second)
        file_.fail(stated, "'" + XmlFile::text(stated, "name") + "' twice", "unique names of connectors");
    });
    return result;
  }

  void read_ports(const XMLElement& element) {
    connectors_ = read_connectors(element);
    for (const auto& [name, connector] : connectors_) {
      if (!connector.is_number || (connector.kind != "input" && connector.kind != "output")) continue;
      const std::string signal = signal_name(name);
      if (std::any_of(system_.ports.begin(), system_.ports.end(),
                      [&](const auto& p) { return p.name == signal; }))
        file_.fail(element, "two connectors with the signal '" + signal + "'",
                   "names that differ in letters and digits");
      system_.ports.push_back({signal, connector.unit, connector.type, connector.kind == "input"});
    }
  }

  void read_elements(const XMLElement& elements) {
    file_.children(elements, {"Component"}, [&](const XMLElement& component, std::string_view) {
      if (system_.elements.size() == kMostElements)
        file_.fail(component, "more than " + std::to_string(kMostElements) + " components", "fewer");
      FmuSystem::Element element;
      const std::string name = file_.required(component, "name");
      element.name = signal_name(name);
      for (const FmuSystem::Element& other : system_.elements)
        if (other.name == element.name)
          file_.fail(component, "two components with the name '" + element.name + "'",
                     "names that differ in letters and digits");
      names_.push_back(name);
      const std::string type = XmlFile::text(component, "type");
      if (!type.empty() && type != "application/x-fmu-sharedlibrary")
        file_.fail(component, "'" + name + "' of the type '" + type.substr(0, 100) + "'",
                   "application/x-fmu-sharedlibrary, which are FMUs; a flat system has no systems in it");
      const std::string implementation = XmlFile::text(component, "implementation");
      if (!implementation.empty() && implementation != "any" && implementation != "CoSimulation")
        file_.fail(component, "implementation='" + implementation.substr(0, 40) + "'", "any or CoSimulation");
      element.file = directory_ / inside(component, file_.required(component, "source"), ".fmu");
      Connectors connectors;
      file_.children(component, {"Connectors", "ParameterBindings"},
                     [&](const XMLElement& part, std::string_view what) {
                       if (what == "Connectors")
                         connectors = read_connectors(part);
                       else
                         element.values = read_bindings(part);
                     });
      for (const auto& [variable, connector] : connectors) {
        if (!connector.is_number) continue;
        const std::string signal = signal_name(variable);
        if (connector.kind == "input") element.inputs.emplace_back(signal, variable);
        if (gives(connector.kind)) element.outputs.emplace_back(signal, variable);
        if (!connector.unit.empty()) element.units[signal] = connector.unit;
      }
      by_element_.push_back(std::move(connectors));
      system_.elements.push_back(std::move(element));
    });
  }

  static bool gives(const std::string& kind) {
    return kind == "output" || kind == "local" || kind == "calculatedParameter";
  }

  /// The way of a source within the archive.
  std::string inside(const XMLElement& at, const std::string& source, const char* ending) const {
    const std::filesystem::path way(source);
    const bool leads_out = way.is_absolute() || source.find(':') != std::string::npos ||
                           std::find(way.begin(), way.end(), "..") != way.end();
    if (leads_out || !source.ends_with(ending) || !std::filesystem::exists(directory_ / way))
      file_.fail(at, "the source '" + source.substr(0, 200) + "'",
                 std::string("a file NAME") + ending + " that is in the SSP, e.g. resources/NAME" + ending);
    return source;
  }

  Values read_bindings(const XMLElement& bindings) const {
    Values values;
    file_.children(bindings, {"ParameterBinding"}, [&](const XMLElement& binding, std::string_view) {
      const std::string type = XmlFile::text(binding, "type");
      if (!type.empty() && type != "application/x-ssp-parameter-set")
        file_.fail(binding, "type='" + type.substr(0, 100) + "'", "application/x-ssp-parameter-set");
      if (XmlFile::text(binding, "sourceBase") == "component")
        file_.fail(binding, "sourceBase='component'", "SSD, i.e. a file of the SSP");
      const std::string prefix = XmlFile::text(binding, "prefix");
      file_.children(binding, {"ParameterValues"}, [&](const XMLElement& inline_values, std::string_view) {
        file_.children(inline_values, {"ParameterSet"}, [&](const XMLElement& set, std::string_view) {
          read_parameter_set(file_, set, prefix, values);
        });
      });
      if (const std::string source = XmlFile::text(binding, "source"); !source.empty()) {
        const XmlFile other(directory_, inside(binding, source, ".ssv"));
        read_parameter_set(other, other.root("ParameterSet"), prefix, values);
      }
    });
    return values;
  }

  /// Values of the system: NAME of a connector, or ELEMENT.NAME. They win over those of the elements.
  void bind_all(const Values& values) {
    for (const auto& [name, value] : values) {
      for (FmuSystem::Port& port : system_.ports)
        if (port.name == signal_name(name) && connectors_.contains(name)) port.start = value_of(value);
      for (std::size_t e = 0; e < names_.size(); ++e)
        if (name.starts_with(names_[e] + "."))
          system_.elements[e].values[name.substr(names_[e].size() + 1)] = value;
    }
  }
  double value_of(const FmuRequest::Value& value) const {
    if (value.text == "true") return 1.0;
    if (value.text == "false") return 0.0;
    const auto number = finite_number(value.text);
    if (!number)
      throw FmuError(file_.name() + ": found the value '" + value.text.substr(0, 40) +
                     "' of a connector; allowed: a number");
    return *number;
  }

  FmuSystem::End end_of(const XMLElement& connection, const char* element_key, const char* connector_key,
                        bool& gives_values, bool& takes_values) const {
    FmuSystem::End end;
    const std::string element = XmlFile::text(connection, element_key);
    const std::string name = file_.required(connection, connector_key);
    const Connectors* connectors = &connectors_;
    if (connection.Attribute(element_key) != nullptr) {
      const auto found = std::find(names_.begin(), names_.end(), element);
      if (found == names_.end())
        file_.fail(connection, "the element '" + element + "'", names_.empty() ? "none" : join(names_, ", "));
      end.element = static_cast<int>(found - names_.begin());
      connectors = &by_element_[static_cast<std::size_t>(end.element)];
    }
    const auto found = connectors->find(name);
    if (found == connectors->end()) {
      std::vector<std::string> known;
      for (const auto& [one, connector] : *connectors) known.push_back(one);
      file_.fail(connection, "the connector '" + name + "'" + (element.empty() ? "" : " of " + element),
                 known.empty() ? "none" : join(known, ", "));
    }
    const Connector& connector = found->second;
    const bool of_system = end.element < 0;
    gives_values = of_system ? connector.kind == "input" : gives(connector.kind);
    takes_values = of_system ? connector.kind == "output" : connector.kind == "input";
    if (!connector.is_number || (!gives_values && !takes_values))
      file_.fail(connection,
                 "the connector '" + name + "' of the kind " + connector.kind +
                     (connector.is_number ? "" : ", a text"),
                 "inputs and outputs that are numbers or booleans; parameters stand in ParameterBindings");
    end.signal = signal_name(name);
    return end;
  }

  void read_connections(const XMLElement& connections) {
    file_.children(connections, {"Connection"}, [&](const XMLElement& stated, std::string_view) {
      if (system_.connections.size() == kMostConnections)
        file_.fail(stated, "more than " + std::to_string(kMostConnections) + " connections", "fewer");
      for (const char* indices : {"startIndices", "endIndices"})
        if (stated.Attribute(indices) != nullptr)
          file_.fail(stated, indices, "connections of whole connectors, which are no arrays");
      FmuSystem::Connection connection;
      bool start_gives = false, start_takes = false, end_gives = false, end_takes = false;
      connection.from = end_of(stated, "startElement", "startConnector", start_gives, start_takes);
      connection.to = end_of(stated, "endElement", "endConnector", end_gives, end_takes);
      if (start_takes && end_gives) {
        std::swap(connection.from, connection.to);
      } else if (!start_gives || !end_takes) {
        file_.fail(stated, start_gives ? "two sources" : "two targets",
                   "one connector that gives a value and one that takes it");
      }
      connection.converts_units = !file_.flag(stated, "suppressUnitConversion");
      file_.children(stated, {"LinearTransformation"}, [&](const XMLElement& linear, std::string_view) {
        connection.factor = file_.number(linear, "factor", 1.0);
        connection.offset = file_.number(linear, "offset", 0.0);
      });
      connection.place = file_.place(stated);
      system_.connections.push_back(std::move(connection));
    });
  }

  const std::filesystem::path& directory_;
  XmlFile file_;
  FmuSystem system_;
  Connectors connectors_;           ///< of the system
  std::vector<std::string> names_;  ///< of elements, as in the file
  std::vector<Connectors> by_element_;
};

}  // namespace

FmuSystem read_ssp(const std::filesystem::path& directory) {
  return SystemReader(directory).read();
}

}  // namespace takt

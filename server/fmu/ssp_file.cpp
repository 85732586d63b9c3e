#include "server/fmu/ssp_file.h"

#include <tinyxml2.h>

#include <algorithm>
#include <array>
#include <set>
#include <tuple>

#include "idl/common/bounded_file.h"
#include "idl/common/parse.h"
#include "idl/common/text.h"
#include "server/fmu/fmu_archive.h"
#include "server/fmu/model_description.h"

namespace takt {
namespace {

using tinyxml2::XMLElement;

constexpr std::size_t kMostElements = 1000, kMostConnections = 10'000, kMostDepth = 32;

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
                    {"Real", "Integer", "Boolean", "String", "Enumeration", "Float64", "Float32", "Int8",
                     "UInt8", "Int16", "UInt16", "Int32", "UInt32", "Int64", "UInt64"},
                    [&](const XMLElement& value, std::string_view) {
                      values[prefix + name] = {XmlFile::text(value, "value"), XmlFile::text(value, "unit")};
                    });
    });
  });
}

/// By the linear transformation that the element may have; it gives the unit of the target.
void transform(const XmlFile& file, const XMLElement& element, FmuRequest::Value& value) {
  file.children(element, {"LinearTransformation"}, [&](const XMLElement& linear, std::string_view) {
    const auto number = finite_number(value.text);
    if (!number) file.fail(linear, "a transformation of '" + value.text.substr(0, 40) + "'", "numbers");
    value.text =
        exact_text(file.number(linear, "factor", 1.0) * *number + file.number(linear, "offset", 0.0));
    value.unit.clear();
  });
}

/// Values under the names that the mapping gives them; what it does not name has no effect.
Values mapped(const XmlFile& file, const XMLElement& mapping, const Values& values) {
  Values result;
  file.children(mapping, {"MappingEntry"}, [&](const XMLElement& entry, std::string_view) {
    const std::string source = file.required(entry, "source");
    const auto found = values.find(source);
    if (found == values.end()) {
      std::vector<std::string> known;
      for (const auto& [name, value] : values) known.push_back(name);
      file.fail(entry, "the source '" + source.substr(0, 200) + "'",
                known.empty() ? "none, there are no values" : join(known, ", ").substr(0, 1000));
    }
    FmuRequest::Value value = found->second;
    transform(file, entry, value);
    result[file.required(entry, "target")] = value;
  });
  return result;
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
    read_system(*system, 0);
    read_ports();
    if (system_.elements.empty()) file_.fail(*system, "no Component", "at least one");
    dissolve();
    return std::move(system_);
  }

 private:
  struct Connector {
    std::string kind, unit;
    SignalType type = SignalType::real;
    bool is_number = true;
  };
  using Connectors = std::map<std::string, Connector>;

  /// A system: the outermost one or one in it. Numbers are those of elements and of scopes.
  struct Scope {
    std::string prefix;  ///< of its elements, e.g. "drive.motor."
    Connectors connectors;
    std::vector<std::string> names;  ///< of its elements and systems
    std::map<std::string, std::size_t> components, systems;
    const XMLElement* place = nullptr;  ///< of its Connectors
    Values parameters;                  ///< of its connectors
  };
  /// A connector of an element, or of a scope: then `element` is -1.
  struct End {
    int element = -1;
    std::size_t scope = 0;
    std::string connector, unit;
    auto key() const { return std::tuple(element, scope, connector); }
  };
  struct Link {
    End from, to;
    FmuSystem::Connection::Step step;
    std::string place;
  };

  /// Returns its number.
  std::size_t read_system(const XMLElement& system, std::size_t depth, const std::string& prefix = "") {
    const std::size_t scope = scopes_.size();
    if (depth > kMostDepth || scope > kMostElements)
      file_.fail(system, "too many systems",
                 std::to_string(kMostElements) + ", " + std::to_string(kMostDepth) + " in each other");
    scopes_.emplace_back();
    scopes_[scope].prefix = prefix;
    // Elements first: connections name them.
    const std::vector<std::string_view> parts{"Connectors", "Elements", "Connections", "ParameterBindings"};
    const auto each = [&](std::string_view wanted, const auto& read_it) {
      file_.children(system, parts, [&](const XMLElement& part, std::string_view name) {
        if (name == wanted) read_it(part);
      });
    };
    each("Connectors", [&](const XMLElement& part) {
      scopes_[scope].connectors = read_connectors(part);
      scopes_[scope].place = &part;
    });
    each("Elements", [&](const XMLElement& part) { read_elements(part, scope, depth); });
    each("ParameterBindings", [&](const XMLElement& part) { bind_all(part, read_bindings(part), scope); });
    each("Connections", [&](const XMLElement& part) { read_connections(part, scope); });
    return scope;
  }

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

  void read_ports() {
    const Scope& outermost = scopes_.front();
    for (const auto& [name, connector] : outermost.connectors) {
      if (!connector.is_number || (connector.kind != "input" && connector.kind != "output")) continue;
      const std::string signal = signal_name(name);
      if (std::any_of(system_.ports.begin(), system_.ports.end(),
                      [&](const auto& p) { return p.name == signal; }))
        file_.fail(*outermost.place, "two connectors with the signal '" + signal + "'",
                   "names that differ in letters and digits");
      const auto start = starts_.find(name);
      system_.ports.push_back({signal, connector.unit, connector.type, connector.kind == "input",
                               start == starts_.end() ? 0.0 : start->second});
    }
  }

  void read_elements(const XMLElement& elements, std::size_t scope, std::size_t depth) {
    file_.children(
        elements, {"Component", "System"}, [&](const XMLElement& component, std::string_view kind) {
          const std::string name = file_.required(component, "name");
          if (std::find(scopes_[scope].names.begin(), scopes_[scope].names.end(), name) !=
              scopes_[scope].names.end())
            file_.fail(component, "two elements with the name '" + name + "'", "names that differ");
          scopes_[scope].names.push_back(name);
          if (kind == "System") {
            const std::size_t inner = read_system(component, depth + 1, scopes_[scope].prefix + name + ".");
            scopes_[scope].systems[name] = inner;
            return;
          }
          if (system_.elements.size() == kMostElements)
            file_.fail(component, "more than " + std::to_string(kMostElements) + " components", "fewer");
          FmuSystem::Element element;
          element.name = signal_name(scopes_[scope].prefix + name);
          for (const FmuSystem::Element& other : system_.elements)
            if (other.name == element.name)
              file_.fail(component, "two components with the name '" + element.name + "'",
                         "names that differ in letters and digits");
          paths_.push_back(scopes_[scope].prefix + name);
          scopes_[scope].components[name] = system_.elements.size();
          const std::string type = XmlFile::text(component, "type");
          if (!type.empty() && type != "application/x-fmu-sharedlibrary")
            file_.fail(
                component, "'" + name + "' of the type '" + type.substr(0, 100) + "'",
                "application/x-fmu-sharedlibrary, which are FMUs; a System in place of an SSP in the SSP");
          const std::string implementation = XmlFile::text(component, "implementation");
          if (!implementation.empty() && implementation != "any" && implementation != "CoSimulation")
            file_.fail(component, "implementation='" + implementation.substr(0, 40) + "'",
                       "any or CoSimulation");
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
      Values own;
      const XMLElement* mapping = nullptr;
      file_.children(binding, {"ParameterValues", "ParameterMapping"},
                     [&](const XMLElement& part, std::string_view kind) {
                       if (kind == "ParameterMapping") {
                         mapping = &part;
                         return;
                       }
                       file_.children(part, {"ParameterSet"}, [&](const XMLElement& set, std::string_view) {
                         read_parameter_set(file_, set, prefix, own);
                       });
                     });
      if (const std::string source = XmlFile::text(binding, "source"); !source.empty()) {
        const XmlFile other(directory_, inside(binding, source, ".ssv"));
        read_parameter_set(other, other.root("ParameterSet"), prefix, own);
      }
      if (mapping != nullptr) own = mapped_by(*mapping, own);
      own.merge(values);  // a later binding wins
      values = std::move(own);
    });
    return values;
  }

  Values mapped_by(const XMLElement& mapping, const Values& values) const {
    const std::string type = XmlFile::text(mapping, "type"), source = XmlFile::text(mapping, "source");
    if (!type.empty() && type != "application/x-ssp-parameter-mapping")
      file_.fail(mapping, "type='" + type.substr(0, 100) + "'", "application/x-ssp-parameter-mapping");
    if (XmlFile::text(mapping, "sourceBase") == "component")
      file_.fail(mapping, "sourceBase='component'", "SSD, i.e. a file of the SSP");
    if (!source.empty()) {
      const XmlFile other(directory_, inside(mapping, source, ".ssm"));
      return mapped(other, other.root("ParameterMapping"), values);
    }
    Values result;
    file_.children(mapping, {"ParameterMapping"},
                   [&](const XMLElement& own, std::string_view) { result = mapped(file_, own, values); });
    return result;
  }

  /// Values of a system: NAME of a connector, or ELEMENT.NAME. They win over those of the elements.
  void bind_all(const XMLElement& bindings, const Values& values, std::size_t scope) {
    Scope& system = scopes_[scope];
    for (const auto& [name, value] : values) {
      if (const auto own = system.connectors.find(name);
          own != system.connectors.end() && own->second.kind == "parameter")
        system.parameters[name] = value;
      if (const auto own = system.connectors.find(name);
          own != system.connectors.end() && own->second.is_number &&
          (own->second.kind == "input" || own->second.kind == "output")) {
        if (scope > 0)
          file_.fail(bindings, "a value of the connector '" + name + "' of a system in a system",
                     "values of components, ELEMENT.NAME");
        starts_[name] = value_of(value);
      }
      const std::string path = system.prefix + name;
      for (std::size_t e = 0; e < paths_.size(); ++e)
        if (path.starts_with(paths_[e] + "."))
          system_.elements[e].values[path.substr(paths_[e].size() + 1)] = value;
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

  End end_of(const XMLElement& connection, std::size_t scope, const char* element_key,
             const char* connector_key, bool& gives_values, bool& takes_values) const {
    End end;
    end.scope = scope;
    const std::string element = XmlFile::text(connection, element_key);
    end.connector = file_.required(connection, connector_key);
    const Scope& here = scopes_[scope];
    const Connectors* connectors = &here.connectors;
    const bool within = element.empty();  // some tools write an empty name for none
    if (!within) {
      if (const auto component = here.components.find(element); component != here.components.end()) {
        end.element = static_cast<int>(component->second);
        connectors = &by_element_[component->second];
      } else if (const auto system = here.systems.find(element); system != here.systems.end()) {
        end.scope = system->second;
        connectors = &scopes_[system->second].connectors;
      } else {
        file_.fail(connection, "the element '" + element + "'",
                   here.names.empty() ? "none" : join(here.names, ", "));
      }
    }
    const auto found = connectors->find(end.connector);
    if (found == connectors->end()) {
      std::vector<std::string> known;
      for (const auto& [one, connector] : *connectors) known.push_back(one);
      file_.fail(connection,
                 "the connector '" + end.connector + "'" + (element.empty() ? "" : " of " + element),
                 known.empty() ? "none" : join(known, ", "));
    }
    const Connector& connector = found->second;
    // What a system takes from outside it gives to its elements.
    gives_values = within            ? connector.kind == "input"
                   : end.element < 0 ? connector.kind == "output"
                                     : gives(connector.kind);
    takes_values = within ? connector.kind == "output" : connector.kind == "input";
    if (!connector.is_number || (!gives_values && !takes_values))
      file_.fail(connection,
                 "the connector '" + end.connector + "' of the kind " + connector.kind +
                     (connector.is_number ? "" : ", a text"),
                 "inputs and outputs that are numbers or booleans; parameters stand in ParameterBindings");
    end.unit = connector.unit;
    return end;
  }

  /// A connection that gives a parameter of the system to a component. True: it is one.
  bool connects_parameter(const XMLElement& stated, std::size_t scope) {
    const Scope& here = scopes_[scope];
    for (const bool forward : {true, false}) {
      const std::string from = XmlFile::text(stated, forward ? "startConnector" : "endConnector"),
                        to = XmlFile::text(stated, forward ? "endConnector" : "startConnector");
      const auto own = here.connectors.find(from);
      const auto component =
          here.components.find(XmlFile::text(stated, forward ? "endElement" : "startElement"));
      if (!XmlFile::text(stated, forward ? "startElement" : "endElement").empty() ||
          own == here.connectors.end() || own->second.kind != "parameter" ||
          component == here.components.end())
        continue;
      const Connectors& connectors = by_element_[component->second];
      const auto target = connectors.find(to);
      if (target == connectors.end() || target->second.kind != "parameter") continue;
      if (const auto stated_value = here.parameters.find(from); stated_value != here.parameters.end()) {
        FmuRequest::Value value = stated_value->second;
        transform(file_, stated, value);
        system_.elements[component->second].values[to] = value;
      }
      return true;
    }
    return false;
  }

  void read_connections(const XMLElement& connections, std::size_t scope) {
    file_.children(connections, {"Connection"}, [&](const XMLElement& stated, std::string_view) {
      if (links_.size() == kMostConnections)
        file_.fail(stated, "more than " + std::to_string(kMostConnections) + " connections", "fewer");
      for (const char* indices : {"startIndices", "endIndices"})
        if (stated.Attribute(indices) != nullptr)
          file_.fail(stated, indices, "connections of whole connectors, which are no arrays");
      if (connects_parameter(stated, scope)) return;
      Link link;
      bool start_gives = false, start_takes = false, end_gives = false, end_takes = false;
      link.from = end_of(stated, scope, "startElement", "startConnector", start_gives, start_takes);
      link.to = end_of(stated, scope, "endElement", "endConnector", end_gives, end_takes);
      if (start_takes && end_gives) {
        std::swap(link.from, link.to);
      } else if (!start_gives || !end_takes) {
        file_.fail(stated, start_gives ? "two sources" : "two targets",
                   "one connector that gives a value and one that takes it");
      }
      link.step.converts_units = !file_.flag(stated, "suppressUnitConversion");
      link.step.unit = link.to.unit;
      file_.children(stated, {"LinearTransformation"}, [&](const XMLElement& linear, std::string_view) {
        link.step.factor = file_.number(linear, "factor", 1.0);
        link.step.offset = file_.number(linear, "offset", 0.0);
      });
      link.place = file_.place(stated);
      if (is_inner(link.to) && !into_.emplace(link.to.key(), links_.size()).second)
        file_.fail(stated, "the connector '" + link.to.connector + "' again",
                   "one connection to each connector");
      links_.push_back(std::move(link));
    });
  }

  /// A connector of a system in the system.
  static bool is_inner(const End& end) { return end.element < 0 && end.scope > 0; }

  /// Connections from element to element, through the connectors of inner systems. What nothing leads to keeps its value.
  void dissolve() {
    for (const Link& last : links_) {
      if (is_inner(last.to)) continue;
      FmuSystem::Connection connection;
      const Link* link = &last;
      connection.steps.push_back(link->step);
      while (link != nullptr && is_inner(link->from)) {
        const auto before = into_.find(link->from.key());
        link = before == into_.end() ? nullptr : &links_[before->second];
        if (link != nullptr) connection.steps.push_back(link->step);
        if (connection.steps.size() > links_.size())
          throw FmuError(last.place +
                         ": found connectors of systems that lead to each other in a circle; "
                         "allowed: a connection that begins at a component");
      }
      if (link == nullptr) continue;
      std::reverse(connection.steps.begin(), connection.steps.end());
      connection.from = {link->from.element, signal_name(link->from.connector)};
      connection.to = {last.to.element, signal_name(last.to.connector)};
      connection.place = last.place;
      system_.connections.push_back(std::move(connection));
    }
  }

  const std::filesystem::path& directory_;
  XmlFile file_;
  FmuSystem system_;
  std::vector<Scope> scopes_;  ///< the outermost first
  std::vector<Link> links_;
  std::map<std::tuple<int, std::size_t, std::string>, std::size_t> into_;  ///< links to inner connectors
  std::vector<std::string> paths_;  ///< of elements, as in the file: SYSTEM.ELEMENT
  std::vector<Connectors> by_element_;
  std::map<std::string, double> starts_;  ///< of the connectors of the outermost system
};

}  // namespace

FmuSystem read_ssp(const std::filesystem::path& directory) {
  return SystemReader(directory).read();
}

}  // namespace takt

#include "server/fmu/ssp_file.h"

#include <algorithm>
#include <tuple>

#include "idl/common/parse.h"
#include "idl/common/text.h"
#include "server/fmu/model_description.h"
#include "server/fmu/ssp_xml.h"
#include "server/fmu/units.h"

namespace takt {
namespace {

using ssp::mapped;
using ssp::read_parameter_set;
using ssp::read_units;
using ssp::SspXml;
using ssp::transform;
using ssp::unit_name;
using ssp::Values;
using tinyxml2::XMLElement;

constexpr std::size_t kMostElements = 1000, kMostConnections = 10'000, kMostDepth = 32;

class SystemReader {
 public:
  explicit SystemReader(const std::filesystem::path& directory)
      : directory_(directory), file_(directory, "SystemStructure.ssd") {}

  FmuSystem read() {
    const XMLElement& root = file_.root("SystemStructureDescription");
    if (const std::string version = SspXml::text(root, "version"); version != "1.0" && version != "2.0")
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
    for (FmuSystem::Element& element : system_.elements)
      for (auto& [name, value] : element.values)
        if (const auto unit = system_.units.find(value.unit); !value.defined && unit != system_.units.end())
          value.defined = unit->second;
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
    Values parameters, starts;          ///< of its connectors; of its inputs and outputs
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
    each("ParameterBindings", [&](const XMLElement& part) { bind_all(read_bindings(part), scope); });
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
                       connector.unit = unit_name(SspXml::text(type, "unit"));
                       connector.is_number = name != "String" && name != "Binary";
                       connector.type = name == "Boolean" ? SignalType::boolean
                                        : name == "Real" || name == "Float64" || name == "Float32"
                                            ? SignalType::real
                                            : SignalType::integer;
                     });
      if (!result.emplace(file_.required(stated, "name"), connector).second)
        file_.fail(stated, "'" + SspXml::text(stated, "name") + "' twice", "unique names of connectors");
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
      const auto start = outermost.starts.find(name);
      system_.ports.push_back(
          {signal, connector.unit, connector.type, connector.kind == "input",
           start == outermost.starts.end() ? 0.0 : value_of(in_unit_of(connector.unit, start->second))});
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
          const std::string type = SspXml::text(component, "type");
          if (!type.empty() && type != "application/x-fmu-sharedlibrary")
            file_.fail(
                component, "'" + name + "' of the type '" + type.substr(0, 100) + "'",
                "application/x-fmu-sharedlibrary, which are FMUs; a System in place of an SSP in the SSP");
          const std::string implementation = SspXml::text(component, "implementation");
          if (implementation == "ModelExchange")
            element.note = "the SSP selects model exchange; the FMU runs by its co-simulation.";
          else if (!implementation.empty() && implementation != "any" && implementation != "CoSimulation")
            file_.fail(component, "implementation='" + implementation.substr(0, 40) + "'",
                       "any, CoSimulation, or ModelExchange where the FMU has co-simulation as well");
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
      const std::string type = SspXml::text(binding, "type");
      if (!type.empty() && type != "application/x-ssp-parameter-set")
        file_.fail(binding, "type='" + type.substr(0, 100) + "'", "application/x-ssp-parameter-set");
      if (SspXml::text(binding, "sourceBase") == "component")
        file_.fail(binding, "sourceBase='component'", "SSD, i.e. a file of the SSP");
      const std::string prefix = SspXml::text(binding, "prefix");
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
      if (const std::string source = SspXml::text(binding, "source"); !source.empty()) {
        const SspXml other(directory_, inside(binding, source, ".ssv"));
        read_parameter_set(other, other.root("ParameterSet"), prefix, own);
      }
      if (mapping != nullptr) own = mapped_by(*mapping, own);
      own.merge(values);  // a later binding wins
      values = std::move(own);
    });
    return values;
  }

  Values mapped_by(const XMLElement& mapping, const Values& values) const {
    const std::string type = SspXml::text(mapping, "type"), source = SspXml::text(mapping, "source");
    if (!type.empty() && type != "application/x-ssp-parameter-mapping")
      file_.fail(mapping, "type='" + type.substr(0, 100) + "'", "application/x-ssp-parameter-mapping");
    if (SspXml::text(mapping, "sourceBase") == "component")
      file_.fail(mapping, "sourceBase='component'", "SSD, i.e. a file of the SSP");
    if (!source.empty()) {
      const SspXml other(directory_, inside(mapping, source, ".ssm"));
      return mapped(other, other.root("ParameterMapping"), values);
    }
    Values result;
    file_.children(mapping, {"ParameterMapping"},
                   [&](const XMLElement& own, std::string_view) { result = mapped(file_, own, values); });
    return result;
  }

  /// Values of a system: NAME of a connector, or ELEMENT.NAME. They win over those of the elements.
  void bind_all(const Values& values, std::size_t scope) {
    Scope& system = scopes_[scope];
    for (const auto& [name, value] : values) {
      if (const auto own = system.connectors.find(name);
          own != system.connectors.end() && own->second.kind == "parameter")
        system.parameters[name] = value;
      if (const auto own = system.connectors.find(name);
          own != system.connectors.end() && own->second.is_number &&
          (own->second.kind == "input" || own->second.kind == "output")) {
        system.starts[name] = value;
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
    const std::string element = SspXml::text(connection, element_key);
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
      const std::string from = SspXml::text(stated, forward ? "startConnector" : "endConnector"),
                        to = SspXml::text(stated, forward ? "endConnector" : "startConnector");
      const auto own = here.connectors.find(from);
      const auto component =
          here.components.find(SspXml::text(stated, forward ? "endElement" : "startElement"));
      if (!SspXml::text(stated, forward ? "startElement" : "endElement").empty() ||
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
        if (!SspXml::text(stated, indices).empty())
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

  /// The value of a connector with this unit. Where one of the two has no unit nothing is converted.
  FmuRequest::Value in_unit_of(const std::string& unit, const FmuRequest::Value& value) const {
    if (value.unit.empty()) return {value.text, unit, {}};
    if (unit.empty() || value.unit == unit) return value;
    const auto converted = in_unit(value_of(value), value, unit, system_.units);
    if (!converted)
      throw FmuError(file_.name() + ": found a value in the unit '" + value.unit + "' for a connector in '" +
                     unit + "'; allowed: the same unit, or units of the same quantity that Units defines");
    return {exact_text(*converted), unit, {}};
  }

  /// Connectors of inner systems that nothing leads to, farthest first, each with its step onwards: the value of the first that
  /// has one starts the component at the end.
  void start_at(const std::vector<End>& way, const std::vector<FmuSystem::Connection::Step>& steps,
                const End& to) {
    std::size_t i = 0;
    while (i < way.size() && !scopes_[way[i].scope].starts.contains(way[i].connector)) ++i;
    if (i == way.size() || to.element < 0) return;
    const Scope& scope = scopes_[way[i].scope];
    FmuRequest::Value value =
        in_unit_of(scope.connectors.at(way[i].connector).unit, scope.starts.at(way[i].connector));
    for (; i < steps.size(); ++i) {
      value = steps[i].converts_units ? in_unit_of(steps[i].unit, value)
                                      : FmuRequest::Value{value.text, steps[i].unit, {}};
      if (steps[i].factor == 1.0 && steps[i].offset == 0.0) continue;
      value = {exact_text(steps[i].factor * value_of(value) + steps[i].offset), steps[i].unit, {}};
    }
    system_.elements[static_cast<std::size_t>(to.element)].values[to.connector] = value;
  }

  /// Connections from element to element, through the connectors of inner systems. What nothing leads to keeps its value.
  void dissolve() {
    for (const Link& last : links_) {
      if (is_inner(last.to)) continue;
      FmuSystem::Connection connection;
      const Link* link = &last;
      std::vector<End> way;
      connection.steps.push_back(link->step);
      while (link != nullptr && is_inner(link->from)) {
        way.push_back(link->from);
        const auto before = into_.find(link->from.key());
        link = before == into_.end() ? nullptr : &links_[before->second];
        if (link != nullptr) connection.steps.push_back(link->step);
        if (connection.steps.size() > links_.size())
          throw FmuError(last.place +
                         ": found connectors of systems that lead to each other in a circle; "
                         "allowed: a connection that begins at a component");
      }
      std::reverse(connection.steps.begin(), connection.steps.end());
      if (link == nullptr) {
        std::reverse(way.begin(), way.end());
        start_at(way, connection.steps, last.to);
        continue;
      }
      connection.from = {link->from.element, signal_name(link->from.connector)};
      connection.to = {last.to.element, signal_name(last.to.connector)};
      connection.place = last.place;
      system_.connections.push_back(std::move(connection));
    }
  }

  const std::filesystem::path& directory_;
  SspXml file_;
  FmuSystem system_;
  std::vector<Scope> scopes_;  ///< the outermost first
  std::vector<Link> links_;
  std::map<std::tuple<int, std::size_t, std::string>, std::size_t> into_;  ///< links to inner connectors
  std::vector<std::string> paths_;  ///< of elements, as in the file: SYSTEM.ELEMENT
  std::vector<Connectors> by_element_;
};

}  // namespace

FmuSystem read_ssp(const std::filesystem::path& directory) {
  return SystemReader(directory).read();
}

}  // namespace takt

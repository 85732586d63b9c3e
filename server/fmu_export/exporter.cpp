#include "server/fmu_export/exporter.h"

#include <minizip/zip.h>
#include <unistd.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <cstdio>
#include <fstream>
#include <map>
#include <memory>
#include <regex>
#include <set>
#include <sstream>
#include <stdexcept>

#include "idl/common/glob.h"
#include "idl/common/mesh_path.h"
#include "idl/common/text.h"
#include "idl/common/xml.h"
#include "server/fmu/fmu_archive.h"
#include "server/fmu_export/cell_instance.h"
#include "server/fmu_export/cell_variables.h"
#include "server/scenario/scenario_builder.h"
#include "server/scenario/scenario_reader.h"
#include "server/scenario/scenario_writer.h"
#include "server/scenario/urdf_robot.h"
#include "server/simulation/model/model_hash.h"

namespace takt {
namespace {

namespace fs = std::filesystem;

constexpr const char* kIdentifier = "takt_cell";

/// Files of a scenario: values of keys that name one, by the table of fields.
void visit_files(YAML::Node& node, const KeyInfo& info, const std::function<void(YAML::Node&)>& visit) {
  if (info.kind == KeyInfo::Kind::file && node.IsScalar()) return visit(node);
  if (node.IsSequence() && !info.items.empty()) {
    for (auto&& element : node) visit_files(element, info.items.front(), visit);
    return;
  }
  if (!node.IsMap()) return;
  for (auto&& entry : node) {
    const std::string key = entry.first.Scalar();
    for (const KeyInfo& field : info.items) {
      if (field.key != key && field.key != "*") continue;
      visit_files(entry.second, field, visit);
      break;
    }
  }
}

std::string whole_text(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

/// The meshes that a URDF file names, those that exist; others are not needed for what takt does.
std::vector<fs::path> meshes_of_urdf(const fs::path& urdf, const PackageFolders& packages) {
  std::vector<fs::path> meshes;
  const UrdfRobot robot = read_urdf(urdf, packages);
  for (const UrdfLink& link : robot.links)
    for (const auto* shapes : {&link.visuals, &link.collisions})
      for (const UrdfShape& shape : *shapes)
        if (const auto mesh = shape.kind == UrdfShapeKind::mesh ? robot.mesh_file(shape) : std::nullopt)
          meshes.push_back(*mesh);
  return meshes;
}

/// Where the files have their places relative to each other: the folder that they have in common.
fs::path common_folder(const std::set<fs::path>& files) {
  fs::path common = files.empty() ? fs::path("/") : files.begin()->parent_path();
  for (const fs::path& file : files) {
    while (std::mismatch(common.begin(), common.end(), file.begin(), file.end()).first != common.end())
      common = common.parent_path();
  }
  return common;
}

/// Writes the scenario and all that it names below `resources`.
void write_resources(const Scenario& scenario, const fs::path& resources, const PackageFolders& packages) {
  YAML::Node tree = YAML::Load(write_scenario(scenario, resources));
  const KeyInfo info = scenario_info();
  std::set<fs::path> files;
  const auto absolute = [&](const std::string& value) {
    return split_mesh_path((resources / value).lexically_normal());
  };
  visit_files(tree, info, [&](YAML::Node& node) {
    const fs::path file = absolute(node.Scalar()).file;
    files.insert(file);
    const std::string kind = file.extension();
    if (kind == ".urdf")
      for (const fs::path& mesh : meshes_of_urdf(file, packages))
        files.insert(fs::absolute(mesh).lexically_normal());
  });
  const fs::path common = common_folder(files);
  const auto place = [&](const fs::path& file) {
    return fs::path("files") / file.lexically_relative(common);
  };
  visit_files(tree, info, [&](YAML::Node& node) {
    const MeshPath mesh = absolute(node.Scalar());
    node = place(mesh.file).string() + (mesh.node.empty() ? "" : "#" + mesh.node);
  });
  for (const fs::path& file : files) {
    fs::create_directories((resources / place(file)).parent_path());
    fs::copy_file(file, resources / place(file), fs::copy_options::overwrite_existing);
  }
  std::ofstream out(resources / kExportedScenario);
  out << tree << '\n';
  if (!out.flush()) throw std::runtime_error((resources / kExportedScenario).string() + " cannot be written");
}

std::vector<std::string> chosen(const std::vector<CellVariable>& all,
                                const std::vector<std::string>& patterns, bool inputs) {
  std::vector<std::string> names;
  std::set<std::string> fitted;
  for (const CellVariable& v : all) {
    if (v.is_input != inputs) continue;
    for (const std::string& pattern : patterns) {
      if (!glob_match(pattern, v.name)) continue;
      fitted.insert(pattern);
      if (names.empty() || names.back() != v.name) names.push_back(v.name);
    }
  }
  for (const std::string& pattern : patterns) {
    if (fitted.contains(pattern)) continue;
    std::string few;
    int count = 0;
    for (const CellVariable& v : all)
      if (v.is_input == inputs && ++count <= 12) few += (few.empty() ? "" : ", ") + v.name;
    throw ScenarioError(std::string(inputs ? "--inputs" : "--outputs") + ": found '" + pattern +
                        "', which fits no " + (inputs ? "input" : "output") +
                        " of the cell; allowed: " + (few.empty() ? "none, it has no inputs" : few) +
                        (count > 12 ? " and " + std::to_string(count - 12) + " more" : ""));
  }
  return names;
}

std::string number(double value, SignalType type) {
  if (type == SignalType::boolean) return value >= 0.5 ? "true" : "false";
  return type == SignalType::integer ? std::to_string(std::llround(value)) : exact_text(value);
}

/// modelDescription.xml. Value references are those of CellInstance.
std::string description_text(const Scenario& scenario, const CellModel& cell,
                             const std::vector<CellVariable>& variables, std::size_t inputs,
                             const std::string& token, int version, bool can_save, const Snapshot& start) {
  const bool two = version == 2;
  std::ostringstream out;
  out << "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<fmiModelDescription fmiVersion=\"" << version
      << ".0\" modelName=\"" << xml_escaped(scenario.name) << "\" " << (two ? "guid" : "instantiationToken")
      << "=\"" << token
      << "\" generationTool=\"takt\" license=\"documentation/licenses\" "
         "variableNamingConvention=\"structured\""
      << (two ? " numberOfEventIndicators=\"0\"" : "") << ">\n  <CoSimulation modelIdentifier=\""
      << kIdentifier << "\" canHandleVariableCommunicationStepSize=\"true\""
      << (two ? " canNotUseMemoryManagementFunctions=\"true\"" : "");
  const char* flag = can_save ? "true" : "false";
  out << " canGetAndSetFMU" << (two ? "state" : "State") << "=\"" << flag << "\" canSerializeFMU"
      << (two ? "state" : "State") << "=\"" << flag << "\"";
  if (!two) out << " fixedInternalStepSize=\"" << exact_text(cell.step_s) << "\"";
  out << "/>\n";
  std::set<std::string> units{"s"};
  for (const CellVariable& v : variables)
    if (!v.unit.empty() && v.type == SignalType::real) units.insert(v.unit);
  out << "  <UnitDefinitions>\n";
  for (const std::string& unit : units) out << "    <Unit name=\"" << xml_escaped(unit) << "\"/>\n";
  out << "  </UnitDefinitions>\n  <LogCategories>\n    <Category name=\"logStatusError\"/>\n    <Category "
         "name=\"logStatusDiscard\"/>\n"
         "  </LogCategories>\n  <DefaultExperiment startTime=\"0\"";
  if (scenario.duration_s > 0.0) out << " stopTime=\"" << exact_text(scenario.duration_s) << "\"";
  out << " stepSize=\"" << exact_text(cell.step_s) << "\"/>\n  <ModelVariables>\n";
  for (std::size_t i = 0; i < variables.size(); ++i) {
    const CellVariable& v = variables[i];
    const bool input = i < inputs, real = v.type == SignalType::real;
    std::string typed;
    if (real && !v.unit.empty()) typed += " unit=\"" + xml_escaped(v.unit) + "\"";
    if (input && v.type != SignalType::boolean)
      typed += " min=\"" + number(v.lower, v.type) + "\" max=\"" + number(v.upper, v.type) + "\"";
    if (input) typed += " start=\"" + number(value_of(v, start), v.type) + "\"";
    const std::string common =
        " name=\"" + v.name + "\" valueReference=\"" + std::to_string(i) + "\" causality=\"" +
        (input ? "input" : "output") + "\" variability=\"" + (real ? "continuous" : "discrete") + "\"" +
        (v.description.empty() ? "" : " description=\"" + xml_escaped(v.description) + "\"");
    const char* type2 = real ? "Real" : v.type == SignalType::boolean ? "Boolean" : "Integer";
    const char* type3 = real ? "Float64" : v.type == SignalType::boolean ? "Boolean" : "Int32";
    if (two)
      out << "    <ScalarVariable" << common << "><" << type2 << typed << "/></ScalarVariable>\n";
    else
      out << "    <" << type3 << common << typed << "/>\n";
  }
  const std::size_t time = variables.size();
  if (two)
    out << "    <ScalarVariable name=\"time\" valueReference=\"" << time
        << "\" causality=\"independent\" variability=\"continuous\"><Real unit=\"s\"/></ScalarVariable>\n";
  else
    out << "    <Float64 name=\"time\" valueReference=\"" << time
        << "\" causality=\"independent\" variability=\"continuous\" unit=\"s\"/>\n";
  out << "  </ModelVariables>\n  <ModelStructure>\n";
  if (two) {
    // Unknowns are counted from 1 in the order of the variables.
    for (const char* section : {"Outputs", "InitialUnknowns"}) {
      if (inputs == variables.size()) continue;
      out << "    <" << section << ">\n";
      for (std::size_t i = inputs; i < variables.size(); ++i)
        out << "      <Unknown index=\"" << i + 1 << "\"/>\n";
      out << "    </" << section << ">\n";
    }
  } else {
    for (const char* element : {"Output", "InitialUnknown"})
      for (std::size_t i = inputs; i < variables.size(); ++i)
        out << "    <" << element << " valueReference=\"" << i << "\"/>\n";
  }
  out << "  </ModelStructure>\n</fmiModelDescription>\n";
  return out.str();
}

/// What the library needs besides the C and C++ libraries of the system, as the loader finds it.
std::map<std::string, fs::path> needed_libraries(const fs::path& library) {
  static const std::regex kSystem(
      "^(linux-vdso|ld-linux|libc|libm|libdl|libpthread|librt|libresolv|libstdc\\+\\+|libgcc_s)[.-].*");
  std::map<std::string, fs::path> found;
  std::string quoted = "'";
  for (const char c : library.string()) quoted += c == '\'' ? std::string("'\\''") : std::string(1, c);
  const std::unique_ptr<FILE, int (*)(FILE*)> list(::popen(("ldd " + quoted + "'").c_str(), "r"), &::pclose);
  if (!list) throw std::runtime_error("ldd, which lists the libraries of the FMU, cannot be run");
  std::array<char, 4096> line{};
  while (std::fgets(line.data(), line.size(), list.get()) != nullptr) {
    std::istringstream words(line.data());
    std::string name, arrow, path;
    words >> name >> arrow >> path;
    if (arrow != "=>" || std::regex_match(name, kSystem)) continue;
    if (path.empty() || path.front() != '/')
      throw std::runtime_error("the library " + name + " of the FMU is not found");
    found[name] = path;
  }
  return found;
}

void add_to_zip(zipFile zip, const fs::path& file, const std::string& name) {
  zip_fileinfo info{};
  info.tmz_date = {0, 0, 0, 1, 0, 1980};  // the same files give the same archive
  info.external_fa = 0100644UL << 16U;
  const std::string bytes = whole_text(file);
  if (zipOpenNewFileInZip4_64(zip, name.c_str(), &info, nullptr, 0, nullptr, 0, nullptr, Z_DEFLATED,
                              Z_DEFAULT_COMPRESSION, 0, -MAX_WBITS, DEF_MEM_LEVEL, Z_DEFAULT_STRATEGY,
                              nullptr, 0, 3U << 8U, 0, 0) != ZIP_OK ||
      zipWriteInFileInZip(zip, bytes.data(), static_cast<unsigned>(bytes.size())) != ZIP_OK ||
      zipCloseFileInZip(zip) != ZIP_OK)
    throw std::runtime_error("the FMU cannot be written; the disk may be full");
}

void write_archive(const fs::path& folder, const fs::path& file) {
  std::vector<fs::path> files;
  for (const auto& entry : fs::recursive_directory_iterator(folder))
    if (entry.is_regular_file()) files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  const fs::path beside = file.string() + ".part";
  const zipFile zip = zipOpen64(beside.c_str(), APPEND_STATUS_CREATE);
  if (zip == nullptr) throw std::runtime_error(file.string() + " cannot be written");
  try {
    for (const fs::path& one : files) add_to_zip(zip, one, one.lexically_relative(folder).string());
  } catch (...) {
    zipClose(zip, nullptr);
    fs::remove(beside);
    throw;
  }
  if (zipClose(zip, nullptr) != ZIP_OK) throw std::runtime_error(file.string() + " cannot be written");
  fs::rename(beside, file);
}

}  // namespace

FmuExportResult export_fmu(const Scenario& scenario, const FmuExportOptions& options) {
  for (const StatedDevice& device : scenario.devices)
    if (device.type == &device_type("fmus") || device.type == &device_type("ssp"))
      throw ScenarioError(
          scenario.file.string() + ": " + device.type->key + "." + device.name +
          ": found an FMU in a cell to export; allowed: cells without FMUs, as an FMU runs no others");
  if (!fs::exists(options.library))
    throw std::runtime_error("the library of exported cells is not there: " + options.library.string());
  const FreshDirectory folder;
  const fs::path resources = folder.path() / "resources";
  fs::create_directories(resources);
  write_resources(scenario, resources, options.packages);
  // What the FMU will build, from its own files, and its decompositions.
  const auto cell = build_cell(read_scenario(resources / kExportedScenario), {resources / kExportedCache});
  const std::vector<CellVariable> all = cell_variables(cell->description);
  CellInterface interface;
  interface.inputs = chosen(all, options.inputs, true);
  interface.outputs = chosen(all, options.outputs, false);
  ModelDigest token;
  token << model_hash(*cell) << interface.inputs << interface.outputs << options.version;
  interface.token = "{takt-" + hexadecimal_text(token.value()).substr(2) + "}";
  write_interface(interface, resources / kInterfaceFile);
  std::vector<CellVariable> variables;
  for (const auto* names : {&interface.inputs, &interface.outputs})
    for (const std::string& name : *names)
      variables.push_back(
          *std::find_if(all.begin(), all.end(), [&](const CellVariable& v) { return v.name == name; }));
  const Simulation simulation(cell);
  std::ofstream(folder.path() / "modelDescription.xml")
      << description_text(scenario, *cell, variables, interface.inputs.size(), interface.token,
                          options.version, scenario.controller_program.empty(), simulation.make_snapshot());
  FmuExportResult result{interface.inputs, interface.outputs, {}};
  const fs::path binaries = folder.path() / "binaries" / (options.version == 2 ? kPlatform2 : kPlatform3);
  const fs::path licenses = folder.path() / "documentation" / "licenses";
  fs::create_directories(binaries);
  fs::create_directories(licenses);
  fs::copy_file(options.library, binaries / (std::string(kIdentifier) + ".so"));
  std::ofstream list(licenses / "README.txt");
  list << "takt is under the Apache licence 2.0. Besides its own library this FMU holds these of the system "
          "on which it was made,\n"
          "each under the licence that its Debian package states:\n\n";
  for (const auto& [name, path] : needed_libraries(options.library)) {
    fs::copy_file(fs::canonical(path), binaries / name);
    list << name << '\n';
    result.libraries.push_back(name);
  }
  list.close();
  write_archive(folder.path(), options.file);
  return result;
}

}  // namespace takt

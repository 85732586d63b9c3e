// takt-run compare, check-mesh, write-scenario, schema, reference: commands that read or write files, and
// simulate nothing. The options that several commands share.
#include <CLI/CLI.hpp>
#include <fstream>
#include <iostream>
#include <map>
#include <memory>

#include "idl/command_line/numbers.h"
#include "idl/command_line/package_folders.h"
#include "idl/common/text.h"
#include "server/headless/comparison.h"
#include "server/headless/mesh_check.h"
#include "server/headless/reference_pages.h"
#include "server/headless/scenario_schema.h"
#include "server/scenario/scenario_writer.h"
#include "server/simulation/model/solver.h"
#include "server/tools/takt_run/commands.h"

namespace takt::tool {
namespace {

void declare_compare(CLI::App& app, int& result) {
  struct Arguments {
    std::string first, second, report;
    std::vector<std::string> limits;
  };
  const auto a = std::make_shared<Arguments>();
  auto* command = app.add_subcommand("compare", "put two reports side by side and judge the differences");
  command->add_option("REPORT", a->first, "report of a run (JSON)")->required();
  command->add_option("OTHER", a->second, "report of the same scenario, e.g. at another level of detail")
      ->required();
  add_repeatable(*command, "--limit", a->limits, "NAME=VALUE",
                 "what may differ; names and defaults are printed with the verdict");
  command->add_option("--report", a->report, "write all differences to this file (JSON)");
  command->footer(
      "\nExample:\n  takt-run compare 1.json 3.json --limit energy=0.1 --report differences.json");
  command->callback([a, &result] {
    ComparisonLimits limits;
    for (const std::string& text : a->limits) set_limit(limits, text);
    result = compare_files(std::cout, a->first, a->second, a->report, limits) ? kDone : kFailed;
  });
}

void declare_check_mesh(CLI::App& app, int& result) {
  struct Arguments {
    std::string file;
    MeshCheckOptions mesh;
  };
  const auto a = std::make_shared<Arguments>();
  auto* command =
      app.add_subcommand("check-mesh", "say what the import repairs in a mesh, or why it is unusable");
  command->add_option("FILE", a->file, "mesh file: OBJ, STL, GLB or DAE; FILE.glb#NODE: a node of it")
      ->required();
  command->add_option("--scale", a->mesh.scale, "lengths of the mesh are multiplied by this")
      ->check(command_line::positive());
  command->add_option("--element-edge", a->mesh.element_edge_m, "as if divided to this edge for contact (m)")
      ->check(command_line::not_negative());
  command->footer("\nExample:\n  takt-run check-mesh part.stl --scale 0.001");
  command->callback(
      [a, &result] { result = print_mesh_check(std::cout, a->file, a->mesh) ? kDone : kUsage; });
}

/// The line that names the schema of a scenario for editors, for a file in `folder`: that of another file, or that of a
/// schema beside it.
std::string schema_line(const std::string& scenario, const std::filesystem::path& folder) {
  const std::string begin = "# yaml-language-server: $schema=";
  std::string line;
  std::getline(std::ifstream(scenario) >> std::ws, line);
  if (!line.starts_with(begin)) return begin + "scenario.schema.json\n";
  const std::filesystem::path schema = line.substr(begin.size());
  if (schema.is_absolute() || line.find("://") != std::string::npos) return line + "\n";
  const auto file = std::filesystem::absolute(scenario).parent_path() / schema;
  return begin + file.lexically_normal().lexically_relative(folder.lexically_normal()).string() + "\n";
}

void declare_write_scenario(CLI::App& app) {
  struct Arguments {
    ScenarioArguments scenario;
    std::string file;
    bool force = false;
  };
  const auto a = std::make_shared<Arguments>();
  auto* command = app.add_subcommand("write-scenario",
                                     "write a scenario as a new file, with the values that options set");
  a->scenario.declare(*command);
  command->add_option("FILE", a->file, "scenario file to write (YAML)")->required();
  command->add_flag("--force", a->force, "replace FILE if it exists");
  command->footer("\nExample:\n  takt-run write-scenario cell.yaml heavy.yaml --set parts.P.mass_kg=4");
  command->callback([a] {
    const Scenario scenario = read_scenario(a->scenario.file, a->scenario.options);
    if (!a->force && std::filesystem::exists(a->file))
      throw ScenarioError(a->file +
                          ": the file exists; allowed: the name of a new file, or --force to replace it");
    const auto folder = std::filesystem::absolute(a->file).parent_path();
    const std::string text = schema_line(a->scenario.file, folder) + write_scenario(scenario, folder);
    write_file(a->file, [&](std::ostream& out) { out << text; });
  });
}

void declare_reference(CLI::App& app) {
  static const std::map<std::string, std::string (*)()> pages{
      {"scenario", scenario_reference}, {"signals", signals_reference}, {"lua", lua_reference}};
  const auto page = std::make_shared<std::string>("scenario");
  auto* command = app.add_subcommand("reference", "print a page of reference (Markdown)");
  command->add_option("PAGE", *page, "keys of scenario files, signals of devices, or names in Lua")
      ->check(CLI::IsMember({"scenario", "signals", "lua"}))
      ->capture_default_str();
  command->footer("\nExample:\n  takt-run reference signals");
  command->callback([page] { std::cout << pages.at(*page)(); });
}

}  // namespace

void add_repeatable(CLI::App& command, const char* option, std::vector<std::string>& values,
                    const std::string& value, const std::string& help) {
  command.add_option(option, values, help)
      ->option_text(value + " ...")
      ->type_size(1)
      ->allow_extra_args(false);
}

void add_threads(CLI::App& command, int& threads) {
  command
      .add_option("--threads", threads,
                  "threads for the collision checks; the bits are the same with any number")
      ->check(command_line::whole_number_from(1, 64))
      ->capture_default_str();
}

void ScenarioArguments::declare(CLI::App& command) {
  command.add_option("SCENARIO", file, "scenario file (YAML)")->required();
  add_repeatable(command, "--set", options.overrides, "KEY=VALUE",
                 "replace a value, e.g. parts.P.mass_kg=0.4");
  command.add_option("--lod", options.level_of_detail, "level of detail of every process")
      ->check(command_line::whole_number_from(1, 3));
  const auto replace = [&](const char* option, const std::string& key, const std::string& help) {
    const auto add = [this, option, key](const std::string& value) {
      options.overrides.push_back(key + "=" + value);
      options.option_of[key] = option;
    };
    return command.add_option_function<std::string>(option, add, help);
  };
  replace("--solver", "solver.method", list_names(solver_names()));
  replace("--step", "solver.step_s", "step size (s)")->type_name("FLOAT")->check(command_line::positive());
  replace("--tolerance", "solver.tolerance", "relative tolerance of solvers with error control")
      ->type_name("FLOAT")
      ->check(command_line::positive());
  add_allowed_fmus(command, allowed_fmus);
  add_packages(command, packages);
}

void add_packages(CLI::App& command, std::vector<std::string>& folders) {
  add_repeatable(command, "--packages", folders, "DIR", command_line::kPackagesHelp);
}

void add_allowed_fmus(CLI::App& command, std::string& directory) {
  command
      .add_option("--allow-fmus", directory,
                  "directory whose FMUs scenarios may run; an FMU is code that runs on this machine")
      ->check(CLI::ExistingDirectory);
}

void write_file(const std::string& file, const std::function<void(std::ostream&)>& write) {
  std::ofstream out(file);
  write(out);
  out.close();
  if (!out) throw std::runtime_error(file + ": cannot be written");
}

void declare_files(CLI::App& app, int& result) {
  declare_compare(app, result);
  declare_check_mesh(app, result);
  declare_write_scenario(app);
  const auto print = [&](const char* name, const char* help, std::string (*text)()) {
    app.add_subcommand(name, help)->callback([text] { std::cout << text(); });
  };
  print("schema", "print the JSON Schema of scenario files, for editors", scenario_schema);
  declare_reference(app);
}

}  // namespace takt::tool

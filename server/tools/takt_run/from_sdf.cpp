// takt-run from-sdf: a world or model of SDFormat as a scenario.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <iostream>
#include <memory>

#include "idl/command_line/package_folders.h"
#include "idl/common/text.h"
#include "server/geometry/mesh/obj_writer.h"
#include "server/scenario/scenario_builder.h"
#include "server/scenario/scenario_writer.h"
#include "server/scenario/sdf_cell.h"
#include "server/tools/takt_run/commands.h"

namespace takt::tool {
namespace {

namespace fs = std::filesystem;

struct Arguments {
  std::string file, directory;
  std::vector<std::string> packages;
  bool leave_out_missing = false, quiet = false;
};

void write(const SdfCell& cell, const Arguments& arguments) {
  const fs::path directory = arguments.directory;
  for (const char* folder : {"meshes", "robots/meshes"}) fs::create_directories(directory / folder);
  for (const auto& [file, objects] : cell.meshes)
    write_file(file.string(), [&](std::ostream& out) { out << obj_text(objects); });
  for (const auto& [file, text] : cell.urdfs)
    write_file(file.string(), [&](std::ostream& out) { out << text; });
  for (const auto& [copy, original] : cell.copies)
    fs::copy_file(original, copy, fs::copy_options::overwrite_existing);
  write_file(cell.scenario.file.string(), [&](std::ostream& out) {
    out << "# From " << fs::path(arguments.file).filename().string()
        << " (SDFormat), by takt-run from-sdf.\n";
    for (std::string note : cell.notes) {
      std::replace_if(
          note.begin(), note.end(), [](char c) { return c == '\n' || c == '\r'; }, ' ');
      out << "# - " << note << '\n';
    }
    out << write_scenario(cell.scenario, directory);
  });
}

/// Fingers that are no parallel gripper stay joints that stand.
void leave_out_grippers(SdfCell& cell, const Arguments& arguments) {
  if (cell.scenario.grippers.empty()) return;
  try {
    load_cell(cell.scenario.file);
  } catch (const std::exception& reason) {
    cell.scenario.grippers.clear();
    cell.notes.push_back("The fingers stand, there is no gripper: " + std::string(reason.what()) + ".");
    write(cell, arguments);
  }
}

int import(const Arguments& arguments) {
  SdfOptions options;
  options.packages = command_line::model_folders(arguments.packages);
  options.leave_out_missing = arguments.leave_out_missing;
  SdfCell cell = sdf_cell(read_sdf(arguments.file, options), arguments.directory);
  write(cell, arguments);
  leave_out_grippers(cell, arguments);
  if (!arguments.quiet) {
    for (const std::string& note : cell.notes) std::cout << note << '\n';
    std::cout << cell.scenario.file.string() << ": " << counted(cell.scenario.parts.size(), "Part", "Parts")
              << ", " << counted(cell.scenario.grounds.size(), "Ground", "Grounds") << ", "
              << counted(cell.scenario.robots.size(), "robot", "robots") << '\n';
  }
  load_cell(cell.scenario.file);
  return kDone;
}

}  // namespace

void declare_from_sdf(CLI::App& app, int& result) {
  const auto a = std::make_shared<Arguments>();
  auto* command = app.add_subcommand("from-sdf", "write a world or model of SDFormat (Gazebo) as a scenario");
  command->add_option("FILE", a->file, "SDFormat file")->required();
  command->add_option("-o,--output", a->directory, "directory for the scenario, its meshes and URDFs")
      ->required();
  add_packages(*command, a->packages);
  command->add_flag("--leave-out-missing", a->leave_out_missing,
                    "leave out models and meshes that are not found, with a note");
  command->add_flag("--quiet", a->quiet, "print nothing but errors");
  command->footer("\nExample:\n  takt-run from-sdf cell.sdf -o cell --packages models");
  command->callback([a, &result] { result = import(*a); });
}

}  // namespace takt::tool

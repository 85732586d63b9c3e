// takt-run export-fmu: a cell as an FMU.
#include <CLI/CLI.hpp>
#include <iostream>
#include <memory>

#include "idl/command_line/package_folders.h"
#include "server/fmu_export/exporter.h"
#include "server/tools/takt_run/commands.h"

namespace takt::tool {

void declare_export(CLI::App& app, int& result) {
  struct Arguments {
    ScenarioArguments scenario;
    FmuExportOptions fmu;
    std::string version = "2.0";
    bool quiet = false;
  };
  const auto a = std::make_shared<Arguments>();
  auto* command =
      app.add_subcommand("export-fmu", "write a cell as an FMU for co-simulation, which needs no takt");
  a->scenario.declare(*command);
  command->add_option("-o,--output", a->fmu.file, "FMU to write")->required();
  add_repeatable(*command, "--inputs", a->fmu.inputs, "NAME",
                 "inputs of the FMU, e.g. 'Robot1.q_set[*]', Gripper1.close, Oven.door");
  add_repeatable(*command, "--outputs", a->fmu.outputs, "NAME",
                 "outputs of the FMU, e.g. 'Robot1.q[*]', 'Cube.position*', Oven.temperature");
  command->add_option("--fmi-version", a->version, "of the standard")
      ->check(CLI::IsMember({"2.0", "3.0"}))
      ->capture_default_str();
  command->add_flag("--quiet", a->quiet, "print nothing but errors");
  command->footer(
      "\nExample:\n  takt-run export-fmu cell.yaml -o cell.fmu --inputs 'Robot1.q_set[*]' --outputs "
      "'Robot1.q[*]' --outputs '*.position*'");
  command->callback([a, &result] {
    const Scenario scenario = read_scenario(a->scenario.file, a->scenario.options);
    a->fmu.packages = command_line::package_folders(a->scenario.packages);
    a->fmu.version = a->version == "2.0" ? 2 : 3;
    const auto bin = std::filesystem::read_symlink("/proc/self/exe").parent_path();
    a->fmu.library = bin / "../lib/takt/takt_cell.so";
    const FmuExportResult done = export_fmu(scenario, a->fmu);
    if (!a->quiet)
      std::cout << a->fmu.file.string() << ": FMI " << a->version << ", " << done.inputs.size() << " inputs, "
                << done.outputs.size() << " outputs, " << done.libraries.size()
                << " libraries of the system in it\n";
    result = kDone;
  });
}

}  // namespace takt::tool

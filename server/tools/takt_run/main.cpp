// takt-run: scenarios headless in one process, without DDS.
#include <takt_build_info.h>

#include <CLI/CLI.hpp>
#include <iostream>

#include "idl/command_line/commands.h"
#include "idl/command_line/output.h"
#include "server/tools/takt_run/commands.h"

namespace {

constexpr const char* kFooter = R"(
Examples:
  takt-run run config/scenarios/block_assembly.yaml
  takt-run run config/scenarios/block_assembly.yaml --lod 2 --report 2.json --html 2.html
  takt-run compare 1.json 2.json --limit energy=0.1
  takt-run study config/scenarios/block_assembly.yaml --vary interaction.damping_ratio=0.5:1.5:11
  takt-run verify config/verification/takt.yaml -o report
  takt-run check-mesh part.stl --scale 0.001
  takt-run from-sdf cell.sdf -o cell
  takt-run replay run.taktlog
takt-run COMMAND --help shows the options of each command.

Exit codes: 0 done; 1 the run ended early, the replay differs, a difference counts or a verdict is bad; 2 wrong
arguments or scenario, unusable mesh or damaged log; 3 the run reached its end and an assertion of the scenario failed.)";

int run(int argc, char** argv) {
  namespace tool = takt::tool;
  CLI::App app{"Simulate scenarios headless in one process, compare and vary them.", "takt-run"};
  takt::command_line::wrap_help(app);
  app.set_version_flag("--version", std::string("takt-run ") + takt_build_info());
  app.require_subcommand(1);
  int result = tool::kDone;
  tool::declare_run(app, result);
  tool::declare_study(app, result);
  tool::declare_verify(app, result);
  tool::declare_replay(app, result);
  tool::declare_export(app, result);
  tool::declare_from_sdf(app, result);
  tool::declare_files(app, result);
  app.footer(kFooter);  // commands inherit the settings present at their declaration
  app.failure_message(takt::command_line::failure);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    const auto word = takt::command_line::unknown_command(app);
    if (error.get_exit_code() == 0 || !word) return app.exit(error) == 0 ? tool::kDone : tool::kUsage;
    const bool scenario = word->ends_with(".yaml") || word->ends_with(".yml");
    std::cerr << "takt-run: " << takt::command_line::no_such_command(app, *word)
              << (scenario ? " To simulate a scenario, use 'takt-run run " + *word + "'." : "") << '\n';
    return tool::kUsage;
  }
  return result;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return takt::command_line::with_output_written("takt-run", run(argc, argv));
  } catch (const std::exception& error) {
    std::cerr << "takt-run: " << error.what() << '\n';
    return takt::tool::kUsage;
  }
}

// takt-egm: a robot of a cell as the controller of an EGM program, or as the follower of an ABB controller.
#include <takt_build_info.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <exception>
#include <string>

#include "client_lib/tools/connection_options.h"
#include "client_lib/tools/takt_egm/egm_session.h"
#include "idl/command_line/numbers.h"
#include "idl/command_line/output.h"

namespace {

constexpr const char* kExamples = R"(
Examples:
  takt-egm config/gateways/egm_controller.yaml --start               the robot answers to an EGM program of yours
  takt-egm config/gateways/egm_controller.yaml --lockstep --start    the same, with the same bits in each run
  takt-egm config/gateways/egm_sensor.yaml --start                the robot follows a controller or RobotStudio

The mapping file names the robot and the role (docs/controllers_rsi_egm.md).

Exit codes: 0 ended by --until or a signal; 1 failed; 2 wrong usage.)";

int run(int argc, char** argv) {
  CLI::App app{"ABB's Externally Guided Motion for one robot of a takt cell."};
  app.footer(kExamples);
  app.set_version_flag("--version", std::string("takt-egm ") + takt_build_info());
  takt::tool::EgmOptions options;
  options.client.name = "takt-egm";
  app.add_option("MAPPING", options.mapping, "mapping file (YAML)")->required()->check(CLI::ExistingFile);
  takt::tool::add_connection_options(app, options.client);
  app.add_flag("--lockstep", options.lockstep, "each message waits for its answer, and the cell for both");
  app.add_flag("--start", options.start, "set the cell playing, at the pace realtime or lockstep");
  app.add_option("--until", options.until_s, "end at this simulated time, s")
      ->check(takt::command_line::not_negative());
  app.add_option("--name", options.name, "what the controller is called in events and status")
      ->capture_default_str();
  app.add_option(
         "--secure", options.client.secure_directory,
         "auto: identities of this user, made at first use; or a directory with identity and permissions "
         "(environment: TAKT_SECURE)")
      ->check(CLI::ExistingDirectory | CLI::IsMember({"auto", "auto:controller"}));
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  try {
    return takt::tool::run_egm(options);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "takt-egm: %s\n", error.what());
    return 1;
  }
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return takt::command_line::with_output_written("takt-egm", run(argc, argv));
  } catch (const std::exception& error) {  // of the environment: see ClientOptions
    std::fprintf(stderr, "takt-egm: %s\n", error.what());
    return 2;
  }
}

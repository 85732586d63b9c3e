// takt-rsi: a robot of a cell as the KRC of an RSI program, or as the follower of a KRC.
#include <takt_build_info.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <exception>
#include <string>

#include "client_lib/tools/connection_options.h"
#include "client_lib/tools/takt_rsi/rsi_session.h"
#include "idl/command_line/numbers.h"
#include "idl/command_line/output.h"

namespace {

constexpr const char* kExamples = R"(
Examples:
  takt-rsi config/gateways/rsi_controller.yaml --start               the robot answers to an RSI program of yours
  takt-rsi config/gateways/rsi_controller.yaml --lockstep --start    the same, with the same bits in each run
  takt-rsi config/gateways/rsi_sensor_pc.yaml --start                the robot follows a KRC or a virtual controller

The mapping file names the robot, the role and the Ethernet configuration (docs/controllers_rsi_egm.md).

Exit codes: 0 ended by the sensor PC, by --until or a signal; 1 RSI has stopped with an error; 2 wrong usage.)";

int run(int argc, char** argv) {
  CLI::App app{"KUKA's RobotSensorInterface for one robot of a takt cell."};
  app.footer(kExamples);
  app.set_version_flag("--version", std::string("takt-rsi ") + takt_build_info());
  takt::tool::RsiOptions options;
  options.client.name = "takt-rsi";
  app.add_option("MAPPING", options.mapping, "mapping file (YAML)")->required()->check(CLI::ExistingFile);
  takt::tool::add_connection_options(app, options.client);
  app.add_flag("--lockstep", options.lockstep, "each packet waits for its answer, and the cell for both");
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
    return takt::tool::run_rsi(options);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "takt-rsi: %s\n", error.what());
    return 1;
  }
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return takt::command_line::with_output_written("takt-rsi", run(argc, argv));
  } catch (const std::exception& error) {  // of the environment: see ClientOptions
    std::fprintf(stderr, "takt-rsi: %s\n", error.what());
    return 2;
  }
}

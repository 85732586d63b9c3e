// takt-ur: lets a robot of a takt cell look like one with a controller of Universal Robots, or follow such a controller.
#include <takt_build_info.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <exception>
#include <stdexcept>
#include <string>

#include "client_lib/gateway/urscript/functions.h"
#include "client_lib/tools/connection_options.h"
#include "client_lib/tools/takt_ur/gateway_options.h"
#include "idl/command_line/commands.h"
#include "idl/command_line/output.h"

namespace {

constexpr const char* kExamples = R"(
Examples:
  takt-ur --robot Robot1 --start                    drivers connect to 127.0.0.1
  takt-ur --robot Robot1 --lockstep --start         the same bits in each run of a driver that answers each data package
  takt-ur config/gateways/ur_block.yaml             with gripper and signals at digital outputs and inputs
  takt-ur follow --address 192.168.56.101 --robot Robot1    the robot follows URSim or a controller

A driver needs the address of takt-ur in place of the robot's; its ports are fixed, so that each robot has an address of
its own: 127.0.0.1, 127.0.0.2, ... docs/controllers.md lists what is supported.

Exit codes: 0 ended by a signal, 1 the cell or the controller went away, 2 wrong usage.)";

int run(int argc, char** argv) {
  CLI::App app{
      "Universal Robots' protocols for a robot of a takt cell: RTDE, primary interface, external control, "
      "dashboard."};
  takt::command_line::wrap_help(app);
  app.footer(kExamples);
  app.set_version_flag("--version", std::string("takt-ur ") + takt_build_info());
  app.require_subcommand(0, 1);
  takt::ur::GatewayRun options;
  options.client.name = "takt-ur";
  double timeout_s = 10.0;
  const auto add = [&](CLI::App& one, const char* address) {
    one.add_option("MAPPING", options.mapping_file, "mapping file (YAML); without it: the robot, no signals")
        ->check(CLI::ExistingFile);
    one.add_option("--robot", options.robot, "robot of the cell, without a mapping")->excludes("MAPPING");
    one.add_option("--address", options.address, address);
    one.add_flag("--start", options.start, "set the pace, and the cell playing");
    takt::tool::add_connection_options(one, options.client);
    one.add_option("--timeout", timeout_s, "longest wait for the cell, s")
        ->check(takt::command_line::positive())
        ->capture_default_str();
    takt::tool::add_secure_option(one, options.client);
  };
  app.add_flag("--lockstep", options.lockstep,
               "the cell waits for each cycle of 2 ms, and for the driver of an external control program");
  CLI::App* follow = app.add_subcommand("follow", "takt's robot follows a UR controller or its simulator");
  add(app, "IP address to listen at, in place of the mapping's");
  add(*follow, "host name or IP address of the controller");
  follow->get_option("--address")->required();
  const CLI::App* functions =
      app.add_subcommand("functions", "functions of URScript that programs may call (docs/urscript.md)");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  if (functions->parsed()) {
    std::fputs(takt::urscript::functions_page().c_str(), stdout);
    return 0;
  }
  options.client.timeout = takt::Seconds{timeout_s};
  try {
    if (follow->parsed()) {
      if (options.lockstep)
        throw std::invalid_argument(
            "--lockstep: a real controller does not wait for the cell; allowed: without 'follow'");
      return takt::ur::run_follower(options);
    }
    return options.lockstep ? takt::ur::run_lockstep(options) : takt::ur::run_controller(options);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "takt-ur: %s\n", error.what());
    return 1;
  }
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return takt::command_line::with_output_written("takt-ur", run(argc, argv));
  } catch (const std::exception& error) {  // of the environment: see ClientOptions
    std::fprintf(stderr, "takt-ur: %s\n", error.what());
    return 2;
  }
}

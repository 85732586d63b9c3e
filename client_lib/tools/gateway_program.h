#pragma once
// The command line of a gateway for one robot: the same for takt-rsi and takt-egm.
#include <takt_build_info.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <exception>
#include <string>

#include "client_lib/tools/connection_options.h"
#include "client_lib/tools/gateway_options.h"
#include "idl/command_line/commands.h"
#include "idl/command_line/numbers.h"
#include "idl/command_line/output.h"

namespace takt::tool {

struct GatewayProgram {
  const char* name;         ///< of the program
  const char* description;  ///< a sentence
  const char* footer;       ///< examples and exit codes
  const char* lockstep;     ///< help of --lockstep
  int (*run)(const GatewayOptions& options);
};

inline int run_gateway_command(const GatewayProgram& program, int argc, char** argv) {
  CLI::App app{program.description};
  command_line::wrap_help(app);
  app.footer(program.footer);
  app.set_version_flag("--version", std::string(program.name) + " " + takt_build_info());
  GatewayOptions options;
  options.name = options.client.name = program.name;
  app.add_option("MAPPING", options.mapping, "mapping file (YAML)")->required()->check(CLI::ExistingFile);
  add_connection_options(app, options.client);
  app.add_flag("--lockstep", options.lockstep, program.lockstep);
  app.add_flag("--start", options.start, "set the cell playing, at the pace realtime or lockstep");
  app.add_option("--until", options.until_s, "end at this simulated time, s")
      ->check(command_line::not_negative());
  app.add_option("--name", options.name, "what the controller is called in events and status")
      ->capture_default_str();
  add_secure_option(app, options.client);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  try {
    return program.run(options);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s: %s\n", program.name, error.what());
    return 1;
  }
}

/// What main() returns.
inline int run_gateway_program(const GatewayProgram& program, int argc, char** argv) {
  try {
    return command_line::with_output_written(program.name, run_gateway_command(program, argc, argv));
  } catch (const std::exception& error) {  // of the environment: see ClientOptions
    std::fprintf(stderr, "%s: %s\n", program.name, error.what());
    return 2;
  }
}

}  // namespace takt::tool

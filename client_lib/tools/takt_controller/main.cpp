// takt-controller: runs a robot program (Lua) against a cell, as a robot's own controller would: once per
// period it reads the state and sends set-points for every robot and gripper the program drives.
#include <takt_build_info.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <exception>
#include <string>
#include <vector>

#include "client_lib/tools/connection_options.h"
#include "client_lib/tools/takt_controller/session.h"
#include "idl/command_line/commands.h"
#include "idl/command_line/enumeration.h"
#include "idl/command_line/numbers.h"
#include "idl/command_line/output.h"
#include "idl/common/parse.h"

namespace {

constexpr const char* kExamples = R"(
Examples:
  takt-controller config/programs/block_assembly.lua --start
  takt-controller config/programs/block_assembly.lua --pace lockstep --start --until 42
  takt-controller config/programs/chainsaw_motor.lua --set lateral_offset_m=0.001 --start

When the cell goes away it waits for it, and starts the program again from its beginning; with --until it ends with
exit code 1 instead. A cell that goes on from a snapshot is left alone until it is reset.

Exit codes: 0 the program has finished, 1 it failed or the cell went away, 2 wrong usage.)";

int run(int argc, char** argv) {
  CLI::App app{"Run a robot program against a takt cell."};
  takt::command_line::wrap_help(app);
  app.footer(kExamples);
  app.set_version_flag("--version", std::string("takt-controller ") + takt_build_info());
  takt::tool::SessionOptions options;
  options.client.name = "takt-controller";
  double timeout_s = 10.0;
  app.add_option("PROGRAM", options.program, "robot program (Lua)")->required()->check(CLI::ExistingFile);
  std::vector<std::string> parameters;
  app.add_option("--set", parameters,
                 "NAME=VALUE: a parameter of the program, in place of the default that it states")
      ->type_size(1)
      ->allow_extra_args(false);
  takt::tool::add_connection_options(app, options.client);
  std::string pace;
  app.add_option("--pace", pace, "set the pace of the cell (default: leave it)")
      ->transform(CLI::IsMember(takt::command_line::words_of<takt::Pace>(), CLI::ignore_case));
  app.add_flag("--start", options.start, "set the cell playing when all is ready");
  app.add_option("--until", options.until_s,
                 "go on to this simulated time, s, when the program has finished (its robots hold still)")
      ->check(takt::command_line::not_negative());
  app.add_option(
         "--lookahead", options.lookahead,
         "in lockstep: periods that the program may run ahead of the cell while it does not look at it")
      ->check(CLI::Range(std::uint64_t{0}, takt::kMostLookahead - 1))
      ->capture_default_str();
  app.add_option("--name", options.name, "what the controller is called in events and status")
      ->capture_default_str();
  app.add_option(
         "--timeout", timeout_s,
         "longest wait for an answer; in lockstep also how long the cell waits for a command, s of wall time")
      ->check(takt::command_line::positive())
      ->capture_default_str();
  takt::tool::add_secure_option(app, options.client);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  if (!pace.empty()) options.pace = takt::enumerator_of<takt::Pace>(pace).value();
  options.client.timeout = takt::Seconds{timeout_s};
  for (const std::string& text : parameters) {
    const auto parameter = takt::named_number(text);
    if (!parameter) {
      std::fprintf(stderr,
                   "takt-controller: --set: found '%s'; allowed: NAME=VALUE, e.g. speed_m_per_s=0.02\n",
                   text.c_str());
      return 2;
    }
    options.parameters.insert_or_assign(parameter->first, parameter->second);
  }
  try {
    return takt::tool::run_session(options);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "takt-controller: %s\n", error.what());
    return 1;
  }
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return takt::command_line::with_output_written("takt-controller", run(argc, argv));
  } catch (const std::exception& error) {  // of the environment: see ClientOptions
    std::fprintf(stderr, "takt-controller: %s\n", error.what());
    return 2;
  }
}

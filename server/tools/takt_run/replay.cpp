// takt-run replay: a command log of takt-server simulated again.
#include "server/runtime/host/replay.h"

#include <CLI/CLI.hpp>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include "idl/command_line/numbers.h"
#include "idl/command_line/package_folders.h"
#include "idl/common/text.h"
#include "server/fmu/fmu_library.h"
#include "server/geometry/convex/decomposition_cache.h"
#include "server/runtime/loop/worker_pool.h"
#include "server/tools/takt_run/commands.h"

namespace takt::tool {
namespace {

struct ReplayArguments {
  std::string log, scenario, allowed_fmus;
  std::vector<std::string> packages;
  int threads = 1;
  bool quiet = false, json = false;
};

int run_replay(const ReplayArguments& a) {
  std::optional<WorkerPool> pool;  // outlives the simulation
  ReplayOptions options;
  if (a.threads > 1) options.executor = &pool.emplace(a.threads);
  const auto fmus = fmu_library(a.allowed_fmus);
  options.load = [&](const LogScenario& logged) {
    return load_logged_scenario(logged, user_cache_directory(), a.scenario, fmus.get(),
                                command_line::package_folders(a.packages));
  };
  const ReplayResult result = replay(a.log, options);
  const bool same = result.difference.empty();
  if (a.json)
    std::cout << nlohmann::json{{"difference", result.difference},
                                {"early_end", result.early_end},
                                {"recorded_by", result.version},
                                {"cell", result.cell},
                                {"scenarios", result.scenarios},
                                {"steps", result.steps},
                                {"commands", result.commands},
                                {"requests", result.requests},
                                {"checkpoints", result.checkpoints},
                                {"last_step", result.step},
                                {"state_hash", hexadecimal_text(result.state_hash)}}
                     .dump(2)
              << '\n';
  else if (!same)
    std::cerr << "takt-run: " << result.difference << '\n';
  else if (!a.quiet)
    std::cout << "Recorded by " << result.version << ", cell '" << result.cell << "': " << result.scenarios
              << " scenarios, " << result.steps << " steps, " << result.commands << " commands, "
              << result.requests << " requests.\n"
              << (result.early_end.empty() ? "" : "Note: " + result.early_end + ".\n")
              << "The same bits at all " << result.checkpoints << " checkpoints; the last one: step "
              << result.step << ", state hash " << hexadecimal_text(result.state_hash) << ".\n";
  return same ? kDone : kFailed;
}

}  // namespace

void declare_replay(CLI::App& app, int& result) {
  const auto arguments = std::make_shared<ReplayArguments>();
  auto* command = app.add_subcommand("replay", "simulate a command log again and compare the state hashes");
  command->add_option("LOG", arguments->log, "what takt-server --log recorded")->required();
  command->add_option("SCENARIO", arguments->scenario, "scenario file (YAML) in place of the recorded one");
  add_threads(*command, arguments->threads);
  add_allowed_fmus(*command, arguments->allowed_fmus);
  add_packages(*command, arguments->packages);
  command->add_flag("--quiet", arguments->quiet, "print nothing but errors");
  command->add_flag("--json", arguments->json, "print the result as JSON");
  command->footer("\nExample:\n  takt-run replay run.taktlog --json | jq .state_hash");
  command->callback([arguments, &result] { result = run_replay(*arguments); });
}

}  // namespace takt::tool

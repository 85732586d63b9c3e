// takt-run verify: a verification and validation report.
#include <takt_build_info.h>

#include <CLI/CLI.hpp>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include "idl/command_line/package_folders.h"
#include "server/fmu/fmu_archive.h"
#include "server/fmu/fmu_library.h"
#include "server/geometry/convex/decomposition_cache.h"
#include "server/headless/verification_report.h"
#include "server/tools/takt_run/commands.h"

namespace takt::tool {
namespace {

struct VerifyArguments {
  std::string plan, directory, allowed_fmus;
  std::vector<std::string> packages, scenes;
  bool json = false, quiet = false;
};

int verify(const VerifyArguments& a) {
  const VerificationPlan plan = read_verification_plan(a.plan);
  const auto fmus = fmu_library(a.allowed_fmus);
  VerificationOptions options;
  options.version = takt_build_info();
  options.scenes = a.scenes;
  options.import.cache_directory = user_cache_directory();
  options.import.fmus = fmus.get();
  options.import.packages = command_line::package_folders(a.packages);
  options.digest = &sha256_of;
  if (!a.quiet && !a.json) options.progress = [](const std::string& run) { std::cerr << run << '\n'; };
  const Verification done = verify(plan, options);
  const nlohmann::ordered_json report = verification_json(done);
  const auto write_json = [&](std::ostream& out) { out << report.dump(2) << '\n'; };
  if (!a.directory.empty()) {
    const std::filesystem::path directory(a.directory);
    std::filesystem::create_directories(directory);
    write_file(directory / "verification.json", write_json);
    write_file(directory / "verification.html",
               [&](std::ostream& out) { write_verification_page(out, report); });
  }
  if (a.json)
    write_json(std::cout);
  else if (!a.quiet)
    print_verification(std::cout, done);
  return done.good() ? kDone : kFailed;
}

}  // namespace

void declare_verify(CLI::App& app, int& result) {
  const auto a = std::make_shared<VerifyArguments>();
  auto* command = app.add_subcommand("verify", "verify and validate scenes of a plan, and report");
  command->add_option("PLAN", a->plan, "plan of the report (YAML)")->required();
  command->add_option("-o,--output", a->directory, "directory for verification.json and verification.html");
  add_repeatable(*command, "--scene", a->scenes, "NAME",
                 "run this scene of the plan; without the option all");
  command->add_flag("--json", a->json, "print the report as JSON in place of words");
  add_allowed_fmus(*command, a->allowed_fmus);
  add_packages(*command, a->packages);
  command->add_flag("--quiet", a->quiet, "print nothing but errors");
  command->footer("\nExample:\n  takt-run verify config/verification/takt.yaml -o report");
  command->callback([a, &result] { result = verify(*a); });
}

}  // namespace takt::tool

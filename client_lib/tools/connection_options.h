#pragma once
// How a program finds the cell: the same options for all programs.
#include <CLI/CLI.hpp>

#include "client_lib/client.h"
#include "idl/command_line/numbers.h"

namespace takt::tool {

inline void add_connection_options(CLI::App& app, ClientOptions& client) {
  app.add_option("--cell", client.cell, "name of the cell (environment: TAKT_CELL)")->capture_default_str();
  app.add_option("--domain", client.domain, "DDS domain (environment: TAKT_DOMAIN)")
      ->check(command_line::whole_number_from(0, 232))
      ->capture_default_str();
  auto* profiles =
      app.add_option("--profiles", client.profiles_file, "Fast DDS profiles (XML)")->check(CLI::ExistingFile);
  app.add_option("--profile", client.profile, "name of the profile in that file")
      ->needs(profiles)
      ->capture_default_str();
}

/// For programs with the permissions of a controller.
inline void add_secure_option(CLI::App& app, ClientOptions& client) {
  app.add_option(
         "--secure", client.secure_directory,
         "auto: identities of this user, made at first use; or a directory with identity and permissions "
         "(environment: TAKT_SECURE)")
      ->check(CLI::ExistingDirectory | CLI::IsMember({"auto", "auto:controller"}));
}

}  // namespace takt::tool

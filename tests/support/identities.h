#pragma once
// Test authorities and identities, made by the users' script.
#include <filesystem>
#include <stdexcept>
#include <string>
#include <vector>

#include "tests/support/child_process.h"

namespace takt::test {

inline std::filesystem::path make_identities(const std::filesystem::path& directory,
                                             const std::vector<std::string>& options = {}) {
  std::vector<std::string> command{std::string(TAKT_CONFIG_DIR) + "/dds/security/make_identities.sh",
                                   directory};
  command.insert(command.end(), options.begin(), options.end());
  ChildProcess script(command);
  if (script.wait() != 0) throw std::runtime_error(script.text);
  return directory;
}

}  // namespace takt::test

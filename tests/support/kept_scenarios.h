#pragma once
// Scenario files of tests, kept for an independent validator (tests/schema/check.py): if the environment
// names a folder (TAKT_KEEP_SCENARIOS), each text with its overrides and the reader's verdict.
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

namespace takt::test {

/// `error`: of the reader; empty: it has read the file.
inline void keep_scenario(const std::string& text, const std::vector<std::string>& overrides,
                          const std::string& error) {
  const char* folder = std::getenv("TAKT_KEEP_SCENARIOS");
  if (folder == nullptr) return;
  const std::filesystem::path base =
      std::filesystem::path(folder) / std::to_string(std::hash<std::string>{}(text + error));
  std::ofstream(base.string() + ".yaml") << text;
  std::ofstream all(base.string() + ".set");
  for (const std::string& set : overrides) all << set << '\n';
  std::ofstream(base.string() + ".error") << error;
}

}  // namespace takt::test

#pragma once
// Paths of the built programs, and their arguments in tests.
#include <filesystem>
#include <string>

namespace takt::test {

inline const std::string kBin = TAKT_BIN_DIR;
inline const std::filesystem::path kConfig = TAKT_CONFIG_DIR;
inline const std::string kBlockScenario = kConfig / "scenarios" / "block_assembly.yaml";

}  // namespace takt::test

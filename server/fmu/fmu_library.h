#pragma once
// FMUs in files, for cells: archive, description and process of each. Programs make one with the directory of
// --allow-fmus DIR and pass it to build_cell (ImportOptions::fmus).
#include <filesystem>

#include "server/devices/fmu_link.h"

namespace takt {

class FreshDirectory;

class FmuLibrary final : public FmuOpener {
 public:
  /// FMUs below `allowed` alone are opened; links are resolved for the decision. `host`: the program takt-fmu-host; empty:
  /// beside the running program.
  explicit FmuLibrary(std::filesystem::path allowed, std::filesystem::path host = {});
  /// Unpacks the FMU, checks the request against its description, and starts it once for its outputs at the start. What is
  /// unpacked stays as long as the offer's function `make` and what it made.
  FmuOffer open(const FmuRequest& request) override;
  FmuSystem open_system(const std::filesystem::path& file, const std::string& place) override;

 private:
  /// The file below the directory that is allowed, or of an open system. Throws ScenarioError.
  std::filesystem::path allowed_file(const std::filesystem::path& file, const std::string& place) const;

  std::filesystem::path allowed_, host_;
  std::vector<std::weak_ptr<const FreshDirectory>> systems_;
};

/// For programs: nullptr without a directory. Throws ScenarioError if it is not there.
std::unique_ptr<FmuLibrary> fmu_library(const std::filesystem::path& allowed);

}  // namespace takt

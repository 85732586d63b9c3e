#pragma once
// One run of takt-egm against a cell over DDS.
#include <filesystem>
#include <optional>
#include <string>

#include "client_lib/client.h"

namespace takt::tool {

struct EgmOptions {
  std::filesystem::path mapping;
  ClientOptions client{};
  std::string name = "takt-egm";
  bool lockstep = false;
  bool start = false;               ///< set the cell playing
  std::optional<double> until_s{};  ///< simulated time
};

/// Returns 0 at `until_s` or on a signal; 1 when the cell has another scenario. Throws with a sentence for a mapping, cell
/// or socket that cannot be used.
int run_egm(const EgmOptions& options);

}  // namespace takt::tool

#pragma once
// One run of takt-rsi against a cell over DDS.
#include <filesystem>
#include <optional>
#include <string>

#include "client_lib/client.h"

namespace takt::tool {

struct RsiOptions {
  std::filesystem::path mapping;
  ClientOptions client{};
  std::string name = "takt-rsi";
  bool lockstep = false;
  bool start = false;               ///< set the cell playing
  std::optional<double> until_s{};  ///< simulated time
};

/// Returns 0 when the other side has ended RSI, at `until_s`, or on a signal; 1 when RSI has stopped with an error.
/// Throws with a sentence for a mapping, cell or socket that cannot be used.
int run_rsi(const RsiOptions& options);

}  // namespace takt::tool

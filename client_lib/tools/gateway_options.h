#pragma once
// What takt-rsi and takt-egm take from the command line.
#include <filesystem>
#include <optional>
#include <string>

#include "client_lib/client.h"

namespace takt::tool {

struct GatewayOptions {
  std::filesystem::path mapping;
  ClientOptions client{};
  std::string name{};  ///< of the controller, in events and status
  bool lockstep = false;
  bool start = false;               ///< set the cell playing
  std::optional<double> until_s{};  ///< simulated time
};

}  // namespace takt::tool

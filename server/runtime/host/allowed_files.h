#pragma once
// Which files clients may name in requests: those below one directory, if there is one (takt-server
// --scenarios DIR). Without it, any file that the server can read.
#include <filesystem>
#include <string>

#include "server/runtime/requests/host_requests.h"

namespace takt {

/// Relative names become names below `directory`. Returns why the request is not allowed, as a sentence, or
/// nothing. Links are followed before it is decided.
std::string confine(HostAction& action, const std::filesystem::path& directory);

}  // namespace takt

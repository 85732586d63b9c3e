#pragma once
// Which files clients may name in requests: those below one directory, if there is one (takt-server
// --scenarios DIR). Without it, any file that the server can read.
#include <filesystem>
#include <string>

#include "takt_request_table.h"

namespace takt {

/// Relative names become names below `directory`. Returns why the request is not allowed, as a sentence, or
/// nothing. Links are followed before it is decided.
std::string confine(requests::Any& request, const std::filesystem::path& directory);

/// Without file:// in front.
std::filesystem::path file_of_uri(std::string uri);

}  // namespace takt

#pragma once
// Files that clients may name in requests: those below one directory (takt-server --scenarios DIR). Without
// the option, any file that the server can read.
#include <filesystem>
#include <string>

#include "takt_request_table.h"

namespace takt {

/// Relative names become names below `directory`. Returns a sentence with the reason if the request is not
/// allowed, else an empty text. Links are resolved for the decision, those that overrides name too. Pipes and devices are
/// refused with and without a directory.
std::string confine(requests::Any& request, const std::filesystem::path& directory);
/// The same for the name of one file or directory.
std::string confine(std::string& uri, const std::filesystem::path& directory);

/// Why the text of a scenario is not allowed in place of the file `scenario`, in a sentence: it names a file that is not below
/// the directory and that the scenario does not name so far. Empty: it is allowed, or it is no YAML. No directory allows all.
std::string confine_text(const std::string& text, const std::filesystem::path& directory,
                         const std::filesystem::path& scenario);

/// Without file:// in front.
std::filesystem::path file_of_uri(std::string uri);

}  // namespace takt

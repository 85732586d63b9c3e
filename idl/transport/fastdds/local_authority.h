#pragma once
// Security without preparation: an authority of this user on this machine, with one identity for each role, made at
// first use.
#include <filesystem>
#include <string>

namespace takt {

/// The word in place of a security directory that asks for it. "auto:ROLE": another role than the program's own.
inline constexpr const char* kAutomaticSecurity = "auto";

/// The directory for secure() (security.h) that `given` stands for: `given` itself, or for "auto" the identity of
/// `role` (server, controller, observer) in `state`/security. All roles are made together, once: a later use, also of
/// another process at the same time, finds them. The authority's key is not kept. Throws SecurityError, also if others
/// than this user can read or change the directory.
std::string security_directory(const std::string& given, const std::string& role,
                               const std::filesystem::path& state);
/// In the state directory of this user: $TAKT_STATE_DIR, else $XDG_STATE_HOME/takt, else ~/.local/state/takt.
std::string security_directory(const std::string& given, const std::string& role);

}  // namespace takt

#pragma once
// Describes the fault of the files of a security directory in a sentence. DDS decides on the identity; Fast
// DDS writes the reason of a refusal only to its log, without the file.
#include <cstdint>
#include <filesystem>
#include <string>

namespace takt {

/// Checks for certificates that are expired, of another authority, changed after signing, or not valid for
/// this domain (DDS-Security 1.1, 9.3 and 9.4). `directory` holds the files of kSecurityFiles (security.h).
/// Empty: no fault was found.
std::string identity_fault(const std::filesystem::path& directory, std::uint32_t domain);

/// For a refused participant: the fault, or, without one, its possible causes.
std::string refused_identity(const std::filesystem::path& directory, std::uint32_t domain);

}  // namespace takt

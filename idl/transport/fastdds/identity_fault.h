#pragma once
// What is wrong with the files of a security directory, in a sentence. DDS decides whether it takes an
// identity; of those it refuses this says why, which Fast DDS does in its log only, and there not of which
// file.
#include <cstdint>
#include <filesystem>
#include <string>

namespace takt {

/// Looks at what was expired, of another authority, changed after it was signed, or not meant for this domain
/// (DDS-Security 1.1, 9.3 and 9.4). `directory` holds the files of kSecurityFiles (security.h). Empty:
/// nothing was found.
std::string identity_fault(const std::filesystem::path& directory, std::uint32_t domain);

/// For who was refused: the fault, or, where none is found, what it may be.
std::string refused_identity(const std::filesystem::path& directory, std::uint32_t domain);

}  // namespace takt

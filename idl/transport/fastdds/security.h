#pragma once
// DDS-Security of a participant from one directory (made by config/dds/security/make_identities.sh): proof of
// identity (PKI-DH), access control by signed permissions, AES-GCM.
#include <filesystem>
#include <stdexcept>
#include <string>

#include "idl/transport/fastdds/fastdds.h"

namespace takt {

/// The directory is incomplete; what() is a whole sentence.
class SecurityError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// The required files of a directory.
inline constexpr const char* kSecurityFiles[] = {"identity_ca.pem",    "identity.pem",   "identity_key.pem",
                                                 "permissions_ca.pem", "governance.p7s", "permissions.p7s"};

/// Throws SecurityError.
void secure(dds::DomainParticipantQos& qos, const std::filesystem::path& directory);

}  // namespace takt

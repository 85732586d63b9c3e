#include "idl/transport/fastdds/security.h"

#include <unistd.h>
#include <system_error>

namespace takt {

void secure(dds::DomainParticipantQos& qos, const std::filesystem::path& directory) {
  std::error_code ignored;
  const auto absolute = std::filesystem::absolute(directory, ignored);
  for (const char* name : kSecurityFiles) {
    const auto file = absolute / name;
    if (access(file.c_str(), R_OK) == 0) continue;
    throw SecurityError("The security directory '" + directory.string() + "' has no readable file '" + name +
                        "'; config/dds/security/make_identities.sh makes such directories.");
  }
  auto& properties = qos.properties().properties();
  const auto set = [&](const char* name, const std::string& value) { properties.emplace_back(name, value); };
  const auto file = [&](const char* name) { return "file://" + (absolute / name).string(); };
  set("dds.sec.auth.plugin", "builtin.PKI-DH");
  set("dds.sec.auth.builtin.PKI-DH.identity_ca", file("identity_ca.pem"));
  set("dds.sec.auth.builtin.PKI-DH.identity_certificate", file("identity.pem"));
  set("dds.sec.auth.builtin.PKI-DH.private_key", file("identity_key.pem"));
  set("dds.sec.access.plugin", "builtin.Access-Permissions");
  set("dds.sec.access.builtin.Access-Permissions.permissions_ca", file("permissions_ca.pem"));
  set("dds.sec.access.builtin.Access-Permissions.governance", file("governance.p7s"));
  set("dds.sec.access.builtin.Access-Permissions.permissions", file("permissions.p7s"));
  set("dds.sec.crypto.plugin", "builtin.AES-GCM-GMAC");
}

}  // namespace takt

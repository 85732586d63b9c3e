#pragma once
// Fast DDS profiles (XML), one form of file for both majors of Fast DDS.
#include <string>
#include <string_view>

namespace takt {

/// Makes the profiles of a file known. False if it cannot be read; Fast DDS says why on the standard error.
bool load_profiles(const std::string& file);

/// `xml` with each `<RemoteServer prefix="...">` of a discoveryServersList, as Fast DDS 2 has it, replaced by
/// the addresses within, as Fast DDS 3 has it. What is incomplete stays as it is.
std::string with_servers_by_address(std::string_view xml);

}  // namespace takt

#pragma once
// Fast DDS profiles (XML), one file format for both majors of Fast DDS.
#include <string>
#include <string_view>

namespace takt {

/// Loads the profiles of a file. False if it cannot be read; Fast DDS writes the reason to the standard
/// error.
bool load_profiles(const std::string& file);

/// `xml` with each `<RemoteServer prefix="...">` of a discoveryServersList (the form of Fast DDS 2) replaced
/// by the addresses within (the form of Fast DDS 3). Incomplete elements stay unchanged.
std::string with_servers_by_address(std::string_view xml);

}  // namespace takt

#include "idl/transport/fastdds/profiles.h"

#include <fstream>
#include <iterator>

#include "idl/transport/fastdds/fastdds.h"

namespace takt {

bool load_profiles(const std::string& file) {
  auto* factory = dds::DomainParticipantFactory::get_instance();
  if constexpr (kServersByPrefix) return is_ok(factory->load_XML_profiles_file(file));
  std::ifstream stream(file);
  if (!stream) return false;
  const std::string xml = with_servers_by_address(std::string{std::istreambuf_iterator<char>(stream), {}});
  return is_ok(factory->load_XML_profiles_string(xml.data(), xml.size()));
}

std::string with_servers_by_address(std::string_view xml) {
  constexpr std::string_view begin = "<RemoteServer", end = "</RemoteServer>";
  constexpr std::string_view list = "<metatrafficUnicastLocatorList>",
                             list_end = "</metatrafficUnicastLocatorList>";
  std::string text;
  for (;;) {
    const auto server = xml.find(begin);
    const auto server_end = xml.find(end, server);
    const auto addresses = xml.find(list, server);
    const auto addresses_end = xml.find(list_end, addresses);
    if (server == xml.npos || server_end == xml.npos || addresses_end > server_end) break;
    text += xml.substr(0, server);
    text += xml.substr(addresses + list.size(), addresses_end - addresses - list.size());
    xml.remove_prefix(server_end + end.size());
  }
  return text.append(xml);
}

}  // namespace takt

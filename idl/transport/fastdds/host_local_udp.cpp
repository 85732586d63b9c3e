#include "idl/transport/fastdds/host_local_udp.h"

#include <ifaddrs.h>
#include <net/if.h>
#include <netinet/in.h>

#include <algorithm>
#include <cstring>
#include <string>

namespace takt {
namespace {

std::string text_of(const Ipv4& address) {
  std::string text;
  for (const std::uint8_t part : address) text += (text.empty() ? "" : ".") + std::to_string(part);
  return text;
}

}  // namespace

std::vector<Ipv4> local_ipv4_addresses() {
  std::vector<Ipv4> found{kLoopback};
  ifaddrs* interfaces = nullptr;
  if (getifaddrs(&interfaces) != 0) return found;
  for (const ifaddrs* i = interfaces; i != nullptr; i = i->ifa_next) {
    if (i->ifa_addr == nullptr || i->ifa_addr->sa_family != AF_INET || (i->ifa_flags & IFF_UP) == 0) continue;
    sockaddr_in socket_address{};
    std::memcpy(&socket_address, i->ifa_addr, sizeof(socket_address));
    Ipv4 address{};
    std::memcpy(address.data(), &socket_address.sin_addr, address.size());
    if (std::find(found.begin(), found.end(), address) == found.end()) found.push_back(address);
  }
  freeifaddrs(interfaces);
  return found;
}

ThisMachineUdp::ThisMachineUdp() {
  for (const Ipv4& address : local_ipv4_addresses()) interfaceWhiteList.push_back(text_of(address));
  TTL = 0;
}

bool LocalAddresses::has(const Ipv4& address) {
  if (address[0] == kLoopback[0]) return true;
  const std::lock_guard lock(mutex_);
  const auto known = [&] {
    return std::find(addresses_.begin(), addresses_.end(), address) != addresses_.end();
  };
  if (known()) return true;
  // Interfaces come and go; strangers must not make this costly.
  const auto now = std::chrono::steady_clock::now();
  if (now < looked_ + std::chrono::seconds(1)) return false;
  looked_ = now;
  addresses_ = local_ipv4_addresses();
  return known();
}

}  // namespace takt

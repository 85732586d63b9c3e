#include "client_lib/view/addresses.h"

#include <boost/asio/ip/address.hpp>
#include <boost/beast/core/string.hpp>

namespace takt::view {

namespace ip = boost::asio::ip;

std::string_view host_name(std::string_view host) {
  if (host.starts_with('[')) return host.substr(0, host.find(']') + 1);
  return host.substr(0, host.find(':'));
}

bool is_loopback(std::string_view name) {
  if (boost::beast::iequals({name.data(), name.size()}, "localhost")) return true;
  if (name.size() > 2 && name.front() == '[' && name.back() == ']') name = name.substr(1, name.size() - 2);
  boost::system::error_code problem;
  const ip::address address = ip::make_address(std::string(name), problem);
  if (problem) return false;
  if (address.is_v6() && address.to_v6().is_v4_mapped())
    return ip::make_address_v4(ip::v4_mapped, address.to_v6()).is_loopback();
  return address.is_loopback();
}

std::string host_in_url(const std::string& address) {
  boost::system::error_code problem;
  const ip::address read = ip::make_address(address, problem);
  if (problem) return address;
  if (read.is_unspecified()) return "localhost";
  return read.is_v6() ? "[" + address + "]" : address;
}

}  // namespace takt::view

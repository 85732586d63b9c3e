#pragma once
// Addresses to listen on, and the names by which browsers call them.
#include <string>
#include <string_view>

namespace takt::view {

/// The name in a Host header without its port: "localhost", "[::1]".
std::string_view host_name(std::string_view host);

/// True if an address, or the name in a Host header, can only mean this machine: localhost, 127.0.0.0/8, and ::1
/// with or without the brackets of a URL.
bool is_loopback(std::string_view name);

/// HOST in http://HOST:PORT/ for an address to listen on. For all networks (0.0.0.0, ::) it is localhost.
std::string host_in_url(const std::string& address);

}  // namespace takt::view

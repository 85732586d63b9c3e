#pragma once
// Addresses to listen on, and names that visitors call them by.
#include <string>
#include <string_view>

namespace takt::view {

/// Of a Host header, without its port: "localhost", "[::1]".
std::string_view host_name(std::string_view host);

/// Whether an address, or the name in a Host header, means this machine and can be nobody else's: localhost,
/// 127.0.0.0/8, ::1, with or without the brackets that it has in URLs.
bool is_loopback(std::string_view name);

/// For http://HOST:PORT/ of an address that is listened on. Of every network it is localhost.
std::string host_in_url(const std::string& address);

}  // namespace takt::view

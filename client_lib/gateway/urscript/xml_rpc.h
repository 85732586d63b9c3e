#pragma once
// XML-RPC over HTTP, as programs of URScript call it: requests, and replies in any of their parts.
//
//   http://HOST:PORT/PATH   POST, methodCall with params; the reply is a methodResponse with one value or a fault
//
// Types: integer int, real number double, True or False boolean, text string, list array, struct struct, pose a struct of x, y, z,
// rx, ry, rz. Functions on bytes: no sockets, no clock.
// Sources: XML-RPC specification (Winer, 1999); RFC 9112 (HTTP/1.1).
#include <optional>
#include <span>

#include "client_lib/gateway/urscript/value.h"

namespace takt::rpc {

struct Address {
  std::string host;
  std::uint16_t port = 80;
  std::string path = "/";
};
/// Of http://HOST[:PORT][/PATH]. Throws urscript::ValueError.
Address parse_url(const std::string& url);

/// The whole HTTP request. Throws urscript::ValueError for a value that has no type.
std::string request(const Address& address, const std::string& procedure,
                    std::span<const urscript::Value> arguments);

/// Puts a reply together.
class ReplyStream {
 public:
  static constexpr std::size_t kMostBytes = 1U << 20U;
  void add(std::string_view bytes);
  void close() { closed_ = true; }
  /// The result when the reply is complete; no value for nil. Throws urscript::ValueError for a fault of the procedure, another
  /// HTTP status than 200, and what is no reply.
  std::optional<urscript::Value> result() const;

 private:
  std::string bytes_;
  bool closed_ = false;
};

}  // namespace takt::rpc

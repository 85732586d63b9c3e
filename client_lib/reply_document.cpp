#include "client_lib/reply_document.h"

#include "client_lib/client.h"

namespace takt::client {

std::string reply_document(const std::map<std::string, std::string>& values, const std::string& request) {
  const auto broken = [&](const std::string& what) {
    return ClientError(ClientError::Kind::refused,
                       "The reply to " + request + " cannot be read: it has no " + what + ".");
  };
  const auto pieces = values.find("pieces");
  if (pieces == values.end()) throw broken("'pieces'");
  std::string text;
  for (std::size_t i = 0; std::to_string(i) != pieces->second; ++i) {
    const auto piece = values.find("document_" + std::to_string(i));
    if (piece == values.end()) throw broken("'document_" + std::to_string(i) + "'");
    text += piece->second;
  }
  return text;
}

}  // namespace takt::client

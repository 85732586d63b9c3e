#include "server/runtime/document_reply.h"

namespace takt {
namespace {
constexpr std::size_t kPiece = 4000;      // of the 4096 characters of a value
constexpr std::size_t kMostPieces = 240;  // of the 256 values of a reply
}  // namespace

bool add_document(ControlReply& reply, const std::string& text) {
  const std::size_t pieces = (text.size() + kPiece - 1) / kPiece;
  if (pieces > kMostPieces) return false;
  reply.values.emplace_back("pieces", std::to_string(pieces));
  for (std::size_t i = 0; i < pieces; ++i) {
    reply.values.emplace_back("document_" + std::to_string(i), text.substr(i * kPiece, kPiece));
  }
  return true;
}

}  // namespace takt

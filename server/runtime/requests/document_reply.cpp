#include "server/runtime/requests/document_reply.h"

#include <string_view>
#include <vector>

#include "idl/common/utf8.h"

namespace takt {
namespace {
constexpr std::size_t kPiece = 4000;     // of the 4096 characters of a value
constexpr std::size_t kMaxPieces = 240;  // of the 256 values of a reply
}  // namespace

bool add_document(ControlReply& reply, const std::string& text) {
  std::vector<std::string_view> pieces;
  for (std::string_view rest = text; !rest.empty(); rest.remove_prefix(pieces.back().size())) {
    if (pieces.size() == kMaxPieces) return false;
    pieces.push_back(rest.substr(0, utf8_prefix_size(rest, kPiece)));
  }
  reply.values.emplace_back("pieces", std::to_string(pieces.size()));
  for (std::size_t i = 0; i < pieces.size(); ++i)
    reply.values.emplace_back("document_" + std::to_string(i), pieces[i]);
  return true;
}

}  // namespace takt

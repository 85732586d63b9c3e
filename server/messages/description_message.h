#pragma once
// The description of a cell as a message, for clients without access to files.
#include <stdexcept>
#include <string>

#include "server/simulation/model/cell_description.h"
#include "takt_msgs.h"

namespace takt {

/// A cell does not fit its messages; what() is a whole sentence.
class MessageError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// A mesh of more triangles is refused when the cell is described.
inline constexpr std::size_t kMaxTriangles = 4'000'000;

/// Throws MessageError for a name or a text that is too long or no text, more elements than the IDL allows,
/// and a mesh that is too large.
takt_msgs::msg::CellDescription to_message(const CellDescription& cell, const std::string& server_version);

}  // namespace takt

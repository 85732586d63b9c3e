#pragma once
// The name by which participants of servers are recognised ahead of their topics.
#include <string_view>

namespace takt {

/// Followed by the name of the cell.
inline constexpr std::string_view kServerParticipant = "takt-server ";

}  // namespace takt

#pragma once
// Names of frames on the wire that are not names of a cell.

namespace takt {

/// W, the root of all frames.
inline constexpr const char* kWorldFrame = "world";

}  // namespace takt

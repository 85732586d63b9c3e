#pragma once
// SIGINT and SIGTERM end what follows something, in good order.

namespace takt::tool {

/// From now on a signal is noted instead of ending the process.
void note_interruptions();
bool interrupted();

}  // namespace takt::tool

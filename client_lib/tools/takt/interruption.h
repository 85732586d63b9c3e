#pragma once
// SIGINT and SIGTERM end a command that follows a cell in good order.

namespace takt::tool {

/// After this call SIGINT and SIGTERM are noted and do not end the process.
void note_interruptions();
bool interrupted();

}  // namespace takt::tool

#pragma once
// takt record with everything: states, contacts, power and events, one JSON document a line.
#include "client_lib/tools/takt/commands.h"

namespace takt::tool {

/// Ends at the simulated time that the options say, at a signal (SIGINT, SIGTERM), or when the server goes
/// away. Each line has a `kind`; the last one, `end`, counts what was written and what came but was not.
int record_all(const Common& common, const RecordOptions& options);

}  // namespace takt::tool

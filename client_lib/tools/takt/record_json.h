#pragma once
// takt record with everything: states, contacts, power and events, one JSON document a line.
#include "client_lib/tools/takt/commands.h"

namespace takt::tool {

/// Ends at the simulated time that the options say, or at a signal (SIGINT, SIGTERM). When the server goes
/// away before that time, it throws ClientError (lost); without such a time it goes on with the next server.
/// Each line has a `kind`. The last line, `end`, counts the written and the missed samples.
int record_json(const Common& common, const RecordOptions& options);

}  // namespace takt::tool

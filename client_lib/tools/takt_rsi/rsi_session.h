#pragma once
// One run of takt-rsi against a cell over DDS.
#include "client_lib/tools/gateway_options.h"

namespace takt::tool {

/// Returns 0 when the other side has ended RSI, at `until_s`, or on a signal; 1 when RSI has stopped with an error.
/// Throws with a sentence for a mapping, cell or socket that cannot be used.
int run_rsi(const GatewayOptions& options);

}  // namespace takt::tool

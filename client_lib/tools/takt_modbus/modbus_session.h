#pragma once
// One run of takt-modbus against a cell over DDS.
#include "client_lib/tools/gateway_options.h"

namespace takt::tool {

/// Returns 0 at `until_s` or on a signal; 1 when the cell has another scenario. Throws with a sentence for a mapping, cell
/// or socket that cannot be used.
int run_modbus(const GatewayOptions& options);

}  // namespace takt::tool

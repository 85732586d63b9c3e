#pragma once
// Packages of the real-time interface (TCP 30003) from the controller to its clients: int32 size of the whole package,
// then numbers of eight bytes, whole ones too.
#include <string>

#include "client_lib/gateway/rtde/variables.h"

namespace takt::rtde {

/// One package of a controller of software 5.`minor`: 1108 bytes before 5.4, 1116 before 5.9, 1140 before 5.10, then
/// 1220. `outputs`: the RTDE outputs.
std::string realtime_package(const Table& outputs, int minor);

}  // namespace takt::rtde

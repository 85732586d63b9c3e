#pragma once
// From what a scenario says about heat and devices to plant models with their descriptions.
#include <vector>

#include "server/geometry/mesh/triangle_mesh.h"
#include "server/scenario/scenario.h"
#include "server/simulation/model/cell_model.h"

namespace takt {

/// Name of the device that tells the temperature of a Part.
std::string heat_device_name(const std::string& part);

/// Name of the device that tells about the thread of a Part.
std::string thread_device_name(const std::string& part);

/// `meshes`: by component. Parts with a temperature come first, then what acts on them.
void add_devices(const Scenario& scenario, const std::vector<TriangleMesh>& meshes, CellModel& cell);

}  // namespace takt

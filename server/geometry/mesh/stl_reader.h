#pragma once
// STL files, text and binary: 3D Systems, "StereoLithography Interface Specification", 1989.
#include <string_view>
#include <vector>

#include "server/geometry/mesh/builder.h"

namespace takt {

/// The solids of the file, each an object; a binary file has one. The reader ignores normals and colours. A
/// file whose length fits the number of triangles at byte 80 is binary, whatever its first word. Binary
/// numbers have single precision (shortest_decimals). Throws MeshFault.
std::vector<NamedMesh> read_stl(std::string_view content);

}  // namespace takt

#pragma once
// COLLADA files (Khronos, 1.4.1 and 1.5.0): geometry of the scene alone. Only this file's source uses tinyxml2 here.
#include <string_view>
#include <vector>

#include "server/geometry/mesh/builder.h"

namespace takt {

/// The geometries of the file's scene, each instance an object, in metres by the file's <unit>. Read are <triangles>,
/// <polylist>, <polygons> without holes, <tristrips> and <trifans>, below nodes with <matrix>, <translate>, <rotate> and
/// <scale>; those of skins stand as they are modelled. <up_axis> is ignored, as programs of ROS do: robot descriptions
/// count on it. A file without scene is the sum of its geometries. Throws MeshFault.
std::vector<NamedMesh> read_dae(std::string_view content);

}  // namespace takt

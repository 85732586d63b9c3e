#pragma once
// OBJ files: Wavefront, "Object Files (.obj)", Appendix B1 of the Advanced Visualizer manual.
#include <string_view>
#include <vector>

#include "server/geometry/mesh/builder.h"

namespace takt {

/// The objects of the file, in its order. The reader uses vertices (v), faces (f), objects and groups (o, g)
/// and ignores normals, texture coordinates, materials and all other lines. An o or g with a name other than
/// that of the present object begins a new one. A fourth number of a vertex is its weight, which divides the
/// other three; more than four numbers are a colour. Polygons are cut into triangles (cut_polygon). Throws
/// MeshFault.
std::vector<NamedMesh> read_obj(std::string_view content);

}  // namespace takt

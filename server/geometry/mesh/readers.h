#pragma once
// Readers of mesh files: what a file contains, as objects. They throw MeshFault.
#include <cstddef>
#include <string_view>
#include <vector>

#include "server/geometry/mesh/builder.h"

namespace takt {

/// OBJ (Wavefront, "Object Files (.obj)", Appendix B1 of the Advanced Visualizer manual): the objects of the
/// file, in its order. The reader uses vertices (v), faces (f), objects and groups (o, g) and ignores normals,
/// texture coordinates, materials and all other lines. An o or g with a name other than that of the present
/// object begins a new one. A fourth number of a vertex is its weight, which divides the other three; more than
/// four numbers are a colour. Polygons are cut into triangles (cut_polygon).
std::vector<NamedMesh> read_obj(std::string_view content);

/// STL, text and binary (3D Systems, "StereoLithography Interface Specification", 1989): the solids of the
/// file, each an object; a binary file has one. The reader ignores normals and colours. A file whose length
/// fits the number of triangles at byte 80 is binary, whatever its first word. Binary numbers have single
/// precision (shortest_decimals).
std::vector<NamedMesh> read_stl(std::string_view content);

/// Largest number of triangles that all nodes of a GLB file may show together, and deepest nesting of nodes.
inline constexpr std::size_t kMaxGlbTriangles = 20'000'000;
inline constexpr std::size_t kMaxGlbDepth = 200;

/// GLB (binary glTF 2.0, sections 3.5 to 3.7 and 4.4): each node with a mesh is an object, in the order of the
/// tree, with the transforms of the nodes applied. The axes are those of the file: y up is kept. Coordinates
/// have single precision (shortest_decimals). Materials, pictures, animations, skins and extensions are
/// ignored. A fault names its place (mesh, node, accessor).
std::vector<NamedMesh> read_glb(std::string_view content);

}  // namespace takt

#pragma once
// The same shapes from coarse to fine: refinements of verification reports.
#include <filesystem>

namespace takt::meshes {

/// sphere_3.obj to sphere_6.obj: an icosahedron divided so often, radius 25 mm; each level halves the edges.
/// bolt_N.obj and nut_N.obj, N = 1 to 3: M16 of make_screw_meshes, elements 1.4, 1 and 0.7 times as large.
void make_mesh_families(const std::filesystem::path& directory);

}  // namespace takt::meshes

#pragma once
// Collada files (.dae): surfaces with colours for pictures. Simulation does not use them. The reader stands beside that of GLB
// files, by the same library (glb_reader.cpp).
#include <array>
#include <filesystem>
#include <string>
#include <vector>

#include "server/geometry/mesh/triangle_mesh.h"

namespace takt {

struct ColoredMesh {
  TriangleMesh mesh;
  std::array<float, 3> color;  ///< diffuse, red, green, blue in 0..1
};

/// One mesh for each material of a node, in m, in the axes of the file: its unit counts, its <up_axis> does not, as in RViz.
/// Throws MeshFault for a file that cannot be understood or has no triangles.
std::vector<ColoredMesh> read_collada(const std::filesystem::path& file);

}  // namespace takt

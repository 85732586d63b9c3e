#pragma once
// `takt-run check-mesh FILE`: the findings of the import of a mesh, as a table. Of a GLB file with
// several nodes also the nodes: size, place, and whether each is closed.
#include <filesystem>
#include <iosfwd>

namespace takt {

struct MeshCheckOptions {
  double scale = 1.0;
  double element_edge_m = 0.0;  ///< as it would be divided for contact; 0: not
};

/// False if the mesh cannot be used. Throws MeshError for a file that cannot be read.
bool print_mesh_check(std::ostream& out, const std::filesystem::path& file, const MeshCheckOptions& options);

}  // namespace takt

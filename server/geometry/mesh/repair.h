#pragma once
// Repairs the faults of a mesh that have one unambiguous remedy, and reports the others.
#include <string>
#include <vector>

#include "server/geometry/mesh/diagnostic.h"
#include "server/geometry/mesh/triangle_mesh.h"

namespace takt {

struct RepairedMesh {
  TriangleMesh mesh;  ///< unchanged without findings; vertices keep number and place
  std::vector<MeshDiagnostic> findings;
  std::string problem;  ///< result of check_closed for `mesh`; empty: it bounds a solid
};

/// In this order:
/// - faces that name a vertex twice are removed; of several equal faces one stays if the surface needs it to
///   be closed, else they are all removed;
/// - a face whose corners lie on one line is removed by turning the edge it shares with its neighbour;
/// - open edges are divided at vertices of other open edges that lie on them, within single precision: no
///   vertex moves;
/// - open edges and edges of more than two faces are refused;
/// - faces turned against their neighbours are turned back, the smaller number of each shell;
/// - an outermost shell that is inside out is turned, together with the shells inside it. Shells inside
///   others keep their orientation: they are cavities if they face inwards. Shells that enclose no volume are
///   removed.
RepairedMesh repair_mesh(const TriangleMesh& mesh);

}  // namespace takt

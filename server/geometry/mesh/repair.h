#pragma once
// Puts right what can be put right in a mesh without guessing, and says what cannot.
#include <string>
#include <vector>

#include "server/geometry/mesh/diagnostic.h"
#include "server/geometry/mesh/triangle_mesh.h"

namespace takt {

struct RepairedMesh {
  TriangleMesh mesh;  ///< as it was where nothing was found; vertices keep number and place
  std::vector<MeshDiagnostic> findings;
  std::string problem;  ///< what check_closed says of it; empty: it bounds a solid
};

/// In this order:
/// - faces that name a vertex twice are removed, and of faces that are there several times as many as close
///   the surface (one, or none where the others do without);
/// - a face whose corners lie on one line is removed by turning the edge it shares with its neighbour;
/// - open edges and edges of more than two faces are refused;
/// - faces turned against their neighbours are turned back, the smaller number of each shell;
/// - an outermost shell that is inside out is turned, with all that lies in it. Shells inside others stay as
///   they are: cavities if they face inwards. Shells that enclose nothing are removed.
RepairedMesh repair_mesh(const TriangleMesh& mesh);

}  // namespace takt

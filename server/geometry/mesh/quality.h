#pragma once
// Mesh quality: defects of a mesh that would falsify the forces of surface contact (thesis 2.2.2: forces act
// element by element, so the size of the elements and the edges between them matter). Repair: repair.h.
#include <string>
#include <string_view>
#include <vector>

#include "server/geometry/mesh/diagnostic.h"
#include "server/geometry/mesh/triangle_mesh.h"

namespace takt {

/// Stands in remedies for the name of a component.
inline constexpr std::string_view kAnyComponent = "NAME";

struct MeshQualityOptions {
  /// Name of the component in remedies ("set contact.components.NAME.element_edge_m to ...").
  std::string component{kAnyComponent};
  /// True for a mesh that may carry the contact elements (Base). The mesh of a Target may be coarse.
  bool carries_elements = true;
  /// Its triangles will be divided to this edge for contact (refine_to_edge); 0: they stay.
  double element_edge_m = 0.0;
  double elements_across = 8.0;       ///< fewer across a contact face are reported
  double contact_face_share = 0.1;    ///< faces with a smaller share of the surface are ignored
  double smooth_angle_rad = 0.5236;   ///< faces meet smoothly up to this angle between their normals (30 deg)
  double sharp_angle_rad = 1.3963;    ///< convex edges with a larger angle are sharp (80 deg)
  double warning_angle_rad = 1.9199;  ///< a larger angle is a warning (110 deg)
  double sharp_length_m = 0.001;      ///< a shorter total length of sharp edges is not reported
  double needle_ratio = 30.0;         ///< of longest edge and height on it
  /// Of single precision, in which files are read; coarser resolution is reported.
  double resolution_m = 1e-7;
  double far_ratio = 10.0;  ///< ... of a body further from its origin than this many diagonals
};

/// Needles, sharp edges, coarse faces, distance from the origin. `mesh` must be closed (check_closed).
std::vector<MeshDiagnostic> check_mesh_quality(const TriangleMesh& mesh, const MeshQualityOptions& options);

/// The remedy of a finding for any component, with the name of this one.
std::string remedy_for(const std::string& component, const MeshDiagnostic& finding);

}  // namespace takt

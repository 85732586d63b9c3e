#pragma once
// Triangles of a solid's faces, closed where one of several ways of meshing gives a closed surface.
#include <TopoDS_Shape.hxx>
#include <cstddef>
#include <vector>

#include "server/geometry/mesh/triangle_mesh.h"

namespace takt::cad {

struct TriangulatedSolid {
  TopoDS_Shape
      shape;  ///< whose faces the triangles are of: the given one, or one whose faces are divided, mended or sewn
  TriangleMesh mesh;  ///< mm; vertices of neighbouring faces are one
  std::vector<int>
      triangle_faces;          ///< by triangle: number of the face in `shape`, as TopExp_Explorer visits them
  std::size_t open_edges = 0;  ///< 0: closed
  double sewn_gap_mm = 0.0;    ///< between the faces of the given one, where they are sewn
};

/// OpenCASCADE's mesher leaves faces out whose parameters it cannot divide: closed faces whose seam is off the
/// vertex by rounding, faces of small edges. In this order: the solid as it is; closed faces divided; finer; coarser in
/// angle; mended by ShapeFix; sewn. The first closed surface counts, else the one with the fewest open edges.
TriangulatedSolid triangulate(const TopoDS_Shape& solid, double deflection_mm, double angle_rad);

/// The solid as it is, its faces within distances of their own (mm, as TopExp_Explorer visits them; 0: `deflection_mm`).
TriangulatedSolid triangulate_faces(const TopoDS_Shape& solid, double deflection_mm, double angle_rad,
                                    const std::vector<double>& face_deflections_mm);

}  // namespace takt::cad

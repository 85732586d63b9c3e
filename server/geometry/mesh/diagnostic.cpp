#include "server/geometry/mesh/diagnostic.h"

#include <cmath>
#include <sstream>

namespace takt {

std::string_view to_string(MeshDiagnosticKind kind) {
  switch (kind) {
    case MeshDiagnosticKind::bad_vertex:
      return "bad vertex";
    case MeshDiagnosticKind::no_faces:
      return "lines or points";
    case MeshDiagnosticKind::joined_objects:
      return "joined objects";
    case MeshDiagnosticKind::near_vertices:
      return "near vertices";
    case MeshDiagnosticKind::touching_edges:
      return "touching edges";
    case MeshDiagnosticKind::split_edges:
      return "vertices on edges";
    case MeshDiagnosticKind::zero_area_faces:
      return "faces without area";
    case MeshDiagnosticKind::duplicate_faces:
      return "duplicate faces";
    case MeshDiagnosticKind::open_edges:
      return "open edges";
    case MeshDiagnosticKind::crowded_edges:
      return "edges of more than two faces";
    case MeshDiagnosticKind::not_orientable:
      return "surface with one side";
    case MeshDiagnosticKind::mixed_orientation:
      return "mixed orientation";
    case MeshDiagnosticKind::inside_out:
      return "inside out";
    case MeshDiagnosticKind::encloses_nothing:
      return "encloses nothing";
    case MeshDiagnosticKind::cavities:
      return "cavities";
    case MeshDiagnosticKind::nested_solids:
      return "solids inside others";
    case MeshDiagnosticKind::needles:
      return "needle triangles";
    case MeshDiagnosticKind::sharp_edges:
      return "sharp edges";
    case MeshDiagnosticKind::coarse:
      return "coarse for contact";
    case MeshDiagnosticKind::far_from_origin:
      return "far from the origin";
  }
  return "";
}

std::string_view remedy_of(MeshDiagnosticKind kind) {
  switch (kind) {
    case MeshDiagnosticKind::bad_vertex:
      return "export the mesh again: in Blender by File > Export, after Mesh > Clean Up > Delete Loose";
    case MeshDiagnosticKind::no_faces:
      return "nothing to do: they are passed over";
    case MeshDiagnosticKind::joined_objects:
      return "nothing to do; in Blender, Object > Join and Mesh > Merge > By Distance make one surface of "
             "them";
    case MeshDiagnosticKind::near_vertices:
      return "in Blender: Mesh > Merge > By Distance makes one of them";
    case MeshDiagnosticKind::touching_edges:
      return "in Blender: modifier Boolean, Union; in FreeCAD: Part > Boolean > Union, of bodies that "
             "overlap a little";
    case MeshDiagnosticKind::split_edges:
      return "in Blender, the modifier Triangulate before the export makes faces meet at their corners";
    case MeshDiagnosticKind::zero_area_faces:
      return "in Blender: Mesh > Merge > By Distance, then Mesh > Clean Up > Degenerate Dissolve";
    case MeshDiagnosticKind::duplicate_faces:
      return "in Blender: Mesh > Merge > By Distance removes them";
    case MeshDiagnosticKind::open_edges:
      return "export a solid, not a surface (in FreeCAD: Part > Convert to Solid); or close the hole: in "
             "Blender Select > All by Trait > Non Manifold shows it, Mesh > Clean Up > Fill Holes closes it";
    case MeshDiagnosticKind::crowded_edges:
      return "unite bodies that touch (in Blender: modifier Boolean, Union; in FreeCAD: Part > Boolean > "
             "Union), delete walls inside (in Blender: Select > All by Trait > Interior Faces), or give each "
             "body an object of its own";
    case MeshDiagnosticKind::not_orientable:
    case MeshDiagnosticKind::encloses_nothing:
      return "give the surface thickness: in Blender by the modifier Solidify, in FreeCAD by Part > Offset > "
             "3D Offset";
    case MeshDiagnosticKind::mixed_orientation:
    case MeshDiagnosticKind::inside_out:
      return "in Blender: Mesh > Normals > Recalculate Outside";
    case MeshDiagnosticKind::cavities:
      return "nothing to do where that is meant; nothing gets in";
    case MeshDiagnosticKind::nested_solids:
      return "remove what lies inside, or turn it where a cavity is meant: in Blender select it by Select > "
             "Select Linked, then Mesh > Delete, or Mesh > Normals > Flip";
    case MeshDiagnosticKind::needles:
      return "mesh it again with triangles of even size (in FreeCAD: Mesh > Create mesh from shape, Gmsh; in "
             "Blender: modifier Remesh); element_edge_m makes needles shorter, but no less slender";
    case MeshDiagnosticKind::sharp_edges:
      return "chamfer or round the edges that slide over others: in FreeCAD by Part > Chamfer, in Blender by "
             "the modifier Bevel";
    case MeshDiagnosticKind::coarse:
      return "mesh it finer (in Blender: modifier Subdivide)";
    case MeshDiagnosticKind::far_from_origin:
      return "move the mesh to the origin of its frame (in Blender: Object > Set Origin > Origin to "
             "Geometry, then Object > Clear > Location), and the component by its key `pose`";
  }
  return "";
}

std::string_view to_string(MeshSeverity severity) {
  switch (severity) {
    case MeshSeverity::info:
      return "info";
    case MeshSeverity::warning:
      return "warning";
    case MeshSeverity::repaired:
      return "repaired";
    case MeshSeverity::refused:
      return "refused";
  }
  return "";
}

std::string place_text(const Vec3& p) {
  std::ostringstream text;
  text.precision(6);
  // To the nanometre; + 0: no -0.
  const auto rounded = [](double x) { return std::round(x * 1e9) / 1e9 + 0.0; };
  text << "(" << rounded(p.x()) << ", " << rounded(p.y()) << ", " << rounded(p.z()) << ") m";
  return text.str();
}

}  // namespace takt

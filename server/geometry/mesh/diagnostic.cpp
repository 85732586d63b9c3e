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

std::string counted(std::size_t count, const char* one, const char* many) {
  return std::to_string(count) + " " + (count == 1 ? one : many);
}

}  // namespace takt

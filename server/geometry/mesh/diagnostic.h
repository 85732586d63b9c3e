#pragma once
// A finding about a mesh, with number, place and remedy, for users.
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include "plant_models/spatial.h"

namespace takt {

enum class MeshDiagnosticKind : std::uint8_t {
  bad_vertex,         ///< not finite, or missing
  no_faces,           ///< lines and points, which bound nothing; figure: 0
  joined_objects,     ///< closed together only; figure: 0
  near_vertices,      ///< equal within single precision; figure: their largest distance (m)
  touching_edges,     ///< of bodies that touch there; figure: 0
  split_edges,        ///< with vertices on them; figure: largest distance of such a vertex (m)
  zero_area_faces,    ///< figure: 0
  duplicate_faces,    ///< figure: 0
  open_edges,         ///< figure: their length (m)
  crowded_edges,      ///< of more than two faces; figure: most faces of one
  not_orientable,     ///< a surface with one side only
  mixed_orientation,  ///< figure: 0
  inside_out,         ///< closed shells; figure: largest volume (m^3)
  encloses_nothing,   ///< closed shells; figure: largest volume (m^3)
  cavities,           ///< shells inside another, facing inwards; figure: their volume (m^3)
  nested_solids,      ///< shells inside another, facing outwards; figure: their volume (m^3)
  needles,            ///< figure: worst ratio of longest edge and height on it
  sharp_edges,        ///< figure: largest angle between the normals (degrees)
  coarse,             ///< for surface contact; figure: fewest elements across a contact face
  far_from_origin,    ///< figure: resolution of single precision there (m)
};
/// "duplicate faces"
std::string_view to_string(MeshDiagnosticKind kind);

/// What a person can do about it, in a program that is at hand or by a key of takt: a step, without full stop.
std::string_view remedy_of(MeshDiagnosticKind kind);

enum class MeshSeverity : std::uint8_t {
  info,      ///< for information
  warning,   ///< the mesh can be used, but forces of surface contact may be wrong
  repaired,  ///< the mesh was changed
  refused,   ///< the mesh cannot be used
};
std::string_view to_string(MeshSeverity severity);

struct MeshDiagnostic {
  MeshDiagnosticKind kind = MeshDiagnosticKind::bad_vertex;
  MeshSeverity severity = MeshSeverity::info;
  std::size_t count = 0;        ///< number of vertices, faces, edges or shells
  double figure = 0.0;          ///< see the kind
  Vec3 place_B = Vec3::Zero();  ///< of the worst finding; of the first one if all are alike
  std::string sentence;         ///< kind, figure and place
  std::string remedy;           ///< what to do, or what the repair did
};

/// Parts of sentences: "(0.1, 0, 0.2) m"; a number with the given digits.
std::string place_text(const Vec3& p_B);

}  // namespace takt

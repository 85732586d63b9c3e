#pragma once
// Notes of the cell about meshes of components: repairs, and defects that would falsify forces of surface
// contact.
#include <filesystem>
#include <string>

#include "server/geometry/mesh/quality.h"
#include "server/simulation/model/cell_model.h"

namespace takt {

/// The file's solid, repaired; a note for each repair and warning. Throws MeshError for a mesh that bounds no
/// solid.
TriangleMesh import_component_mesh(const std::string& component, const std::filesystem::path& file,
                                   double scale, CellModel& cell);

/// A note for each warning of check_mesh_quality.
void note_contact_risks(const TriangleMesh& mesh, const MeshQualityOptions& options, CellModel& cell);

}  // namespace takt

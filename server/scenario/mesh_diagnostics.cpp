#include <utility>
#include <vector>

#include "idl/common/mesh_path.h"
#include "server/geometry/mesh/quality.h"
#include "server/scenario/cell_builders.h"

namespace takt {

namespace {

void note(const std::string& component, const std::string& what, const std::vector<MeshDiagnostic>& findings,
          CellModel& cell) {
  for (const MeshDiagnostic& finding : findings) {
    if (finding.severity < MeshSeverity::warning) continue;
    const char* remedy = finding.severity == MeshSeverity::repaired ? "; " : ". Remedy: ";
    cell.import_notes.push_back(
        {component,
         component + ": in " + what + " " + finding.sentence + remedy + remedy_for(component, finding) + ".",
         {}});
  }
}

}  // namespace

std::shared_ptr<SharedMesh> import_component_mesh(const std::string& component,
                                                  const std::filesystem::path& file, double scale,
                                                  MeshLibrary& library, CellModel& cell) {
  std::shared_ptr<SharedMesh> mesh = library.mesh(file, scale);
  note(component, mesh_label(file), mesh->findings(), cell);
  return mesh;
}

void note_contact_risks(const std::string& component, SharedMesh& mesh, const MeshUse& use, CellModel& cell) {
  std::vector<MeshDiagnostic> findings = mesh.quality(use.element_edge_m, use.carries_elements);
  if (use.resampled)
    std::erase_if(findings, [](const MeshDiagnostic& f) { return f.kind == MeshDiagnosticKind::needles; });
  note(component, "its mesh", findings, cell);
}

}  // namespace takt

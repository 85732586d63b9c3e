#include <utility>
#include <vector>

#include "idl/common/mesh_path.h"
#include "server/geometry/mesh/import.h"
#include "server/scenario/cell_builders.h"

namespace takt {

namespace {

void note(const std::string& component, const std::string& what, const std::vector<MeshDiagnostic>& findings,
          CellModel& cell) {
  for (const MeshDiagnostic& finding : findings) {
    if (finding.severity < MeshSeverity::warning) continue;
    const char* remedy = finding.severity == MeshSeverity::repaired ? "; " : ". Remedy: ";
    cell.import_notes.push_back(
        {component, component + ": in " + what + " " + finding.sentence + remedy + finding.remedy + ".", {}});
  }
}

}  // namespace

TriangleMesh import_component_mesh(const std::string& component, const std::filesystem::path& file,
                                   double scale, CellModel& cell) {
  RepairedMesh repaired = import_repaired_solid(file, scale);
  note(component, mesh_label(file), repaired.findings, cell);
  return std::move(repaired.mesh);
}

void note_contact_risks(const TriangleMesh& mesh, const MeshQualityOptions& options, CellModel& cell) {
  note(options.component, "its mesh", check_mesh_quality(mesh, options), cell);
}

}  // namespace takt

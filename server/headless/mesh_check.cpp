#include "server/headless/mesh_check.h"

#include <algorithm>
#include <iomanip>
#include <ostream>
#include <stdexcept>
#include <string>

#include "idl/common/mesh_path.h"
#include "idl/common/text.h"
#include "server/geometry/mesh/import.h"
#include "server/geometry/mesh/quality.h"
#include "server/geometry/mesh/refinement.h"
#include "server/geometry/mesh/shells.h"
#include "server/geometry/surface/contact_surface.h"
#include "server/scenario/world_bounds.h"

namespace takt {

namespace {

void print_facts(std::ostream& out, const TriangleMesh& mesh) {
  const Aabb box = bounds_of(mesh);
  const Vec3 size = 1e3 * (box.upper - box.lower);
  out << mesh.vertices.size() << " vertices, " << mesh.triangles.size() << " triangles, "
      << number_text(size.x(), 4) << " x " << number_text(size.y(), 4) << " x " << number_text(size.z(), 4)
      << " mm, longest edge " << number_text(1e3 * longest_edge(mesh), 4) << " mm";
}

void print_table(std::ostream& out, const std::vector<MeshDiagnostic>& findings) {
  std::size_t widest = 0;
  for (const MeshDiagnostic& f : findings) widest = std::max(widest, to_string(f.kind).size());
  for (const MeshDiagnostic& f : findings) {
    const auto column = static_cast<int>(widest);
    out << std::left << std::setw(10) << to_string(f.severity) << std::setw(column + 2) << to_string(f.kind)
        << f.sentence << ".\n"
        << std::string(widest + 12, ' ')
        << (f.severity == MeshSeverity::repaired || f.severity == MeshSeverity::info ? "" : "Remedy: ")
        << f.remedy << ".\n";
  }
}

/// The nodes of a GLB file that has several, each as a mesh of its own.
void print_nodes(std::ostream& out, const std::filesystem::path& file, double scale, MeshFiles& files) {
  const std::vector<MeshNode> nodes = list_mesh_nodes(file, scale, files);
  if (nodes.size() < 2) return;
  const MeshPath path = split_mesh_path(file);
  out << nodes.size() << " nodes; one of them is the mesh " << path.file.filename().string()
      << "#NAME, its place (z up) is that of at_node:\n";
  std::size_t widest = 0;
  for (const MeshNode& node : nodes) widest = std::max(widest, node.path.size());
  for (const MeshNode& node : nodes) {
    const RepairedMesh mesh = import_and_repair(path.file.string() + "#" + node.path, scale, files);
    out << "  " << std::left << std::setw(static_cast<int>(widest) + 2) << node.path;
    const bool has_below = std::any_of(nodes.begin(), nodes.end(), [&](const MeshNode& other) {
      return other.path.starts_with(node.path + "/");
    });
    if (has_below) out << "with the nodes below it: ";
    print_facts(out, mesh.mesh);
    out << ", at " << place_text(upright(node.X_FN).p) << ", "
        << (mesh.problem.empty() ? "closed" : "not closed: " + mesh.problem) << '\n';
  }
}

void print_odd_size(std::ostream& out, const TriangleMesh& mesh, double scale) {
  const Aabb box = bounds_of(mesh);
  const double longest = (box.upper - box.lower).maxCoeff();
  if (!(longest > kOddSize_m)) return;
  out << "Odd: it is " << number_text(longest, 4)
      << " m long. Is the file in millimetres? Then set mesh_scale: " << number_text(0.001 * scale, 4)
      << " (here: --scale " << number_text(0.001 * scale, 4) << ").\n";
}

/// What contact.resample: auto does to the elements; empty: nothing, or more elements than a scenario may have.
std::string resampled_cells(const TriangleMesh& mesh, double element_edge_m) {
  try {
    const ContactSurface surface(mesh, {element_edge_m, ContactResampling::automatic});
    return surface.resampling().spacing_m > 0.0 ? sentence_of(surface.resampling()) : "";
  } catch (const std::invalid_argument&) {
    return "";
  }
}

}  // namespace

bool print_mesh_check(std::ostream& out, const std::filesystem::path& file, const MeshCheckOptions& options) {
  MeshFiles files;
  RepairedMesh repaired = import_and_repair(file, options.scale, files);
  const bool usable = repaired.problem.empty();
  out << file.string() << ": ";
  print_facts(out, repaired.mesh);
  if (usable) {
    out << ", volume " << number_text(1e6 * volume_properties(repaired.mesh).volume, 6) << " cm^3, "
        << counted(find_shells(repaired.mesh).size(), "shell", "shells") << '\n';
    MeshQualityOptions contact;
    contact.element_edge_m =
        options.element_edge_m > 0.0 ? options.element_edge_m : default_element_edge_m(repaired.mesh);
    std::vector<MeshDiagnostic> risks = check_mesh_quality(repaired.mesh, contact);
    if (const std::string cells = resampled_cells(repaired.mesh, contact.element_edge_m); !cells.empty()) {
      out << "Contact: " << cells << ".\n";
      std::erase_if(risks, [](const MeshDiagnostic& f) { return f.kind == MeshDiagnosticKind::needles; });
    }
    repaired.findings.insert(repaired.findings.end(), risks.begin(), risks.end());
  } else {
    out << '\n';
  }
  print_nodes(out, file, options.scale, files);
  std::stable_sort(repaired.findings.begin(), repaired.findings.end(),
                   [](const MeshDiagnostic& a, const MeshDiagnostic& b) { return a.severity > b.severity; });
  if (!repaired.mesh.vertices.empty()) print_odd_size(out, repaired.mesh, options.scale);
  print_table(out, repaired.findings);
  if (!usable)
    out << "Unusable: " << repaired.problem
        << " A solid is needed: closed, every edge shared by two triangles, faces outwards.\n";
  else
    out << (repaired.findings.empty() ? "Nothing to report.\n" : "Usable.\n");
  return usable;
}

}  // namespace takt

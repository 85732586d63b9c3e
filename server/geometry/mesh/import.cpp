#include "server/geometry/mesh/import.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <sstream>
#include <string_view>
#include <utility>

#include "idl/common/bounded_file.h"
#include "idl/common/mesh_path.h"
#include "idl/common/text.h"
#include "server/geometry/mesh/dae_reader.h"
#include "server/geometry/mesh/glb_reader.h"
#include "server/geometry/mesh/obj_reader.h"
#include "server/geometry/mesh/stl_reader.h"

namespace takt {
namespace {

[[noreturn]] void fail(const std::filesystem::path& file, const std::string& problem) {
  throw MeshError("mesh file " + file.string() + ": " + problem);
}

std::string format_of(const std::filesystem::path& file) {
  return lower_text(file.extension().string());
}

bool is_known(const std::string& format) {
  return format == ".obj" || format == ".stl" || format == ".glb" || format == ".dae";
}

/// As text, 4 million triangles take half of it.
constexpr std::size_t kLargestMesh_MB = 1024;

std::string read_file(const std::filesystem::path& file) {
  std::error_code error;
  const auto status = std::filesystem::status(file, error);
  if (status.type() == std::filesystem::file_type::not_found) fail(file, "there is no such file.");
  if (!std::filesystem::is_regular_file(status)) fail(file, "this is not a regular file.");
  FileText read = read_bounded_file(file, kLargestMesh_MB);
  if (!read.problem.empty()) fail(file, read.problem + ".");
  if (read.text.find_first_not_of(" \t\r\n") == read.text.npos) fail(file, "the file is empty.");
  return std::move(read.text);
}

void apply_scale(const std::filesystem::path& file, double scale, NamedMesh& object) {
  for (std::size_t i = 0; i < object.mesh.vertices.size(); ++i) {
    Vec3& p = object.mesh.vertices[i];
    const Vec3 p_F = p;
    p = p * scale + Vec3::Zero();  // + 0: -0 becomes 0
    if (p.allFinite()) continue;
    std::ostringstream text;
    text << "object '" << object.name << "', vertex " << i << ": the position (" << p_F.transpose()
         << ") times " << scale << " is not finite.";
    fail(file, text.str());
  }
}

void append(TriangleMesh& whole, const TriangleMesh& piece) {
  const auto offset = static_cast<std::uint32_t>(whole.vertices.size());
  whole.vertices.insert(whole.vertices.end(), piece.vertices.begin(), piece.vertices.end());
  for (const auto& t : piece.triangles)
    whole.triangles.push_back({t[0] + offset, t[1] + offset, t[2] + offset});
}

/// Equal positions merged across objects.
TriangleMesh joined(const TriangleMesh& pieces) {
  MeshBuilder builder;
  const auto vertex = [&](std::uint32_t i) { return builder.vertex(builder.position(pieces.vertices[i])); };
  for (const auto& t : pieces.triangles) builder.add_triangle({vertex(t[0]), vertex(t[1]), vertex(t[2])});
  return std::move(builder.take_objects().front().mesh);
}

/// A sheet without thickness, which alone makes the object unusable.
bool encloses_nothing(const RepairedMesh& object) {
  bool nothing = false;
  for (const MeshDiagnostic& finding : object.findings) {
    if (finding.severity != MeshSeverity::refused) continue;
    if (finding.kind != MeshDiagnosticKind::encloses_nothing) return false;
    nothing = true;
  }
  return nothing;
}

[[noreturn]] void fail_no_solid(const std::filesystem::path& file, const std::string& problem) {
  fail(file,
       problem +
           " A solid is needed: closed, every edge shared by two triangles, faces outwards. `takt-run " +
           "check-mesh " + file.string() + "` lists the faults and their remedies.");
}

}  // namespace

MeshFiles::MeshFiles() = default;
MeshFiles::~MeshFiles() = default;

const GlbFile& MeshFiles::glb(const std::filesystem::path& file) {
  std::unique_ptr<const GlbFile>& glb = glb_[file];
  if (glb == nullptr) glb = std::make_unique<const GlbFile>(read_file(file));
  return *glb;
}

void MeshFiles::add(const std::filesystem::path& name, std::vector<NamedMesh> objects) {
  added_[name] = std::move(objects);
}

const std::vector<NamedMesh>* MeshFiles::added(const std::filesystem::path& name) const {
  const auto place = added_.find(name);
  return place == added_.end() ? nullptr : &place->second;
}

std::vector<NamedMesh> import_mesh_objects(const std::filesystem::path& file, double scale,
                                           MeshFiles& files) {
  if (!(scale > 0.0) || !std::isfinite(scale))
    fail(file, "the scale is " + std::to_string(scale) + ", it must be positive and finite.");
  std::vector<NamedMesh> objects;
  if (const auto* made = files.added(file)) {
    objects = *made;
    for (NamedMesh& object : objects) apply_scale(file, scale, object);
    return objects;
  }
  const MeshPath path = split_mesh_path(file);
  const std::string format = format_of(path.file);
  if (!is_known(format))
    fail(file, "the format '" + format + "' is not supported; allowed are .obj, .stl, .glb and .dae. " +
                   "FreeCAD (STEP, IGES) and Blender (others) write them by File > Export.");
  if (!path.node.empty() && format != ".glb")
    fail(file, "a node of it is named (#" + path.node + "), but only GLB files have nodes; allowed is " +
                   path.file.string() + ".");
  try {
    if (format == ".glb")
      objects = files.glb(path.file).objects(path.node);
    else
      objects = format == ".obj"   ? read_obj(read_file(path.file))
                : format == ".stl" ? read_stl(read_file(path.file))
                                   : read_dae(read_file(path.file));
  } catch (const MeshFault& fault) {
    fail(file, std::string(fault.what()) + ".");
  }
  if (objects.empty())
    fail(file, "there are no faces in it; in Blender, select the body and export it by File > Export.");
  for (NamedMesh& object : objects) apply_scale(file, scale, object);
  return objects;
}

Pose upright(const Pose& X_FN) {
  Mat3 R;
  R << 1.0, 0.0, 0.0, 0.0, 0.0, -1.0, 0.0, 1.0, 0.0;
  return {R * X_FN.R + Mat3::Zero(), R * X_FN.p + Vec3::Zero()};  // + 0: -0 becomes 0
}

std::vector<MeshNode> list_mesh_nodes(const std::filesystem::path& file, double scale, MeshFiles& files) {
  const MeshPath path = split_mesh_path(file);
  if (format_of(path.file) != ".glb") return {};
  try {
    const GlbNodes& nodes = files.glb(path.file).nodes();
    std::pair<std::size_t, std::size_t> range{0, nodes.size()};
    if (!path.node.empty()) range = find_glb_node(nodes, path.node);
    std::vector<MeshNode> result;
    for (std::size_t i = range.first; i < range.second; ++i) {
      if (!has_faces(nodes, i, end_of_glb_node(nodes, i))) continue;
      MeshNode node{glb_node_path(nodes, i), nodes[i].has_faces, {}};
      node.X_FN = rigid_part(glb_node_in_file(nodes, i), node.path).first;
      node.X_FN.p *= scale;
      result.push_back(std::move(node));
    }
    return result;
  } catch (const MeshFault& fault) {
    fail(file, std::string(fault.what()) + ".");
  }
}

TriangleMesh import_solid(const std::filesystem::path& file, double scale) {
  const std::vector<NamedMesh> objects = import_mesh_objects(file, scale);
  TriangleMesh whole;
  std::string problem;
  for (const NamedMesh& object : objects) {
    const MeshCheck check = check_closed(object.mesh);
    if (!check.ok() && problem.empty()) problem = "object '" + object.name + "': " + check.problem;
    append(whole, object.mesh);
  }
  if (problem.empty()) return whole;
  if (objects.size() > 1) {
    // Perhaps one surface cut into groups.
    TriangleMesh surface = joined(whole);
    if (check_closed(surface).ok()) return surface;
  }
  fail_no_solid(file, problem);
}

RepairedMesh import_and_repair(const std::filesystem::path& file, double scale, MeshFiles& files) {
  const std::vector<NamedMesh> objects = import_mesh_objects(file, scale, files);
  RepairedMesh whole, closed;
  TriangleMesh all, open;
  std::vector<std::pair<const NamedMesh*, RepairedMesh>> sheets;
  std::vector<MeshDiagnostic> of_reader;
  std::size_t open_count = 0, object_count = 0;
  std::string first_open;
  const auto add = [](RepairedMesh& to, const RepairedMesh& object) {
    to.findings.insert(to.findings.end(), object.findings.begin(), object.findings.end());
    append(to.mesh, object.mesh);
  };
  for (const NamedMesh& object : objects) {
    of_reader.insert(of_reader.end(), object.findings.begin(), object.findings.end());
    const RepairedMesh repaired = repair_mesh(object.mesh);
    if (encloses_nothing(repaired)) {
      sheets.push_back({&object, repaired});
      continue;
    }
    ++object_count;
    if (!repaired.problem.empty() && whole.problem.empty())
      whole.problem = "object '" + object.name + "': " + repaired.problem;
    add(whole, repaired);
    append(all, object.mesh);
    if (repaired.problem.empty()) {
      add(closed, repaired);
    } else {
      if (open_count++ == 0) first_open = object.name;
      append(open, object.mesh);
    }
  }
  if (object_count == 0)
    for (const auto& [object, repaired] : sheets) {
      if (whole.problem.empty()) whole.problem = "object '" + object->name + "': " + repaired.problem;
      add(whole, repaired);
    }
  else if (!sheets.empty())
    of_reader.push_back({MeshDiagnosticKind::encloses_nothing, MeshSeverity::repaired, sheets.size(), 0.0,
                         sheets.front().first->mesh.vertices.front(),
                         counted(sheets.size(), "object encloses", "objects enclose") +
                             " nothing, the first '" + sheets.front().first->name + "'",
                         "removed; " + std::string(remedy_of(MeshDiagnosticKind::encloses_nothing))});
  const auto with_readers = [&](RepairedMesh& result) {
    result.findings.insert(result.findings.begin(), of_reader.begin(), of_reader.end());
    return std::move(result);
  };
  if (open_count == 0 || object_count <= 1) return with_readers(whole);
  const auto note = [&](RepairedMesh& result, std::size_t count, const Vec3& place) {
    result.findings.push_back(
        {MeshDiagnosticKind::joined_objects, MeshSeverity::info, count, 0.0, place,
         counted(count, "object is", "objects are") + " closed together only, the first '" + first_open + "'",
         "joined where positions are equal; " + std::string(remedy_of(MeshDiagnosticKind::joined_objects))});
  };
  if (open_count > 1) {
    const RepairedMesh surface = repair_mesh(joined(open));
    if (surface.problem.empty()) {
      add(closed, surface);
      note(closed, open_count, open.vertices.front());
      return with_readers(closed);
    }
  }
  RepairedMesh surface = repair_mesh(joined(all));
  if (!surface.problem.empty()) return with_readers(whole);
  note(surface, object_count, open.vertices.front());
  return with_readers(surface);
}

RepairedMesh import_repaired_solid(const std::filesystem::path& file, double scale, MeshFiles& files) {
  RepairedMesh result = import_and_repair(file, scale, files);
  if (!result.problem.empty()) fail_no_solid(file, result.problem);
  return result;
}

std::vector<NamedMesh> import_mesh_objects(const std::filesystem::path& file, double scale) {
  MeshFiles files;
  return import_mesh_objects(file, scale, files);
}
std::vector<MeshNode> list_mesh_nodes(const std::filesystem::path& file, double scale) {
  MeshFiles files;
  return list_mesh_nodes(file, scale, files);
}
RepairedMesh import_and_repair(const std::filesystem::path& file, double scale) {
  MeshFiles files;
  return import_and_repair(file, scale, files);
}
RepairedMesh import_repaired_solid(const std::filesystem::path& file, double scale) {
  MeshFiles files;
  return import_repaired_solid(file, scale, files);
}

}  // namespace takt

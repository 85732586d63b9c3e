#include "server/product/glb_assembly.h"

#include <algorithm>
#include <cstddef>
#include <optional>
#include <utility>

#include "idl/common/text.h"
#include "server/geometry/mesh/glb_reader.h"
#include "server/geometry/mesh/import.h"
#include "server/geometry/mesh/repair.h"
#include "server/product/gltf_files.h"
#include "server/product/mesh_faces.h"
#include "server/product/names.h"

namespace takt::product {

namespace {

class Reader {
 public:
  Reader(const std::filesystem::path& file, const std::map<std::string, double>& densities)
      : path_(file),
        file_(lower_text(file.extension().string()) == ".gltf" ? gltf_.emplace(glb_of_gltf(file))
                                                               : files_.glb(file)),
        nodes_(file_.nodes()),
        densities_(densities) {}

  Product read() {
    name_nodes();
    product_.source = std::filesystem::absolute(path_).string();
    product_.name = path_.stem().string();
    if (!nodes_.empty() && end_of_glb_node(nodes_, 0) == nodes_.size() && !nodes_[0].has_faces &&
        !unnamed(nodes_[0]))
      product_.name = nodes_[0].name;
    for (std::size_t i = 0; i < nodes_.size(); ++i)
      if (nodes_[i].has_faces && nodes_[i].mesh) add(i);
    if (product_.instances.empty()) {
      std::string reason = "found no node with a closed mesh";
      for (const std::string& note : product_.notes) reason += "; " + note;
      throw MeshError("mesh file " + path_.string() + ": " + reason +
                      "; allowed: a glTF file whose nodes have closed meshes");
    }
    make_names_unique(product_.instances);
    return std::move(product_);
  }

 private:
  /// A mesh in a stretch of its own.
  struct Made {
    std::uint64_t mesh;
    Mat3 stretch;
    std::optional<std::size_t> body;  ///< none: its mesh bounds no solid
  };

  static bool unnamed(const GlbNode& node) {
    return is_generic(node.name) || node.name == "nodes[" + std::to_string(node.number) + "]";
  }

  /// By node: its name, else that of the node above, and those from the root on.
  void name_nodes() {
    for (const GlbNode& node : nodes_) {
      const std::string above = node.parent < 0 ? "" : paths_[static_cast<std::size_t>(node.parent)];
      std::string name = node.name;
      if (unnamed(node)) name = above.empty() ? "Part" : names_[static_cast<std::size_t>(node.parent)];
      paths_.push_back(above.empty() ? name : above + "/" + name);
      names_.push_back(std::move(name));
    }
  }

  void add(std::size_t i) {
    const auto [X_FN, stretch] = rigid_part(glb_node_in_file(nodes_, i), nodes_[i].name);
    const std::optional<std::size_t> body = body_of(i, stretch);
    if (!body) return;
    Instance instance;
    instance.name = key_of(names_[i]);
    instance.path = paths_[i];
    instance.body = *body;
    instance.X_WB = upright(X_FN);
    product_.instances.push_back(std::move(instance));
  }

  std::optional<std::size_t> body_of(std::size_t i, const Affine& stretch) {
    constexpr double kSinglePrecision = 1e-6;
    for (const Made& made : made_)
      if (made.mesh == *nodes_[i].mesh && (made.stretch - stretch.A).cwiseAbs().maxCoeff() <=
                                              kSinglePrecision * stretch.A.cwiseAbs().maxCoeff()) {
        if (!made.body) note(i, "its mesh, which bounds no solid, is that of a node before; it is left out");
        return made.body;
      }
    made_.push_back({*nodes_[i].mesh, stretch.A, make_body(i, stretch)});
    return made_.back().body;
  }

  std::optional<std::size_t> make_body(std::size_t i, const Affine& stretch) {
    const NamedMesh own = file_.own_object(i, stretch);
    RepairedMesh repaired = repair_mesh(own.mesh);
    if (!repaired.problem.empty()) {
      note(i, "its mesh bounds no solid (" + repaired.problem +
                  "); it is left out. In the program that wrote it, close the surface and export it again");
      return std::nullopt;
    }
    for (const MeshDiagnostic& finding : repaired.findings)
      if (finding.severity == MeshSeverity::repaired) note(i, finding.sentence + ": " + finding.remedy);
    Body body;
    body.name = names_[i];
    body.mesh = std::move(repaired.mesh);
    const GlbMaterial material = file_.material_of(*nodes_[i].mesh);
    body.material = material_of(material.name, body.name, 0.0, densities_);
    body.colour = material.colour;
    // Some programs write the mesh of each use.
    for (std::size_t k = 0; k < product_.bodies.size(); ++k)
      if (is_same(product_.bodies[k], body)) return k;
    body.exact = volume_properties(body.mesh);
    find_faces(body);
    product_.bodies.push_back(std::move(body));
    return product_.bodies.size() - 1;
  }

  static bool is_same(const Body& a, const Body& b) {
    return a.name == b.name && a.material.name == b.material.name && a.colour == b.colour &&
           a.mesh.triangles == b.mesh.triangles && a.mesh.vertices == b.mesh.vertices;
  }

  void note(std::size_t i, const std::string& text) { product_.notes.push_back(paths_[i] + ": " + text); }

  const std::filesystem::path path_;
  MeshFiles files_;
  std::optional<GlbFile> gltf_;  ///< of glTF in several files
  const GlbFile& file_;
  const GlbNodes& nodes_;
  const std::map<std::string, double>& densities_;
  std::vector<std::string> names_, paths_;  ///< by node
  std::vector<Made> made_;
  Product product_;
};

}  // namespace

Product read_glb_assembly(const std::filesystem::path& file, const std::map<std::string, double>& densities) {
  try {
    return Reader(file, densities).read();
  } catch (const MeshFault& fault) {
    throw MeshError("mesh file " + file.string() + ": " + fault.what() + ".");
  }
}

}  // namespace takt::product

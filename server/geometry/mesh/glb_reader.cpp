#include "server/geometry/mesh/glb_reader.h"

#include <assimp/postprocess.h>
#include <assimp/scene.h>

#include <array>
#include <assimp/Importer.hpp>
#include <cstddef>
#include <cstdint>
#include <sstream>
#include <string>
#include <utility>

#include "idl/common/text.h"

namespace takt {
namespace {

void add_mesh(const std::string& object, const aiMesh& mesh, const Affine& X_FN, MeshBuilder& builder) {
  std::vector<std::uint32_t> numbers;
  const auto place = [&](const MeshBuilder::Single& p_N) -> Vec3 { return X_FN * shortest_decimals(p_N); };
  for (std::size_t i = 0; i < mesh.mNumVertices; ++i) {
    const aiVector3D& v = mesh.mVertices[i];
    const MeshBuilder::Single p_N{v.x, v.y, v.z};
    if (!place(p_N).allFinite()) {
      std::ostringstream text;
      text << "object '" << object << "', vertex " << i << ": the position (" << v.x << ", " << v.y << ", "
           << v.z << ") or its place in the scene is not finite";
      throw MeshFault(text.str());
    }
    numbers.push_back(builder.vertex(builder.position(p_N, place)));
  }
  // glTF 2.0, 3.7.4: a mirroring transform turns the order of the vertices round.
  const bool mirrored = X_FN.A.determinant() < 0.0;
  for (std::size_t i = 0; i < mesh.mNumFaces; ++i) {
    const aiFace& face = mesh.mFaces[i];
    TriangleMesh::Triangle t{numbers.at(face.mIndices[0]), numbers.at(face.mIndices[1]),
                             numbers.at(face.mIndices[2])};
    if (mirrored) std::swap(t[1], t[2]);
    builder.add_triangle(t);
  }
}

/// By index of the node: the node in the axes of the result.
std::vector<Affine> places(const GlbNodes& nodes, const CheckedGlb& glb, bool in_frame_of_first) {
  std::vector<Affine> X(nodes.size());
  for (std::size_t i = glb.first; i < glb.last; ++i) {
    const GlbNode& node = nodes[i];
    if (in_frame_of_first && i == glb.first)
      X[i] = rigid_part(glb_node_in_file(nodes, i), node.name).second;
    else
      X[i] = node.parent < 0 ? node.X_PN : X[static_cast<std::size_t>(node.parent)] * node.X_PN;
  }
  return X;
}

void add_nodes(const aiScene& scene, const aiNode& shown, const GlbNodes& nodes, const std::vector<Affine>& X,
               MeshBuilder& builder) {
  if (shown.mNumMeshes > 0) {
    const auto index = static_cast<std::size_t>(std::stoull(shown.mName.C_Str()));
    const std::string name = glb_node_path(nodes, index);
    builder.begin_object(name);
    builder.forget_positions();
    for (unsigned i = 0; i < shown.mNumMeshes; ++i)
      add_mesh(name, *scene.mMeshes[shown.mMeshes[i]], X.at(index), builder);
  }
  for (unsigned i = 0; i < shown.mNumChildren; ++i) add_nodes(scene, *shown.mChildren[i], nodes, X, builder);
}

std::vector<NamedMesh> read(const CheckedGlb& glb, const GlbNodes& nodes, const std::vector<Affine>& X) {
  if (glb.bytes.empty()) return {};
  Assimp::Importer importer;
  const aiScene* scene =
      importer.ReadFileFromMemory(glb.bytes.data(), glb.bytes.size(), aiProcess_Triangulate, "glb");
  if (scene == nullptr || scene->mRootNode == nullptr)
    throw MeshFault(std::string("it cannot be understood: ") + importer.GetErrorString());
  MeshBuilder builder;
  add_nodes(*scene, *scene->mRootNode, nodes, X, builder);
  std::vector<NamedMesh> objects = builder.take_objects();
  if (glb.passed_over > 0 && !objects.empty())
    objects.front().findings.push_back(
        {MeshDiagnosticKind::no_faces, MeshSeverity::info, glb.passed_over, 0.0, Vec3::Zero(),
         counted(glb.passed_over, "primitive draws", "primitives draw") +
             " lines or points, which bound nothing, the first is " + glb.first_passed_over,
         std::string(remedy_of(MeshDiagnosticKind::no_faces))});
  return objects;
}

}  // namespace

std::vector<NamedMesh> GlbFile::objects(const std::string& node) const {
  const CheckedGlb glb = document_.checked(node);
  return read(glb, nodes(), places(nodes(), glb, !node.empty()));
}

NamedMesh GlbFile::own_object(std::size_t node, const Affine& X) const {
  std::vector<Affine> places(nodes().size());
  places.at(node) = X;
  std::vector<NamedMesh> objects = read(document_.checked_alone(node), nodes(), places);
  if (!objects.empty()) return std::move(objects.front());
  return {glb_node_path(nodes(), node), {}, {}};
}

}  // namespace takt

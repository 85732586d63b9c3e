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

#include "server/geometry/mesh/glb_check.h"

namespace takt {
namespace {

/// Affine map of a node: glTF allows scale and shear, so this is not a Pose.
struct Affine {
  Mat3 A = Mat3::Identity();
  Vec3 p = Vec3::Zero();
};

Affine compose(const Affine& parent, const aiMatrix4x4& m) {
  Affine child;
  child.A << m.a1, m.a2, m.a3, m.b1, m.b2, m.b3, m.c1, m.c2, m.c3;
  child.p << m.a4, m.b4, m.c4;
  return {parent.A * child.A, parent.A * child.p + parent.p};
}

void add_mesh(const std::string& object, const aiMesh& mesh, const Affine& X_FN, MeshBuilder& builder) {
  std::vector<std::uint32_t> numbers;
  const auto place = [&](const MeshBuilder::Single& p_N) -> Vec3 {
    return X_FN.A * shortest_decimals(p_N) + X_FN.p;
  };
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

void add_node(const aiScene& scene, const aiNode& node, const Affine& X_FP, MeshBuilder& builder) {
  const Affine X_FN = compose(X_FP, node.mTransformation);
  if (node.mNumMeshes > 0) {
    const std::string name = node.mName.C_Str();
    builder.begin_object(name);
    builder.forget_positions();
    for (unsigned i = 0; i < node.mNumMeshes; ++i)
      add_mesh(name, *scene.mMeshes[node.mMeshes[i]], X_FN, builder);
  }
  for (unsigned i = 0; i < node.mNumChildren; ++i) add_node(scene, *node.mChildren[i], X_FN, builder);
}

}  // namespace

std::vector<NamedMesh> read_glb(std::string_view content) {
  const std::string checked = checked_glb(content);
  Assimp::Importer importer;
  const aiScene* scene =
      importer.ReadFileFromMemory(checked.data(), checked.size(), aiProcess_Triangulate, "glb");
  if (scene == nullptr || scene->mRootNode == nullptr)
    throw MeshFault(std::string("it cannot be understood: ") + importer.GetErrorString());
  MeshBuilder builder;
  add_node(*scene, *scene->mRootNode, Affine{}, builder);
  return builder.take_objects();
}

}  // namespace takt

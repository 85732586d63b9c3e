#include "server/geometry/mesh/import.h"

#include <assimp/postprocess.h>
#include <assimp/scene.h>

#include <algorithm>
#include <array>
#include <assimp/DefaultLogger.hpp>
#include <assimp/IOSystem.hpp>
#include <assimp/Importer.hpp>
#include <assimp/LogStream.hpp>
#include <bit>
#include <cctype>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <fstream>
#include <iterator>
#include <sstream>
#include <string_view>
#include <unordered_map>

#include "server/geometry/mesh/file_check.h"
#include "server/geometry/mesh/glb_file_check.h"

namespace takt {
namespace {

[[noreturn]] void fail(const std::filesystem::path& file, const std::string& problem) {
  throw MeshError("mesh file " + file.string() + ": " + problem);
}

/// Collects what assimp only logs: in GLB it drops faces whose indices are out of range and goes on.
class AssimpWarnings {
 public:
  AssimpWarnings() {
    Assimp::DefaultLogger::create("", Assimp::Logger::NORMAL, 0);
    Assimp::DefaultLogger::get()->attachStream(&stream_, Assimp::Logger::Warn);
  }
  ~AssimpWarnings() {
    Assimp::DefaultLogger::get()->detachStream(&stream_, Assimp::Logger::Warn);
    Assimp::DefaultLogger::kill();
  }
  AssimpWarnings(const AssimpWarnings&) = delete;
  AssimpWarnings& operator=(const AssimpWarnings&) = delete;

  bool contain(std::string_view words) const { return stream_.text.find(words) != std::string::npos; }

 private:
  struct Stream : Assimp::LogStream {
    void write(const char* message) override { text += message; }
    std::string text;
  };
  Stream stream_;
};

/// A mesh file may name others (the materials of OBJ): assimp would open whatever is named, a device too.
class NoFiles final : public Assimp::IOSystem {
 public:
  bool Exists(const char*) const override { return false; }
  char getOsSeparator() const override { return '/'; }
  Assimp::IOStream* Open(const char*, const char*) override { return nullptr; }
  void Close(Assimp::IOStream*) override {}
};

std::string read_file(const std::filesystem::path& file) {
  std::error_code error;
  const auto status = std::filesystem::status(file, error);
  if (status.type() == std::filesystem::file_type::not_found) fail(file, "there is no such file.");
  if (!std::filesystem::is_regular_file(status)) fail(file, "this is not a regular file.");
  std::ifstream stream(file, std::ios::binary);
  std::string content{std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
  if (!stream.good() && !stream.eof()) fail(file, "it cannot be read.");
  return content;
}

struct Format {
  MeshFormat format;
  const char* extension;
};

Format format_of(const std::filesystem::path& file) {
  std::string extension = file.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  if (extension == ".obj") return {MeshFormat::obj, "obj"};
  if (extension == ".stl") return {MeshFormat::stl, "stl"};
  if (extension == ".glb") return {MeshFormat::glb, "glb"};
  fail(file, "the format '" + extension + "' is not supported; allowed are .obj, .stl and .glb.");
}

/// The shortest decimal number with this single precision value: what a person wrote in the file.
double decimal_value(float value) {
  std::array<char, 32> text{};
  const auto [end, error] = std::to_chars(text.data(), text.data() + text.size(), value);
  double result = static_cast<double>(value);
  if (error == std::errc()) std::from_chars(text.data(), end, result);
  return result + 0.0;  // -0 becomes 0
}

struct PositionHash {
  std::size_t operator()(const std::array<double, 3>& p) const {
    std::uint64_t hash = 0;
    for (const double x : p) {
      hash ^= std::bit_cast<std::uint64_t>(x);
      hash *= 0x9E3779B97F4A7C15ULL;  // 2^64 / golden ratio: spreads neighbouring numbers
      hash ^= hash >> 32;
    }
    return static_cast<std::size_t>(hash);
  }
};

/// Adds triangles to a mesh; equal positions become one vertex.
class MeshBuilder {
 public:
  std::uint32_t vertex(const Vec3& p) {
    const auto next = static_cast<std::uint32_t>(mesh.vertices.size());
    const auto [entry, is_new] = numbers_.try_emplace({p.x(), p.y(), p.z()}, next);
    if (is_new) mesh.vertices.push_back(p);
    return entry->second;
  }

  TriangleMesh mesh;

 private:
  std::unordered_map<std::array<double, 3>, std::uint32_t, PositionHash> numbers_;
};

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

void add_mesh(const std::filesystem::path& file, const std::string& object, const aiMesh& source,
              const Affine& X_FN, double scale, MeshBuilder& builder) {
  if ((source.mPrimitiveTypes & (aiPrimitiveType_POINT | aiPrimitiveType_LINE)) != 0)
    fail(file, "object '" + object + "': lines and points are not allowed, only faces.");
  std::vector<std::uint32_t> numbers(source.mNumVertices);
  for (unsigned i = 0; i < source.mNumVertices; ++i) {
    const aiVector3D& v = source.mVertices[i];
    const Vec3 p_N(decimal_value(v.x), decimal_value(v.y), decimal_value(v.z));
    const Vec3 p_F = (X_FN.A * p_N + X_FN.p) * scale + Vec3::Zero();  // + 0: -0 becomes 0
    if (!p_N.allFinite() || !p_F.allFinite()) {
      std::ostringstream text;
      text << "object '" << object << "', vertex " << i << ": the position (" << v.x << ", " << v.y << ", "
           << v.z << ") or its place in the scene is not finite.";
      fail(file, text.str());
    }
    numbers[i] = builder.vertex(p_F);
  }
  // glTF 2.0, 3.7.4: a mirroring transform turns the order of the vertices round.
  const bool mirrored = X_FN.A.determinant() < 0.0;
  for (unsigned i = 0; i < source.mNumFaces; ++i) {
    const aiFace& face = source.mFaces[i];
    if (face.mNumIndices != 3)
      fail(file, "object '" + object + "', face " + std::to_string(i) + " is not a triangle.");
    std::array<std::uint32_t, 3> t{numbers.at(face.mIndices[0]), numbers.at(face.mIndices[1]),
                                   numbers.at(face.mIndices[2])};
    if (mirrored) std::swap(t[1], t[2]);
    builder.mesh.triangles.push_back(t);
  }
}

void add_node(const std::filesystem::path& file, const aiScene& scene, const aiNode& node, const Affine& X_FP,
              double scale, std::vector<NamedMesh>& objects) {
  const Affine X_FN = compose(X_FP, node.mTransformation);
  if (node.mNumMeshes > 0) {
    NamedMesh object;
    object.name = node.mName.C_Str();
    if (object.name.empty() || object.name == "defaultobject" || object.name.starts_with('<'))
      object.name = "object " + std::to_string(objects.size() + 1);
    MeshBuilder builder;
    for (unsigned i = 0; i < node.mNumMeshes; ++i)
      add_mesh(file, object.name, *scene.mMeshes[node.mMeshes[i]], X_FN, scale, builder);
    object.mesh = std::move(builder.mesh);
    if (!object.mesh.triangles.empty()) objects.push_back(std::move(object));
  }
  for (unsigned i = 0; i < node.mNumChildren; ++i)
    add_node(file, scene, *node.mChildren[i], X_FN, scale, objects);
}

void append(TriangleMesh& whole, const TriangleMesh& piece) {
  const auto offset = static_cast<std::uint32_t>(whole.vertices.size());
  whole.vertices.insert(whole.vertices.end(), piece.vertices.begin(), piece.vertices.end());
  for (const auto& t : piece.triangles)
    whole.triangles.push_back({t[0] + offset, t[1] + offset, t[2] + offset});
}

}  // namespace

std::vector<NamedMesh> import_mesh_objects(const std::filesystem::path& file, double scale) {
  if (!(scale > 0.0) || !std::isfinite(scale))
    throw MeshError("mesh file " + file.string() + ": the scale is " + std::to_string(scale) +
                    ", it must be positive and finite.");
  const Format format = format_of(file);
  std::string content = read_file(file);
  const std::string fault = find_mesh_file_fault(format.format, content);
  if (!fault.empty()) fail(file, fault + ".");
  if (format.format == MeshFormat::obj) content = geometry_of_obj(content);
  if (format.format == MeshFormat::stl) content = geometry_of_stl(content);
  if (format.format == MeshFormat::glb) {
    CheckedGlb checked = check_glb(content);
    if (!checked.fault.empty()) fail(file, checked.fault + ".");
    content = std::move(checked.content);
  }

  const AssimpWarnings warnings;
  Assimp::Importer importer;
  importer.SetIOHandler(new NoFiles);  // the importer deletes it
  const aiScene* scene =
      importer.ReadFileFromMemory(content.data(), content.size(), aiProcess_Triangulate, format.extension);
  if (scene == nullptr || scene->mRootNode == nullptr)
    fail(file, std::string("it cannot be understood: ") + importer.GetErrorString());
  if (warnings.contain("out-of-range indices"))
    fail(file, "faces refer to vertices that do not exist (indices out of range).");
  std::vector<NamedMesh> objects;
  add_node(file, *scene, *scene->mRootNode, Affine{}, scale, objects);
  if (objects.empty()) fail(file, "there are no faces in it.");
  return objects;
}

namespace {

/// Equal positions merged across objects.
TriangleMesh joined(const TriangleMesh& pieces) {
  MeshBuilder builder;
  for (const auto& t : pieces.triangles)
    builder.mesh.triangles.push_back({builder.vertex(pieces.vertices[t[0]]),
                                      builder.vertex(pieces.vertices[t[1]]),
                                      builder.vertex(pieces.vertices[t[2]])});
  return std::move(builder.mesh);
}

[[noreturn]] void fail_no_solid(const std::filesystem::path& file, const std::string& problem) {
  fail(file, problem + " A solid is needed: closed, every edge shared by two triangles, faces outwards.");
}

}  // namespace

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

RepairedMesh import_and_repair(const std::filesystem::path& file, double scale) {
  const std::vector<NamedMesh> objects = import_mesh_objects(file, scale);
  RepairedMesh whole;
  TriangleMesh as_it_is;
  for (const NamedMesh& object : objects) {
    const RepairedMesh repaired = repair_mesh(object.mesh);
    if (!repaired.problem.empty() && whole.problem.empty())
      whole.problem = "object '" + object.name + "': " + repaired.problem;
    whole.findings.insert(whole.findings.end(), repaired.findings.begin(), repaired.findings.end());
    append(whole.mesh, repaired.mesh);
    append(as_it_is, object.mesh);
  }
  if (whole.problem.empty() || objects.size() == 1) return whole;
  RepairedMesh surface = repair_mesh(joined(as_it_is));
  return surface.problem.empty() ? surface : whole;
}

RepairedMesh import_repaired_solid(const std::filesystem::path& file, double scale) {
  RepairedMesh result = import_and_repair(file, scale);
  if (!result.problem.empty()) fail_no_solid(file, result.problem);
  return result;
}

}  // namespace takt

#pragma once
// GLB files of products as CAD programs write them: a root that turns z up to y up, and each triangle with corners of its
// own, as its normals demand.
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>

#include "server/geometry/mesh/triangle_mesh.h"

namespace takt::test {

class GlbProduct {
 public:
  explicit GlbProduct(const std::string& name) {
    nodes_.push_back({{"name", name}, {"rotation", {-std::sqrt(0.5), 0, 0, std::sqrt(0.5)}}});
  }
  int material(const std::string& name, const std::array<double, 4>& linear) {
    materials_.push_back({{"name", name}, {"pbrMetallicRoughness", {{"baseColorFactor", linear}}}});
    return static_cast<int>(materials_.size()) - 1;
  }
  int mesh(const TriangleMesh& mesh, int material = -1) {
    const std::size_t from = data_.size();
    for (const auto& t : mesh.triangles)
      for (const std::uint32_t v : t)
        for (int k = 0; k < 3; ++k) put(static_cast<float>(mesh.vertices[v][k]));
    const auto index = accessors_.size();
    views_.push_back({{"buffer", 0}, {"byteOffset", from}, {"byteLength", data_.size() - from}});
    accessors_.push_back({{"bufferView", index},
                          {"componentType", 5126},
                          {"count", 3 * mesh.triangles.size()},
                          {"type", "VEC3"}});
    nlohmann::json primitive{{"attributes", {{"POSITION", index}}}};
    if (material >= 0) primitive["material"] = material;
    meshes_.push_back({{"primitives", {primitive}}});
    return static_cast<int>(index);
  }
  /// Without a mesh: -1. Without a name: "".
  int node(const std::string& name, int mesh, const Vec3& place, int parent = 0,
           const Quat& q = Quat::Identity(), const Vec3& scale = Vec3::Ones()) {
    const auto index = nodes_.size();
    nlohmann::json node{{"translation", {place.x(), place.y(), place.z()}},
                        {"rotation", {q.x(), q.y(), q.z(), q.w()}},
                        {"scale", {scale.x(), scale.y(), scale.z()}}};
    if (!name.empty()) node["name"] = name;
    if (mesh >= 0) node["mesh"] = mesh;
    nodes_.push_back(node);
    nodes_[static_cast<std::size_t>(parent)]["children"].push_back(index);
    return static_cast<int>(index);
  }
  void write(const std::filesystem::path& file) const {
    nlohmann::json document{{"asset", {{"version", "2.0"}}},
                            {"scene", 0},
                            {"scenes", {{{"nodes", {0}}}}},
                            {"nodes", nodes_},
                            {"meshes", meshes_},
                            {"accessors", accessors_},
                            {"bufferViews", views_},
                            {"buffers", {{{"byteLength", data_.size()}}}}};
    if (!materials_.empty()) document["materials"] = materials_;
    std::string json = document.dump();
    json.resize((json.size() + 3) / 4 * 4, ' ');
    std::ofstream out(file, std::ios::binary);
    const auto number = [&out](std::size_t value) {
      const auto word = static_cast<std::uint32_t>(value);
      std::array<char, 4> raw{};
      std::memcpy(raw.data(), &word, raw.size());
      out.write(raw.data(), raw.size());
    };
    out << "glTF";
    number(2), number(28 + json.size() + data_.size()), number(json.size());
    out << "JSON" << json;
    number(data_.size());
    out << std::string("BIN\0", 4) << data_;
  }

 private:
  void put(float value) {
    std::array<char, 4> raw{};
    std::memcpy(raw.data(), &value, raw.size());
    data_.append(raw.data(), raw.size());
  }

  nlohmann::json nodes_ = nlohmann::json::array(), meshes_ = nodes_, accessors_ = nodes_, views_ = nodes_,
                 materials_ = nodes_;
  std::string data_;
};

}  // namespace takt::test

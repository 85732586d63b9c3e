#pragma once
// GLB files with nodes of tetrahedra, for tests.
#include <array>
#include <cstdint>
#include <cstring>
#include <string>

namespace takt::test {

/// A GLB file with these nodes (JSON: a list) and roots. Mesh 0 is the tetrahedron between the origin and the unit
/// points of the axes (volume 1/6), 1 the same without a face, 2 has lines only, 3 the tetrahedron and lines.
inline std::string glb_file(const std::string& nodes, const std::string& roots) {
  const std::array<float, 12> corners{0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1};
  const std::array<std::uint16_t, 12> triangles{0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3};
  std::string data(sizeof(corners) + sizeof(triangles), '\0');
  std::memcpy(data.data(), corners.data(), sizeof(corners));
  std::memcpy(data.data() + sizeof(corners), triangles.data(), sizeof(triangles));
  const std::string faces = R"({"attributes":{"POSITION":0},"indices":1})";
  const std::string lines = R"({"attributes":{"POSITION":0},"indices":1,"mode":1})";
  std::string json = R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":)" + roots +
                     R"(}],"nodes":)" + nodes + R"(,"meshes":[{"primitives":[)" + faces +
                     R"(]},{"primitives":[{"attributes":{"POSITION":0},"indices":2}]},{"primitives":[)" +
                     lines + R"(]},{"primitives":[)" + lines + "," + faces + "," + lines +
                     R"(]}],"buffers":[{"byteLength":72}],"bufferViews":[{"buffer":0,"byteLength":48},)"
                     R"({"buffer":0,"byteOffset":48,"byteLength":24}],)"
                     R"("accessors":[{"bufferView":0,"componentType":5126,"count":4,"type":"VEC3"},)"
                     R"({"bufferView":1,"componentType":5123,"count":12,"type":"SCALAR"},)"
                     R"({"bufferView":1,"componentType":5123,"count":9,"type":"SCALAR"}]})";
  json.resize((json.size() + 3) / 4 * 4, ' ');
  std::string bytes = "glTF";
  const auto put = [&bytes](std::size_t value) {
    const auto number = static_cast<std::uint32_t>(value);
    std::array<char, 4> raw{};
    std::memcpy(raw.data(), &number, raw.size());
    bytes.append(raw.data(), raw.size());
  };
  put(2), put(28 + json.size() + data.size());
  put(json.size());
  bytes += "JSON" + json;
  put(data.size());
  return bytes + std::string("BIN\0", 4) + data;
}

/// An assembly as CAD programs write it: a root that turns z up to y up, a frame that is turned by 90 degrees about z
/// (CAD axes) and moved, with a housing of double size and a bolt below it, and a plate with a bolt of the same name.
inline std::string glb_cell() {
  return glb_file(
      R"([{"name":"Cell","rotation":[-0.7071067811865476,0,0,0.7071067811865476],"children":[1,4,6]},)"
      R"({"name":"Frame","translation":[1,2,3],"rotation":[0,0,0.7071067811865476,0.7071067811865476],)"
      R"("children":[2,3]},)"
      R"({"name":"Housing","mesh":0,"translation":[0.5,0,0],"scale":[2,2,2]},)"
      R"({"name":"Bolt","mesh":3,"translation":[0,0.25,0]},)"
      R"({"name":"Plate","mesh":1,"children":[5]},)"
      R"({"name":"Bolt","mesh":0,"translation":[5,0,0]},)"
      R"({"name":"Drawing","mesh":2}])",
      "[0]");
}

}  // namespace takt::test

// GLB files field by field: invalid values are refused with their place in the file, unusual valid ones are
// read. And the words for findings about meshes.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <cstring>
#include <initializer_list>
#include <iterator>
#include <vector>

#include "server/geometry/mesh/diagnostic.h"
#include "server/geometry/mesh/import.h"
#include "tests/support/temporary_directory.h"

namespace takt {
namespace {

using ::testing::AllOf;
using ::testing::AnyOf;
using ::testing::HasSubstr;
using ::testing::StartsWith;

const std::string kTetrahedronJson =
    R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],)"
    R"("meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1}]}],"buffers":[{"byteLength":72}],)"
    R"("bufferViews":[{"buffer":0,"byteLength":48},{"buffer":0,"byteOffset":48,"byteLength":24}],)"
    R"("accessors":[{"bufferView":0,"componentType":5126,"count":4,"type":"VEC3"},)"
    R"({"bufferView":1,"componentType":5123,"count":12,"type":"SCALAR"}]})";

class GlbFile : public testing::Test {
 protected:
  static void append_u32(std::string& bytes, std::size_t value) {
    const auto number = static_cast<std::uint32_t>(value);
    bytes.append(reinterpret_cast<const char*>(&number), sizeof(number));
  }
  static std::string chunk(const std::string& type, std::string content, char filler) {
    content.resize((content.size() + 3) / 4 * 4, filler);
    std::string bytes;
    append_u32(bytes, content.size());
    return bytes + type + content;
  }
  static std::string tetrahedron_data() {
    const std::array<float, 12> corners{0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1};
    const std::array<std::uint16_t, 12> triangles{0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3};
    std::string data(sizeof(corners) + sizeof(triangles), '\0');
    std::memcpy(data.data(), corners.data(), sizeof(corners));
    std::memcpy(data.data() + sizeof(corners), triangles.data(), sizeof(triangles));
    return data;
  }
  static std::string whole(const std::string& chunks) {
    std::string bytes = "glTF";
    append_u32(bytes, 2);
    append_u32(bytes, 12 + chunks.size());
    return bytes + chunks;
  }
  static std::string binary() { return chunk(std::string("BIN\0", 4), tetrahedron_data(), '\0'); }
  /// The tetrahedron with a piece of its JSON replaced.
  static std::string with(const std::string& old_text, const std::string& new_text) {
    std::string json = kTetrahedronJson;
    const auto at = json.find(old_text);
    EXPECT_NE(at, std::string::npos) << old_text;
    if (at != std::string::npos) json.replace(at, old_text.size(), new_text);
    return whole(chunk("JSON", json, ' ') + binary());
  }
  /// The error of the import; else the number of triangles.
  std::string answer(const std::string& bytes) {
    directory_.write("a.glb", bytes);
    try {
      return std::to_string(import_mesh_objects(directory_ / "a.glb").at(0).mesh.triangles.size());
    } catch (const MeshError& error) {
      EXPECT_THAT(error.what(), HasSubstr("a.glb"));
      return error.what();
    }
  }
  const test::TemporaryDirectory directory_;
};

TEST_F(GlbFile, AStripOfOneCornerIsRefused) {
  std::string json = kTetrahedronJson;
  json.replace(json.find("\"indices\""), 0, "\"mode\":5,");
  json.replace(json.find("\"count\":12"), 10, "\"count\":1");
  EXPECT_THAT(answer(whole(chunk("JSON", json, ' ') + binary())),
              HasSubstr("has 1 corners; a strip or fan has 3 or more"));
}

TEST_F(GlbFile, MistakesAreReportedWithTheirPlace) {
  struct Row {
    const char *old_text, *new_text, *words;
  };
  const Row rows[] = {
      {R"("nodes":[{"mesh":0}])", R"("nodes":5)", "nodes is no list"},
      {R"([{"nodes":[0]}])", R"([{"nodes":0}])", "the scene: its nodes is no list"},
      {R"([{"nodes":[0]}])", R"([{"nodes":[-1]}])", "the scene: its nodes must be whole numbers"},
      {R"([{"nodes":[0]}])", R"([{"nodes":[3]}])", "the scene refers to nodes[3], of which there are 1"},
      {R"([{"nodes":[0]}])", R"([{"nodes":[0,0]}])", "nodes[0] is there twice"},
      {R"("scene":0)", R"("scene":2)", "the file refers to scenes[2], of which there are 1"},
      {R"({"mesh":0})", R"({"mesh":0,"children":{}})", "nodes[0]: its children is no list"},
      {R"({"mesh":0})", R"({"mesh":0,"children":["x"]})", "nodes[0]: its children must be whole numbers"},
      {R"({"mesh":0})", R"({"mesh":0,"translation":5})", "nodes[0]: its translation must be 3 numbers"},
      {R"({"mesh":0})", R"({"mesh":0,"scale":[1,2]})", "nodes[0]: its scale must be 3 numbers"},
      {R"({"mesh":0})", R"({"mesh":0,"rotation":[0,0,0,"w"]})", "nodes[0]: its rotation must be 4 numbers"},
      {R"({"mesh":0})", R"({"mesh":0,"extensions":{"EXT_mesh_gpu_instancing":{}}})",
       "nodes[0]: EXT_mesh_gpu_instancing is not supported"},
      {R"({"mesh":0})", R"({"mesh":-1})", "nodes[0]: its mesh must be a whole number below 2^32"},
      {R"({"mesh":0})", R"({"mesh":4294967296})", "nodes[0]: its mesh must be a whole number below 2^32"},
      {R"("primitives":[{)", R"("primitives":[],"x":[{)", "meshes[0] has no primitives"},
      {R"("primitives":[{)", R"("primitives":5,"x":[{)", "meshes[0] has no primitives"},
      {R"("primitives":[{)", R"("x":[{)", "meshes[0] has no primitives"},
      {R"("indices":1)", R"("indices":1,"mode":1)", "there are no faces in it"},
      {R"("indices":1)", R"("indices":1,"mode":7)", "meshes[0].primitives[0]: the mode 7 is unknown"},
      {R"("attributes":{)", R"("x":{)", "meshes[0].primitives[0] has no attributes"},
      {R"("POSITION":0)", R"("NORMAL":0)", "meshes[0].primitives[0] has no POSITION"},
      {R"("count":4)", R"("count":4,"sparse":{})", "accessors[0]: sparse accessors are not supported"},
      {R"("count":4)", R"("count":0)", "accessors[0]: its count is 0"},
      {R"("count":4)", R"("count":5)", "accessors[0]: 5 items of 12 bytes"},
      {R"("type":"VEC3")", R"("type":"VEC2")",
       "accessors[0]: found type \"VEC2\" of componentType 5126; allowed: positions as VEC3 of 5126 (float)"},
      {R"("componentType":5126)", R"("componentType":5125)", "found type \"VEC3\" of componentType 5125"},
      {R"("componentType":5123)", R"("componentType":5122)", "found type \"SCALAR\" of componentType 5122"},
      {R"("byteLength":48)", R"("byteLength":48,"byteStride":8)", "accessors[0]: 4 items of 12 bytes"},
      {R"("byteLength":48)", R"("byteLength":48,"byteStride":300)", "byteStride must be at most 252"},
      {R"("byteLength":48)", R"("byteLength":4800)", "bufferViews[0]: 4800 bytes from byte 0"},
      {R"({"byteLength":72})", R"({"byteLength":72,"uri":"a.bin"})", "does not lie in this file"},
  };
  for (const Row& row : rows) EXPECT_THAT(answer(with(row.old_text, row.new_text)), HasSubstr(row.words));
}

/// A short file whose nodes share one mesh, and whose accessors share their bytes, would need any amount of memory.
TEST_F(GlbFile, MorePositionsThanMemoryHoldsAreRefused) {
  const std::size_t positions = 100'000, uses = 601;  // 60 million are allowed
  std::string nodes, roots;
  for (std::size_t i = 0; i < uses; ++i) {
    nodes += i == 0 ? R"({"mesh":0})" : R"(,{"mesh":0})";
    roots += (i == 0 ? "" : ",") + std::to_string(i);
  }
  const std::string json =
      R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[)" + roots + R"(]}],"nodes":[)" + nodes +
      R"(],"meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1}]}],"buffers":[{"byteLength":1200000}],)"
      R"("bufferViews":[{"buffer":0,"byteLength":1200000}],)"
      R"("accessors":[{"bufferView":0,"componentType":5126,"count":100000,"type":"VEC3"},)"
      R"({"bufferView":0,"componentType":5123,"count":3,"type":"SCALAR"}]})";
  const std::string data = chunk(std::string("BIN\0", 4), std::string(12 * positions, '\0'), '\0');
  EXPECT_THAT(answer(whole(chunk("JSON", json, ' ') + data)),
              HasSubstr("with nodes[600] there are more than 60000000 positions to be seen"));
}

TEST_F(GlbFile, MoreItemsOfAccessorsThanMemoryHoldsAreRefused) {
  std::string primitives, accessors;
  for (std::size_t i = 0; i < 121; ++i) {  // 120 million are allowed
    primitives +=
        (i == 0 ? "" : ",") + (R"({"attributes":{"POSITION":0},"indices":)" + std::to_string(i + 1)) + "}";
    accessors += R"(,{"bufferView":1,"componentType":5121,"count":1000000,"type":"SCALAR"})";
  }
  const std::string json =
      R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],"meshes":[{"primitives":[)" +
      primitives +
      R"(]}],"buffers":[{"byteLength":1000036}],)"
      R"("bufferViews":[{"buffer":0,"byteLength":36},{"buffer":0,"byteOffset":36,"byteLength":1000000}],)"
      R"("accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"})" +
      accessors + "]}";
  const std::string data = chunk(std::string("BIN\0", 4), std::string(1'000'036, '\0'), '\0');
  EXPECT_THAT(answer(whole(chunk("JSON", json, ' ') + data)),
              HasSubstr("with accessors[120] there are more than 120000000 positions and indices"));
}

TEST_F(GlbFile, ChunksMustBeWholeAndBeginWithTheDescription) {
  const std::string json = chunk("JSON", kTetrahedronJson, ' ');
  EXPECT_THAT(answer(whole(json + binary() + "rest")),
              AllOf(HasSubstr("a chunk at byte"), HasSubstr("is cut")));
  EXPECT_THAT(answer(whole(binary() + json)), HasSubstr("the first chunk is no JSON"));
  std::string too_long = chunk("MORE", "abcd", ' ');
  too_long[0] = 100;
  EXPECT_THAT(answer(whole(json + binary() + too_long)), HasSubstr("announces 100 bytes, but there are 4"));
  EXPECT_THAT(answer(whole(json)), HasSubstr("do not fit into the 0 bytes of the file's data"));
}

TEST_F(GlbFile, OptionalVariantsAreRead) {
  EXPECT_EQ(answer(whole(chunk("JSON", kTetrahedronJson, ' ') + binary())), "4");
  EXPECT_EQ(answer(with(R"({"mesh":0})", R"({"mesh":0,"name":5})")), "4");
  EXPECT_EQ(answer(with(R"("meshes":[{)", R"("meshes":[{"name":5,)")), "4");
  EXPECT_EQ(answer(with(R"("byteLength":48)", R"("byteLength":48,"byteStride":12)")), "4");
  EXPECT_EQ(answer(with(R"("byteLength":24)", R"("byteLength":24,"byteStride":2)")), "4");
  EXPECT_EQ(answer(whole(chunk("JSON", kTetrahedronJson, ' ') + binary() +
                         chunk(std::string("BIN\0", 4), "other data", '\0') + chunk("MORE", "abcd", ' '))),
            "4");
}

/// The positions of the tetrahedron, as the file has them.
class GlbPositions : public GlbFile {
 protected:
  /// `items`: four positions and what lies between them.
  std::vector<Vec3> read(const std::string& view, const std::string& accessor, const std::string& items) {
    const std::array<std::uint8_t, 12> triangles{0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3};
    std::string data(triangles.begin(), triangles.end());
    data += items;
    const std::string json =
        R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],)"
        R"("meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1}]}],"buffers":[{"byteLength":)" +
        std::to_string(data.size()) + R"(}],"bufferViews":[{"buffer":0,"byteLength":12},)" +
        R"({"buffer":0,"byteOffset":12,"byteLength":)" + std::to_string(items.size()) + view +
        R"(}],"accessors":[{"bufferView":1,"count":4,"type":"VEC3",)" + accessor +
        R"(},{"bufferView":0,"componentType":5121,"count":12,"type":"SCALAR"}]})";
    EXPECT_EQ(answer(whole(chunk("JSON", json, ' ') + chunk(std::string("BIN\0", 4), data, '\0'))), "4");
    return import_mesh_objects(directory_ / "a.glb").at(0).mesh.vertices;
  }
  template <class Number>
  static std::string raw(std::initializer_list<Number> numbers) {
    std::string bytes(numbers.size() * sizeof(Number), '\0');
    std::memcpy(bytes.data(), std::data(numbers), bytes.size());
    return bytes;
  }
};

// As the sample BoxInterleaved of Khronos: glTF 2.0, 3.6.2.4, lets the last item end before the stride does.
TEST_F(GlbPositions, MayLieBetweenOtherAttributes) {
  const std::string with_normals =
      raw<float>({9, 9, 9, 0, 0, 0, 9, 9, 9, 1, 0, 0, 9, 9, 9, 0, 1, 0, 9, 9, 9, 0, 0, 1});
  const std::vector<Vec3> corners{Vec3::Zero(), Vec3::UnitX(), Vec3::UnitY(), Vec3::UnitZ()};
  EXPECT_THAT(read(R"(,"byteStride":24)", R"("componentType":5126,"byteOffset":12)", with_normals),
              testing::UnorderedElementsAreArray(corners));
  EXPECT_THAT(read(R"(,"byteStride":24)", R"("componentType":5126)", with_normals.substr(12)),
              testing::UnorderedElementsAreArray(corners));
}

TEST_F(GlbPositions, MayBeQuantised) {
  using testing::UnorderedElementsAre;
  const auto tetrahedron = [](double from, double to) {
    return UnorderedElementsAre(Vec3(from, from, from), Vec3(to, from, from), Vec3(from, to, from),
                                Vec3(from, from, to));
  };
  const auto corners = [](auto a, auto b) {
    return raw<decltype(a)>({a, a, a, 0, b, a, a, 0, a, b, a, 0, a, a, b, 0});
  };
  const std::string bytes = R"(,"byteStride":4)", shorts = R"(,"byteStride":8)",
                    normalised = R"(,"normalized":true)";
  EXPECT_THAT(read(shorts, R"("componentType":5122)" + normalised,
                   corners(std::int16_t{-32768}, std::int16_t{32767})),
              tetrahedron(-1.0, 1.0));
  EXPECT_THAT(read(shorts, R"("componentType":5122)", corners(std::int16_t{-300}, std::int16_t{20})),
              tetrahedron(-300.0, 20.0));
  EXPECT_THAT(
      read(shorts, R"("componentType":5123)" + normalised, corners(std::uint16_t{0}, std::uint16_t{65535})),
      tetrahedron(0.0, 1.0));
  EXPECT_THAT(read(bytes, R"("componentType":5120)" + normalised, corners(std::int8_t{-127}, std::int8_t{0})),
              tetrahedron(-1.0, 0.0));
  EXPECT_THAT(read(bytes, R"("componentType":5121)", corners(std::uint8_t{3}, std::uint8_t{255})),
              tetrahedron(3.0, 255.0));
}

TEST(MeshDiagnostics, EachDiagnosticHasItsOwnWordsAndARemedy) {
  using Kind = MeshDiagnosticKind;
  const std::pair<Kind, const char*> words[] = {
      {Kind::bad_vertex, "bad vertex"},
      {Kind::no_faces, "lines or points"},
      {Kind::joined_objects, "joined objects"},
      {Kind::near_vertices, "near vertices"},
      {Kind::touching_edges, "touching edges"},
      {Kind::split_edges, "vertices on edges"},
      {Kind::zero_area_faces, "faces without area"},
      {Kind::duplicate_faces, "duplicate faces"},
      {Kind::open_edges, "open edges"},
      {Kind::crowded_edges, "edges of more than two faces"},
      {Kind::not_orientable, "surface with one side"},
      {Kind::mixed_orientation, "mixed orientation"},
      {Kind::inside_out, "inside out"},
      {Kind::encloses_nothing, "encloses nothing"},
      {Kind::cavities, "cavities"},
      {Kind::nested_solids, "solids inside others"},
      {Kind::needles, "needle triangles"},
      {Kind::sharp_edges, "sharp edges"},
      {Kind::coarse, "coarse for contact"},
      {Kind::far_from_origin, "far from the origin"},
  };
  for (const auto& [kind, text] : words) {
    EXPECT_EQ(to_string(kind), text);
    // A step in a program, a key, or that there is nothing to do.
    EXPECT_THAT(std::string(remedy_of(kind)),
                AnyOf(HasSubstr("in Blender"), HasSubstr("in FreeCAD"), HasSubstr("contact.components.NAME."),
                      StartsWith("nothing to do")))
        << text;
  }
}

}  // namespace
}  // namespace takt

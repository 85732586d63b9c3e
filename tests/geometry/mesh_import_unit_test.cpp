// Mesh files: the imported content, and the refusal of every kind of broken file with its name and the place
// of the fault.
#include "server/geometry/mesh/import.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <limits>
#include <string>
#include <vector>

namespace takt {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

const std::string kVertices = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n";
const std::string kFaces = "f 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";
using Triangle = std::array<std::uint16_t, 3>;
const std::vector<std::array<float, 3>> kCorners{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
const std::vector<Triangle> kTriangles{{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};

template <class T>
void put(std::string& bytes, const T& value) {
  std::array<char, sizeof(T)> raw{};
  std::memcpy(raw.data(), &value, sizeof(T));
  bytes.append(raw.data(), raw.size());
}

std::string binary_stl(const std::vector<std::array<float, 3>>& corners,
                       const std::vector<Triangle>& triangles) {
  std::string bytes(80, '-');
  put(bytes, static_cast<std::uint32_t>(triangles.size()));
  for (const Triangle& t : triangles) {
    put(bytes, std::array<float, 3>{});
    for (const std::uint16_t i : t) put(bytes, corners[i]);
    put(bytes, std::uint16_t{0});
  }
  return bytes;
}

std::string text_stl() {
  std::string text = "solid tetrahedron\n";
  for (const Triangle& t : kTriangles) {
    text += "facet normal 0 0 0\n outer loop\n";
    for (const std::uint16_t i : t)
      text += "  vertex " + std::to_string(kCorners[i][0]) + " " + std::to_string(kCorners[i][1]) + " " +
              std::to_string(kCorners[i][2]) + "\n";
    text += " endloop\nendfacet\n";
  }
  return text + "endsolid tetrahedron\n";
}

std::string glb(const std::vector<std::array<float, 3>>& corners, const std::vector<Triangle>& triangles,
                const std::string& node = "") {
  std::string data;
  for (const auto& c : corners) put(data, c);
  const std::size_t split = data.size();
  for (const Triangle& t : triangles) put(data, t);
  const std::size_t end = data.size();
  data.resize((end + 3) / 4 * 4, '\0');
  std::string json =
      R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0,"name":"body")" +
      node +
      R"(}],"meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1}]}],"buffers":[{"byteLength":)" +
      std::to_string(data.size()) + R"(}],"bufferViews":[{"buffer":0,"byteOffset":0,"byteLength":)" +
      std::to_string(split) + R"(},{"buffer":0,"byteOffset":)" + std::to_string(split) + R"(,"byteLength":)" +
      std::to_string(end - split) + R"(}],"accessors":[{"bufferView":0,"componentType":5126,"count":)" +
      std::to_string(corners.size()) +
      R"(,"type":"VEC3","min":[0,0,0],"max":[1,1,1]},{"bufferView":1,"componentType":5123,"count":)" +
      std::to_string(3 * triangles.size()) + R"(,"type":"SCALAR"}]})";
  json.resize((json.size() + 3) / 4 * 4, ' ');
  std::string bytes = "glTF";
  put(bytes, std::uint32_t{2});
  put(bytes, static_cast<std::uint32_t>(28 + json.size() + data.size()));
  put(bytes, static_cast<std::uint32_t>(json.size()));
  bytes += "JSON" + json;
  put(bytes, static_cast<std::uint32_t>(data.size()));
  bytes += std::string("BIN\0", 4) + data;
  return bytes;
}

class MeshImport : public ::testing::Test {
 protected:
  void SetUp() override {
    const auto* info = ::testing::UnitTest::GetInstance()->current_test_info();
    directory_ =
        fs::temp_directory_path() / ("takt_mesh_import_" + std::to_string(::getpid()) + info->name());
    fs::create_directories(directory_);
  }
  void TearDown() override { fs::remove_all(directory_); }

  fs::path write(const std::string& name, const std::string& content) {
    std::ofstream(directory_ / name, std::ios::binary) << content;
    return directory_ / name;
  }

  /// The message of the refusal; it must name the file.
  std::string refusal(const fs::path& file, bool as_solid = true) {
    try {
      if (as_solid)
        import_solid(file);
      else
        import_mesh_objects(file);
    } catch (const MeshError& error) {
      EXPECT_THAT(error.what(), HasSubstr(file.string()));
      return error.what();
    }
    ADD_FAILURE() << file << " was accepted";
    return {};
  }
  std::string refusal_of(const std::string& name, const std::string& content, bool as_solid = true) {
    return refusal(write(name, content), as_solid);
  }

  fs::path directory_;
};

TEST_F(MeshImport, EachFormatIsReadWithSharedVertices) {
  for (const fs::path& file :
       {write("a.obj", kVertices + kFaces), write("b.stl", binary_stl(kCorners, kTriangles)),
        write("c.STL", text_stl()), write("d.glb", glb(kCorners, kTriangles))}) {
    const TriangleMesh mesh = import_solid(file);
    EXPECT_EQ(mesh.vertices.size(), 4U) << file;
    EXPECT_EQ(mesh.triangles.size(), 4U) << file;
    EXPECT_NEAR(volume_properties(mesh).volume, 1.0 / 6.0, 1e-15) << file;
    EXPECT_NEAR(volume_properties(import_solid(file, 0.001)).volume, 1e-9 / 6.0, 1e-22) << file;
  }
}

TEST_F(MeshImport, DecimalNumbersKeepTheValueOfTheFile) {
  const auto file = write("a.obj", "v -0.0295 0.0395 0.002\nv 1 -0 +0.25\nv 0 1e-3 0\nv 0 0 1\n" + kFaces);
  const auto objects = import_mesh_objects(file);
  ASSERT_EQ(objects.size(), 1U);
  const std::vector<Vec3> expected{{-0.0295, 0.0395, 0.002}, {1, 0, 0.25}, {0, 1e-3, 0}, {0, 0, 1}};
  EXPECT_THAT(objects[0].mesh.vertices, ::testing::UnorderedElementsAreArray(expected));
}

TEST_F(MeshImport, ObjectsAreKeptApart) {
  // Two tetrahedra that share a vertex position stay two solids.
  const auto file = write(
      "a.obj", "o first\n" + kVertices + kFaces +
                   "o second\nv 1 0 0\nv 2 0 0\nv 1 1 0\nv 1 0 1\nf 5 7 6\nf 5 6 8\nf 5 8 7\nf 6 7 8\n");
  const auto objects = import_mesh_objects(file);
  ASSERT_EQ(objects.size(), 2U);
  EXPECT_EQ(objects[0].name, "first");
  EXPECT_EQ(objects[1].name, "second");
  EXPECT_EQ(import_solid(file).vertices.size(), 8U);
  EXPECT_NEAR(volume_properties(import_solid(file)).volume, 2.0 / 6.0, 1e-15);
}

TEST_F(MeshImport, ASurfaceCutIntoGroupsOrMaterialsIsJoined) {
  const auto groups = write("g.obj", kVertices + "g low\nf 1 3 2\nf 1 2 4\ng high\nf 1 4 3\nf 2 3 4\n");
  EXPECT_EQ(import_mesh_objects(groups).size(), 2U);
  EXPECT_EQ(import_solid(groups).vertices.size(), 4U);
  const auto materials =
      write("m.obj", kVertices + "usemtl a\nf 1 3 2\nf 1 2 4\nusemtl b\nf 1 4 3\nf 2 3 4\n");
  EXPECT_EQ(import_solid(materials).vertices.size(), 4U);
}

TEST_F(MeshImport, OpenObjectsAreJoinedBesideClosedOnesThatTouchThem) {
  // The second object shares an edge with the first body, which is cut into two groups.
  const std::string second = "o second\nv 1 1 1\nf 2 3 5\nf 3 4 5\nf 4 2 5\nf 2 4 3\n";
  const auto file =
      write("t.obj", kVertices + "g low\nf 1 3 2\nf 1 2 4\ng high\nf 1 4 3\nf 2 3 4\n" + second);
  const RepairedMesh repaired = import_and_repair(file);
  EXPECT_EQ(repaired.problem, "");
  EXPECT_EQ(repaired.mesh.triangles.size(), 8U);
  const auto joined =
      std::find_if(repaired.findings.begin(), repaired.findings.end(),
                   [](const MeshDiagnostic& f) { return f.kind == MeshDiagnosticKind::joined_objects; });
  ASSERT_NE(joined, repaired.findings.end());
  EXPECT_EQ(joined->count, 2U);
  EXPECT_THAT(joined->sentence, HasSubstr("2 objects are closed together only, the first 'low'"));
}

TEST_F(MeshImport, LinesAndPointsArePassedOverAndReported) {
  const auto file = write("l.obj", kVertices + kFaces + "l 1 2\np 1\nl 2 3 4\n");
  const RepairedMesh repaired = import_and_repair(file);
  EXPECT_EQ(repaired.problem, "");
  ASSERT_EQ(repaired.findings.size(), 1U);
  EXPECT_EQ(repaired.findings[0].kind, MeshDiagnosticKind::no_faces);
  EXPECT_EQ(repaired.findings[0].count, 3U);
  EXPECT_THAT(repaired.findings[0].sentence, HasSubstr("3 statements draw lines or points (l, p)"));
  EXPECT_THAT(repaired.findings[0].sentence, HasSubstr("in line 9"));
}

TEST_F(MeshImport, PolygonsNegativeIndicesAndContinuedLinesAreRead) {
  const auto file =
      write("a.obj",
            "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 \\\n0\nv 0.5 0.5 1\nf 4 3 2 1\nf -5 -4 -1\nf 2//1 3//1 5//1\n"
            "f 3 4 5\nf 4 1 5\n");
  EXPECT_NEAR(volume_properties(import_solid(file)).volume, 1.0 / 3.0, 1e-15);
}

TEST_F(MeshImport, NodeTransformsAreAppliedAndMirroredFacesTurned) {
  const auto moved = write("a.glb", glb(kCorners, kTriangles, R"(,"translation":[1,2,3],"scale":[2,2,2])"));
  const VolumeProperties p = volume_properties(import_solid(moved));
  EXPECT_NEAR(p.volume, 8.0 / 6.0, 1e-14);
  EXPECT_LT((p.p_BBcm - Vec3(1.5, 2.5, 3.5)).norm(), 1e-14);
  const auto mirrored = write("b.glb", glb(kCorners, kTriangles, R"(,"scale":[-1,1,1])"));
  EXPECT_NEAR(volume_properties(import_solid(mirrored)).volume, 1.0 / 6.0, 1e-14);
}

/// A tetrahedron with the corners 0, x, y, z, in triangles and a polygon list; `scene` instantiates it as #g.
std::string dae(const std::string& scene, const std::string& unit = "1",
                const std::string& list = "<vcount>3 3</vcount><p>0 3 2 1 2 3</p>") {
  return "<?xml version='1.0'?><COLLADA version='1.4.1'><asset><unit meter='" + unit +
         "'/><up_axis>Y_UP</up_axis></asset>\n<library_geometries><geometry id='g' name='part'><mesh>"
         "<source id='s'><float_array count='12'>0 0 0  1 0 0\n0 1 0  0 0 1</float_array><technique_common>"
         "<accessor stride='3'/></technique_common></source><vertices id='v'><input semantic='POSITION' "
         "source='#s'/>"
         "</vertices>\n<triangles><input semantic='NORMAL' source='#s' offset='1'/><input semantic='VERTEX' "
         "source='#v' "
         "offset='0'/><p>0 9 2 9 1 9  0 9 1 9 3 9</p></triangles>\n<polylist><input semantic='VERTEX' "
         "source='#v' "
         "offset='0'/>" +
         list +
         "</polylist></mesh></geometry></library_geometries>"
         "<library_nodes><node id='n'><instance_geometry url='#g'/></node></library_nodes>\n"
         "<library_visual_scenes><visual_scene id='scene'>" +
         scene +
         "</visual_scene></library_visual_scenes><scene><instance_visual_scene "
         "url='#scene'/></scene></COLLADA>";
}

TEST_F(MeshImport, ColladaScenesAreReadInMetres) {
  const auto whole = [&](const std::string& text) {
    return volume_properties(import_solid(write("a.dae", text)));
  };
  const VolumeProperties plain = whole(dae("<node><instance_geometry url='#g'/></node>"));
  EXPECT_NEAR(plain.volume, 1.0 / 6.0, 1e-15);
  EXPECT_LT((plain.p_BBcm - Vec3(0.25, 0.25, 0.25)).norm(), 1e-15);  // y up or not
  // In inches: moved by 1 2 3, turned by 90 degrees about z, scaled by 1 1 2, and an instance of a node.
  const VolumeProperties moved =
      whole(dae("<node><translate>1 2 3</translate><rotate>0 0 1 90</rotate><scale>1 1 2</scale>"
                "<instance_node url='#n'/></node>",
                "0.0254"));
  EXPECT_NEAR(moved.volume, std::pow(0.0254, 3) / 3.0, 1e-18);
  EXPECT_LT((moved.p_BBcm - 0.0254 * Vec3(0.75, 2.25, 3.5)).norm(), 1e-8);
  const VolumeProperties mirrored = whole(
      dae("<node><matrix>-1 0 0 5 0 1 0 0 0 0 1 0 0 0 0 1</matrix><instance_geometry url='#g'/></node>"));
  EXPECT_NEAR(mirrored.volume, 1.0 / 6.0, 1e-12);  // outward still
  EXPECT_LT((mirrored.p_BBcm - Vec3(4.75, 0.25, 0.25)).norm(), 1e-6);
  EXPECT_EQ(import_mesh_objects(
                write("b.dae", dae("<node><instance_geometry url='#g'/><node><translate>3 0 0</translate>"
                                   "<instance_geometry url='#g'/></node></node>")))
                .size(),
            2u);
}

// COLLADA 1.4, "convex_mesh": the same contents as <mesh>, as PhysX and the collision meshes of PR2 have them.
TEST_F(MeshImport, ConvexMeshesOfColladaAreMeshes) {
  std::string text = dae("<node><instance_geometry url='#g'/></node>");
  for (const char* tag : {"<mesh>", "</mesh>"}) {
    const std::size_t at = text.find(tag) + std::string(tag).find("mesh");
    text.insert(at, "convex_");
  }
  EXPECT_NEAR(volume_properties(import_solid(write("a.dae", text))).volume, 1.0 / 6.0, 1e-15);
  text.insert(text.find("<convex_mesh") + std::string("<convex_mesh").size(), " convex_hull_of='#h'");
  EXPECT_THAT(refusal_of("b.dae", text), HasSubstr("line 2: <convex_mesh>: convex_hull_of is not supported"));
}

TEST_F(MeshImport, FaultsOfColladaAreNamedWithTheirLine) {
  const std::string node = "<node><instance_geometry url='#g'/></node>";
  EXPECT_THAT(refusal_of("a.dae", "<COLLADA"), HasSubstr("not well-formed XML"));
  EXPECT_THAT(refusal_of("b.dae", "<svg/>"), HasSubstr("the root element is not <COLLADA>"));
  EXPECT_THAT(refusal_of("c.dae", dae("")), HasSubstr("no faces"));
  EXPECT_THAT(refusal_of("d.dae", dae("<node><instance_geometry url='#x'/></node>")),
              HasSubstr("<instance_geometry>: found '#x'; allowed: # and the id of a <geometry>"));
  EXPECT_THAT(refusal_of("e.dae", dae(node, "0")),
              HasSubstr("line 1: <unit>: meter: found '0'; allowed: a number > 0"));
  EXPECT_THAT(refusal_of("f.dae", dae(node, "1", "<vcount>3 4</vcount><p>0 3 2 1 2 3</p>")),
              HasSubstr("line 5: <p>: <vcount> does not fit the number of corners"));
  EXPECT_THAT(refusal_of("g.dae", dae(node, "1", "<vcount>3</vcount><p>0 3 4</p>")),
              HasSubstr("line 5: <p>: index 4 is out of range; there are 4 positions"));
  EXPECT_THAT(refusal_of("h.dae", dae(node, "1", "<vcount>3</vcount><p>0 3 x</p>")),
              HasSubstr("<p>: found 'x'; allowed: numbers between white space"));
  EXPECT_THAT(refusal_of("i.dae", dae("<node id='m'><instance_node url='#m'/></node>")),
              HasSubstr("nodes are nested in themselves"));
  EXPECT_THAT(refusal_of("j.dae", dae("<node><lookat>0 0 0 0 0 0 0 0 0</lookat></node>")),
              HasSubstr("<lookat>: this transformation is not supported"));
}

TEST_F(MeshImport, ColladaWithMorePositionsThanMemoryHoldsIsRefused) {
  constexpr std::size_t kInstances = 1001, kPositions = 20'000;  // 20 million positions are allowed
  std::string positions, instances;
  for (std::size_t i = 0; i < kPositions; ++i) positions += "0 0 0 ";
  for (std::size_t i = 0; i < kInstances; ++i) instances += "<instance_geometry url='#g'/>";
  std::string text = dae("<node>" + instances + "</node>");
  const std::string four = "0 0 0  1 0 0\n0 1 0  0 0 1";
  text.replace(text.find(four), four.size(), positions);
  EXPECT_THAT(refusal_of("a.dae", text),
              HasSubstr("line 2: <float_array>: with all instances of geometries the file has "
                        "more than 20000000 positions"));
}

TEST_F(MeshImport, OtherFilesThanMeshesAreRefused) {
  EXPECT_THAT(refusal(directory_ / "missing.obj"), HasSubstr("no such file"));
  EXPECT_THAT(refusal(directory_), HasSubstr("not supported"));
  fs::create_directories(directory_ / "folder.obj");
  EXPECT_THAT(refusal(directory_ / "folder.obj"), HasSubstr("not a regular file"));
  EXPECT_THAT(refusal_of("a.step", "ISO-10303-21;"),
              HasSubstr("'.step' is not supported; allowed are .obj, .stl, .glb and .dae"));
  for (const char* name : {"a.obj", "a.stl", "a.glb", "a.dae"}) {
    EXPECT_THAT(refusal_of(name, ""), HasSubstr("empty"));
    EXPECT_THAT(refusal_of(name, " \n\n"), HasSubstr("empty"));
  }
  EXPECT_THAT(refusal_of("b.obj", "# only a comment\n"), HasSubstr("no vertices"));
  EXPECT_THAT(refusal_of("c.obj", kVertices), HasSubstr("no faces"));
  EXPECT_THAT(refusal_of("b.stl", binary_stl({}, {})), HasSubstr("no triangles"));
  EXPECT_THAT(refusal_of("c.stl", "solid a\nendsolid a\n"), HasSubstr("no facets"));
  EXPECT_THAT(refusal_of("d.glb", glb(kCorners, {})), HasSubstr("mesh file"));
}

TEST_F(MeshImport, AnInvalidScaleIsRefused) {
  const auto file = write("a.obj", kVertices + kFaces);
  for (const double scale :
       {0.0, -1.0, std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()})
    EXPECT_THROW(import_mesh_objects(file, scale), MeshError);
}

TEST_F(MeshImport, InvalidNumbersInObjAreRefused) {
  for (const char* bad : {"nan", "inf", "-inf", "NaN", "1e400", "1e39"})
    EXPECT_THAT(
        refusal_of("a.obj", "o part\nv 0 0 0\nv 1 " + std::string(bad) + " 0\nv 0 1 0\nv 0 0 1\n" + kFaces),
        HasSubstr("line 3: coordinate 2 of vertex 2: '" + std::string(bad) + "' is not a finite number"));
  for (const char* bad : {"abc", "1.0x", "1,5", "0x10", "--1"})
    EXPECT_THAT(refusal_of("a.obj", "v 0 0 0\nv 1 0 " + std::string(bad) + "\nv 0 1 0\nv 0 0 1\n" + kFaces),
                HasSubstr("line 2: coordinate 3 of vertex 2: '" + std::string(bad) + "' is not a number"));
  EXPECT_THAT(refusal_of("a.obj", "v 0 0 0\nv 1 0\nv 0 1 0\nv 0 0 1\n" + kFaces),
              HasSubstr("line 2: vertex 2 needs three coordinates, found 2"));
}

TEST_F(MeshImport, WrongFacesInObjAreRefused) {
  EXPECT_THAT(refusal_of("a.obj", kVertices + "f 1 3 2\nf 1 2 9\n", false),
              HasSubstr("line 6: vertex 3 of the face: index 9 is out of range, the file has 4 vertices"));
  EXPECT_THAT(refusal_of("a.obj", kVertices + "f 1 0 2\n", false),
              HasSubstr("line 5: vertex 2 of the face: index 0"));
  EXPECT_THAT(refusal_of("a.obj", kVertices + "f 1 -5 2\n", false), HasSubstr("index -5 is out of range"));
  EXPECT_THAT(refusal_of("a.obj", kVertices + "f 1 x 2\n", false), HasSubstr("'x' is not an index"));
  EXPECT_THAT(refusal_of("a.obj", kVertices + "f 1 2\n", false),
              HasSubstr("line 5: a face needs three vertices"));
}

TEST_F(MeshImport, InvalidTextStlIsRefused) {
  std::string bad = text_stl();
  bad.replace(bad.find("vertex 0.000000"), 15, "vertex nan");
  EXPECT_THAT(refusal_of("a.stl", bad), HasSubstr("line 4: coordinate 1 of a vertex: 'nan'"));
  const std::string whole = text_stl();
  EXPECT_THAT(refusal_of("a.stl", whole.substr(0, whole.find("endloop"))),
              HasSubstr("inside facet 1: it is truncated"));
  EXPECT_THAT(refusal_of("a.stl", whole.substr(0, whole.find("endsolid"))), HasSubstr("endsolid is missing"));
  std::string two = whole;
  two.erase(two.find("  vertex"), two.find('\n', two.find("  vertex")) - two.find("  vertex") + 1);
  EXPECT_THAT(refusal_of("a.stl", two), HasSubstr("line 7: a facet needs exactly three vertices, found 2"));
  EXPECT_THAT(refusal_of("a.stl", "solid a\nhello\nendsolid\n"), HasSubstr("line 2: unknown word 'hello'"));
}

TEST_F(MeshImport, InvalidBinaryStlIsRefused) {
  const std::string whole = binary_stl(kCorners, kTriangles);
  EXPECT_THAT(refusal_of("a.stl", whole.substr(0, whole.size() - 30)),
              HasSubstr("announces 4 triangles, that is 284 bytes, but the file has 254 bytes"));
  EXPECT_THAT(refusal_of("a.stl", whole + "extra"), HasSubstr("but the file has 289 bytes"));
  EXPECT_THAT(refusal_of("a.stl", whole.substr(0, 50)), HasSubstr("a header of 84 bytes, this file has 50"));
  auto corners = kCorners;
  corners[3][1] = std::numeric_limits<float>::quiet_NaN();
  EXPECT_THAT(refusal_of("a.stl", binary_stl(corners, kTriangles)),
              HasSubstr("triangle 1, corner 2: coordinate 2 is not finite"));
}

TEST_F(MeshImport, InvalidGlbIsRefused) {
  const std::string whole = glb(kCorners, kTriangles);
  EXPECT_THAT(refusal_of("a.glb", whole.substr(0, whole.size() - 20)), HasSubstr("it is truncated"));
  EXPECT_THAT(refusal_of("a.glb", whole.substr(0, 10)), HasSubstr("header of 20 bytes"));
  EXPECT_THAT(refusal_of("a.glb", "not a glb file at all, just text"),
              HasSubstr("starts with the word glTF"));
  std::string garbled = whole;
  garbled[21] = '!';
  EXPECT_THAT(refusal_of("a.glb", garbled), HasSubstr("cannot be understood"));
  auto corners = kCorners;
  corners[3][1] = std::numeric_limits<float>::infinity();
  EXPECT_THAT(refusal_of("a.glb", glb(corners, kTriangles)),
              HasSubstr("object 'body', vertex 3: the position (0, inf, 1)"));
  auto triangles = kTriangles;
  triangles[3][2] = 9;
  EXPECT_THAT(refusal_of("a.glb", glb(kCorners, triangles), false), HasSubstr("out of range"));
}

TEST_F(MeshImport, SurfacesThatBoundNoSolidAreRefused) {
  EXPECT_THAT(refusal_of("a.obj", "o part\n" + kVertices + "f 1 3 2\nf 1 2 4\nf 1 4 3\n"),
              HasSubstr("object 'part': the edge from vertex"));
  EXPECT_THAT(refusal_of("a.obj", "o part\n" + kVertices + "f 1 3 2\nf 1 2 4\nf 1 4 3\n"),
              HasSubstr("has a hole"));
  EXPECT_THAT(refusal_of("a.obj", kVertices + "f 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 4 3\n"),
              HasSubstr("same direction"));
  EXPECT_THAT(refusal_of("a.obj", kVertices + "f 1 2 3\nf 1 4 2\nf 1 3 4\nf 2 4 3\n"),
              HasSubstr("point inwards"));
  EXPECT_THAT(refusal_of("a.obj", kVertices + kFaces + "f 1 2 2\n"), HasSubstr("has no area"));
  EXPECT_THAT(refusal_of("a.obj", kVertices + kFaces + "f 1 3 2\n"), HasSubstr("belongs to 3 triangles"));
  EXPECT_THAT(refusal_of("a.stl", binary_stl(kCorners, {kTriangles[0], kTriangles[1], kTriangles[2]})),
              HasSubstr("has a hole"));
}

}  // namespace
}  // namespace takt

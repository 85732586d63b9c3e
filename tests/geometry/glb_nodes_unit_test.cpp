// The nodes of a GLB file as meshes: their names, frames and places.
#include "server/geometry/mesh/glb_nodes.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>
#include <string>

#include "idl/common/mesh_path.h"
#include "server/geometry/mesh/import.h"
#include "tests/support/glb_file.h"
#include "tests/support/temporary_directory.h"

namespace takt::test {
namespace {

using ::testing::AllOf;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

class GlbNodesTest : public ::testing::Test {
 protected:
  void SetUp() override { directory_.write("cell.glb", glb_cell()); }
  std::filesystem::path node(const std::string& name) const { return directory_ / ("cell.glb#" + name); }
  std::string node_refusal(const std::string& mesh) const {
    try {
      import_mesh_objects(directory_ / mesh);
      return "";
    } catch (const MeshError& error) {
      return error.what();
    }
  }
  Pose cad_pose(const std::string& name) const { return upright(list_mesh_nodes(node(name)).front().X_FN); }

  TemporaryDirectory directory_;
};

TEST_F(GlbNodesTest, ANodeIsAMeshInItsFrameWithItsScale) {
  // The tetrahedron between the origin and points at 2 on the axes.
  const VolumeProperties housing = volume_properties(import_solid(node("Housing")));
  EXPECT_NEAR(housing.volume, 8.0 / 6.0, 1e-14);
  EXPECT_LT((housing.p_BBcm - Vec3(0.5, 0.5, 0.5)).norm(), 1e-14);
  // Without scale the coordinates of the file, bit by bit; lines beside the faces are passed over.
  const auto bolt = import_mesh_objects(node("Frame/Bolt"));
  ASSERT_EQ(bolt.size(), 1U);
  EXPECT_EQ(bolt[0].mesh.vertices, import_mesh_objects(node("Plate/Bolt"))[0].mesh.vertices);
  EXPECT_THAT(bolt[0].mesh.vertices, Contains(Vec3(1.0, 0.0, 0.0)));
  ASSERT_EQ(bolt[0].findings.size(), 1U);
  EXPECT_EQ(bolt[0].findings[0].kind, MeshDiagnosticKind::no_faces);
  EXPECT_EQ(bolt[0].findings[0].count, 2U);
  EXPECT_THAT(bolt[0].findings[0].sentence,
              HasSubstr("2 primitives draw lines or points, which bound nothing, the first is "
                        "meshes[3].primitives[0]"));
}

TEST_F(GlbNodesTest, ANodeBringsTheNodesBelowIt) {
  // In the frame of Frame: the housing at (0.5, 0, 0), the bolt at (0, 0.25, 0).
  const auto frame = import_mesh_objects(node("Frame"), 10.0);
  ASSERT_EQ(frame.size(), 2U);
  EXPECT_EQ(frame[0].name, "Cell/Frame/Housing");
  EXPECT_LT((volume_properties(frame[0].mesh).p_BBcm - Vec3(10.0, 5.0, 5.0)).norm(), 1e-13);
  EXPECT_LT((volume_properties(frame[1].mesh).p_BBcm - Vec3(2.5, 5.0, 2.5)).norm(), 1e-13);
}

TEST_F(GlbNodesTest, MeshAndPlaceOfANodeTogetherAreTheFile) {
  // The second way: the whole file, in its own axes.
  const auto whole = import_mesh_objects(directory_ / "cell.glb", 0.5);
  ASSERT_EQ(whole.size(), 4U);
  for (const NamedMesh& object : whole) {
    const auto file = node(object.name);
    const Pose X_FN = list_mesh_nodes(file, 0.5).front().X_FN;
    const TriangleMesh mesh = import_mesh_objects(file, 0.5)[0].mesh;
    ASSERT_EQ(mesh.triangles, object.mesh.triangles);
    for (std::size_t i = 0; i < mesh.vertices.size(); ++i)
      EXPECT_LT((X_FN * mesh.vertices[i] - object.mesh.vertices[i]).norm(), 1e-12) << object.name;
  }
}

TEST_F(GlbNodesTest, UprightPosesAreThoseOfTheCadProgram) {
  EXPECT_LT((cad_pose("Frame").p - Vec3(1.0, 2.0, 3.0)).norm(), 1e-14);
  // The frame's x axis is the y axis of the CAD program.
  const Pose housing = cad_pose("Housing");
  EXPECT_LT((housing.p - Vec3(1.0, 2.5, 3.0)).norm(), 1e-14);
  EXPECT_LT((housing.R.col(0) - Vec3::UnitY()).norm(), 1e-14);
  EXPECT_LT((housing.R.col(2) - Vec3::UnitZ()).norm(), 1e-14);
}

TEST_F(GlbNodesTest, AWrongNameIsRefusedWithTheNamesThatExist) {
  EXPECT_THAT(node_refusal("cell.glb#Hosing"),
              AllOf(HasSubstr("cell.glb#Hosing: the node 'Hosing' is not there; nodes with faces are "
                              "'Cell/Frame/Housing', 'Cell/Frame/Bolt', 'Cell/Plate', 'Cell/Plate/Bolt'.")));
  EXPECT_THAT(node_refusal("cell.glb#Bolt"),
              HasSubstr("is not unique: there are 'Cell/Frame/Bolt', 'Cell/Plate/Bolt'; allowed is one"));
  EXPECT_THAT(node_refusal("cell.glb#Drawing"), HasSubstr("the node 'Drawing' has no faces"));
  EXPECT_THAT(node_refusal("missing.glb#A"), HasSubstr("no such file"));
  directory_.write("a.obj", "v 0 0 0\n");
  EXPECT_THAT(node_refusal("a.obj#A"), HasSubstr("only GLB files have nodes; allowed is "));
  directory_.write("lines.glb", glb_file(R"([{"mesh":2}])", "[0]"));
  EXPECT_THAT(node_refusal("lines.glb"), HasSubstr("there are no faces in it"));
  directory_.write("flat.glb", glb_file(R"([{"name":"A","mesh":0,"scale":[1,0,1]}])", "[0]"));
  EXPECT_THAT(node_refusal("flat.glb#A"), HasSubstr("the transform of the node 'A' makes it flat"));
  directory_.write("long.glb", glb_file(R"([{"name":"A","mesh":0,"rotation":[0,0,0,2]}])", "[0]"));
  EXPECT_THAT(node_refusal("long.glb"), HasSubstr("nodes[0]: its rotation has the length 2"));
}

TEST_F(GlbNodesTest, NamesAreTakenFromOutsideInwards) {
  // An instance and its shape often have one name: the outer one is meant. Without a name: the number.
  directory_.write("a.glb", glb_file(R"([{"name":"A","children":[1]},{"name":"Bolt","children":[2,3]},)"
                                     R"({"name":"Bolt","mesh":0},{"mesh":0},{"name":"Bolt","mesh":0}])",
                                     "[0,4]"));
  EXPECT_EQ(import_mesh_objects(directory_ / "a.glb#A/Bolt").size(), 2U);
  EXPECT_EQ(import_mesh_objects(directory_ / "a.glb#Bolt/Bolt").size(), 1U);
  EXPECT_EQ(import_mesh_objects(directory_ / "a.glb#Bolt").size(), 1U);  // a whole path
  std::vector<std::string> paths;
  for (const MeshNode& n : list_mesh_nodes(directory_ / "a.glb")) paths.push_back(n.path);
  EXPECT_THAT(paths, ElementsAre("A", "A/Bolt", "A/Bolt/Bolt", "A/Bolt/nodes[3]", "Bolt"));
}

TEST_F(GlbNodesTest, AFileWithTheSignInItsNameIsAFile) {
  directory_.write("a#b.glb", glb_cell());
  EXPECT_EQ(split_mesh_path(directory_ / "a#b.glb").node, "");
  EXPECT_EQ(split_mesh_path(directory_ / "a#b.glb#Frame").node, "Frame");
  EXPECT_EQ(mesh_label(directory_ / "a#b.glb#Cell/Frame"), "a#b.glb#Cell/Frame");
  EXPECT_EQ(mesh_label(directory_ / "a#b.glb"), "a#b.glb");
}

TEST(GlbTransforms, ARandomMapIsAPoseAndAStretchWithoutRotation) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> number(-1.0, 1.0);
  for (int i = 0; i < 200; ++i) {
    Affine X;
    for (int k = 0; k < 9; ++k) X.A(k / 3, k % 3) = number(random);
    X.p = {number(random), number(random), number(random)};
    const auto [pose, stretch] = rigid_part(X, "A");
    EXPECT_NEAR(pose.R.determinant(), 1.0, 1e-12);
    EXPECT_LT((pose.R.transpose() * pose.R - Mat3::Identity()).norm(), 1e-12);
    EXPECT_LT((pose.R * stretch.A - X.A).norm(), 1e-12);
    EXPECT_EQ(pose.p, X.p);
    // The rest is symmetric but for the mirror.
    Mat3 rest = stretch.A;
    if (X.A.determinant() < 0.0) rest.row(0) *= -1.0;
    EXPECT_LT((rest - rest.transpose()).norm(), 1e-12);
  }
}

}  // namespace
}  // namespace takt::test

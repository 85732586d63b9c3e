// The committed meshes: equal to the generator's output, closed, and with the volumes and centres of the
// drawings (those of the contact scenes: contact_meshes_regression_test.cpp).
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "server/geometry/convex/overlap.h"
#include "server/geometry/mesh/import.h"

namespace takt {
namespace {

namespace fs = std::filesystem;

const fs::path kMeshes = fs::path(TAKT_CONFIG_DIR) / "meshes";

std::string content(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  EXPECT_TRUE(stream) << file;
  return {std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
}

/// Volume and first moment, added up from simple bodies.
struct Moments {
  double volume = 0.0;
  Vec3 first = Vec3::Zero();

  void add(double v, const Vec3& center) {
    volume += v;
    first += v * center;
  }
  Vec3 center() const { return first / volume; }
};

/// Rectangular frustum at (x, y) between heights z0 and z1: a x b at z0, growing by 2 `slope` per height.
/// Simpson's rule is exact for its cross-section (a square polynomial in z) and for z times it.
void add_frustum(Moments& m, double sign, double x, double y, double z0, double z1, double a, double b,
                 double slope) {
  const double h = z1 - z0;
  const auto area = [&](double z) { return (a + 2.0 * slope * (z - z0)) * (b + 2.0 * slope * (z - z0)); };
  const double middle = 0.5 * (z0 + z1);
  const double volume = h / 6.0 * (area(z0) + 4.0 * area(middle) + area(z1));
  const double moment = h / 6.0 * (z0 * area(z0) + 4.0 * middle * area(middle) + z1 * area(z1));
  m.volume += sign * volume;
  m.first += sign * Vec3(volume * x, volume * y, moment);
}

/// A pocket of size a x b from the floor to the top, its rim widened by a chamfer of 2 mm.
void take_pocket(Moments& m, double x, double a, double b, double floor, double top) {
  m.add(-a * b * (top - 0.002 - floor), {x, 0.0, 0.5 * (top - 0.002 + floor)});
  add_frustum(m, -1.0, x, 0.0, top - 0.002, top, a, b, 1.0);
}

/// A block with its bottom edges chamfered by 2 mm.
void add_inserted_block(Moments& m, double a, double b, double height) {
  add_frustum(m, 1.0, 0.0, 0.0, 0.0, 0.002, a - 0.004, b - 0.004, 1.0);
  m.add(a * b * (height - 0.002), {0.0, 0.0, 0.5 * (height + 0.002)});
}

std::map<std::string, Moments> drawings() {
  std::map<std::string, Moments> all;
  Moments& b = all["B"];
  b.add(0.220 * 0.120 * 0.060, {0.0, 0.0, 0.030});
  take_pocket(b, -0.060, 0.060, 0.080, 0.020, 0.060);
  take_pocket(b, 0.040, 0.080, 0.080, 0.020, 0.060);
  add_inserted_block(all["C"], 0.059, 0.079, 0.080);
  add_inserted_block(all["O"], 0.079, 0.079, 0.080);
  take_pocket(all["O"], 0.015, 0.030, 0.030, 0.030, 0.080);
  add_inserted_block(all["P"], 0.029, 0.029, 0.080);
  Moments& table = all["table"];
  table.add(0.9 * 0.7 * 0.04, {0.0, 0.0, -0.02});
  table.add(4.0 * 0.05 * 0.05 * 0.66, {0.0, 0.0, -0.37});
  all["gripper_body"].add(0.08 * 0.17 * 0.08, {0.0, 0.0, 0.04});
  all["gripper_jaw"].add(0.03 * 0.015 * 0.12, {0.0, 0.0075, 0.14});
  return all;
}

TEST(Meshes, TheGeneratorMakesTheCommittedFilesByteForByte) {
  const fs::path directory = fs::temp_directory_path() / ("takt_meshes_" + std::to_string(::getpid()));
  const std::string command = std::string(TAKT_BIN_DIR) + "/takt-make-meshes " + directory.string();
  ASSERT_EQ(std::system(command.c_str()), 0) << command;
  int files = 0;
  for (const auto& entry : fs::recursive_directory_iterator(directory)) {
    if (!entry.is_regular_file()) continue;
    const fs::path name = fs::relative(entry.path(), directory);
    EXPECT_EQ(content(entry.path()), content(kMeshes / name))
        << name << " differs: run takt-make-meshes config/meshes";
    ++files;
  }
  EXPECT_EQ(files, 9 + 15);  // the last of contact/
  fs::remove_all(directory);
}

TEST(Meshes, VolumesAndCentresAreThoseOfTheDrawings) {
  for (const auto& [name, expected] : drawings()) {
    const VolumeProperties found = volume_properties(import_solid(kMeshes / (name + ".obj")));
    EXPECT_NEAR(found.volume / expected.volume, 1.0, 1e-9) << name;
    EXPECT_LT((found.p_BBcm - expected.center()).norm(), 1e-9 * std::cbrt(expected.volume)) << name;
  }
}

TEST(Meshes, FlatFacesAreMeshedForSurfaceContact) {
  for (const char* name : {"B", "C", "O", "P", "gripper_jaw"}) {
    const TriangleMesh mesh = import_solid(kMeshes / (std::string(name) + ".obj"));
    for (const auto& t : mesh.triangles)
      for (std::size_t k = 0; k < 3; ++k) {
        const double length = (mesh.vertices[t[k]] - mesh.vertices[t[(k + 1) % 3]]).norm();
        EXPECT_LT(length, 0.0105) << name;  // the diagonal of the largest cell, 7.4 mm square
        EXPECT_GT(length, 0.0009) << name;
      }
  }
}

TEST(Meshes, ConvexPiecesAreConvexAndFillTheirBlock) {
  const std::map<std::string, std::vector<std::size_t>> corners{{"B", {8, 10, 10, 10, 12, 10}},
                                                                {"O", {12, 10, 10, 10, 10}}};
  for (const auto& [name, counts] : corners) {
    const auto pieces = import_mesh_objects(kMeshes / (name + "_convex.obj"));
    ASSERT_EQ(pieces.size(), counts.size());
    double volume = 0.0;
    for (std::size_t i = 0; i < pieces.size(); ++i) {
      const TriangleMesh& mesh = pieces[i].mesh;
      EXPECT_EQ(check_closed(mesh).problem, "") << pieces[i].name;
      EXPECT_EQ(convex_hull_vertices(mesh.vertices).size(), counts[i]) << name << " " << pieces[i].name;
      for (const auto& t : mesh.triangles) {
        const Vec3 n =
            (mesh.vertices[t[1]] - mesh.vertices[t[0]]).cross(mesh.vertices[t[2]] - mesh.vertices[t[0]]);
        for (const Vec3& v : mesh.vertices)
          EXPECT_LE(n.normalized().dot(v - mesh.vertices[t[0]]), 1e-12) << name << " " << pieces[i].name;
      }
      volume += volume_properties(mesh).volume;
    }
    // The chamfers that run through take a little more than the drawing.
    const double exact = drawings().at(name).volume;
    EXPECT_LT(volume, exact) << name;
    EXPECT_GT(volume, 0.9990 * exact) << name;
    const std::string text = content(kMeshes / (name + "_convex.obj"));
    std::ostringstream stated;
    stated.precision(4);
    stated << std::fixed << std::showpos << "volume " << 100.0 * (volume / exact - 1.0) << " %";
    EXPECT_NE(text.find(stated.str()), std::string::npos) << stated.str();
  }
}

TEST(Meshes, InsertedPartsHaveTheirClearance) {
  const auto pieces_of = [](const std::string& name) {
    std::vector<ConvexShape> shapes;
    for (const auto& piece : import_mesh_objects(kMeshes / (name + ".obj")))
      shapes.push_back(ConvexShape::from_points(convex_hull_vertices(piece.mesh.vertices)));
    return shapes;
  };
  struct Case {
    std::string inserted;
    std::string into;
    Vec3 p;
  };
  for (const Case& c :
       {Case{"C", "B_convex", {-0.060, 0.0, 0.020}}, Case{"O_convex", "B_convex", {0.040, 0.0, 0.020}},
        Case{"P", "O_convex", {0.015, 0.0, 0.030}}}) {
    const auto overlap = [&](const Vec3& p) {
      for (const ConvexShape& a : pieces_of(c.inserted))
        for (const ConvexShape& b : pieces_of(c.into))
          if (convex_overlap(a, {Mat3::Identity(), p}, b, Pose{}, 0.0)) return true;
      return false;
    };
    const Vec3 lifted = c.p + Vec3(0, 0, 1e-5);
    EXPECT_TRUE(overlap(c.p)) << c.inserted << " stands on the floor of the pocket";
    EXPECT_FALSE(overlap(lifted)) << c.inserted;
    for (const Vec3& side : {Vec3(1, 0, 0), Vec3(-1, 0, 0), Vec3(0, 1, 0), Vec3(0, -1, 0)}) {
      EXPECT_FALSE(overlap(lifted + 0.49e-3 * side)) << c.inserted;
      EXPECT_TRUE(overlap(lifted + 0.51e-3 * side)) << c.inserted;
    }
  }
}

TEST(Meshes, PReachesIntoTheConvexHullOfB) {
  // Why partner search is needed: by their hulls, P touches B as well as O.
  const auto hull = [](const char* name) {
    return ConvexShape::from_points(convex_hull_vertices(import_solid(kMeshes / name).vertices));
  };
  const ConvexShape b = hull("B.obj");
  const ConvexShape p = hull("P.obj");
  EXPECT_EQ(b.vertices.size(), 8U);
  EXPECT_EQ(p.vertices.size(), 12U);
  const Vec3 assembled = Vec3(0.040, 0, 0.020) + Vec3(0.015, 0, 0.030);
  EXPECT_TRUE(convex_overlap(p, {Mat3::Identity(), assembled}, b, Pose{}, 0.0));
  EXPECT_TRUE(convex_overlap(p, {Mat3::Identity(), assembled + Vec3(0, 0, 0.0099)}, b, Pose{}, 0.0));
  EXPECT_FALSE(convex_overlap(p, {Mat3::Identity(), assembled + Vec3(0, 0, 0.0101)}, b, Pose{}, 0.0));
}

}  // namespace
}  // namespace takt

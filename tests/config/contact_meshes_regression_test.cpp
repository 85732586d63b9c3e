// Meshes of the contact scenes: closed, with the volumes of closed forms, with exactly the clearance in their
// names; and the large ones, which are made on request.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <numbers>
#include <string>
#include <vector>

#include "server/geometry/mesh/import.h"
#include "tests/support/temporary_directory.h"

namespace takt {
namespace {

namespace fs = std::filesystem;

constexpr double kPi = std::numbers::pi;
const fs::path kContactMeshes = fs::path(TAKT_CONFIG_DIR) / "meshes" / "contact";

TriangleMesh committed(const std::string& name) {
  return import_solid(kContactMeshes / (name + ".obj"));
}

/// Area of n flats at distance 1 from their centre.
double polygon_area(int n) {
  return n * std::tan(kPi / n);
}

/// Cylinder of flats with both ends chamfered at 45 degrees (two frustums).
double peg_volume(int facets, double r, double length, double c) {
  return polygon_area(facets) *
         (r * r * (length - 2 * c) + 2 * c / 3.0 * (r * r + r * (r - c) + (r - c) * (r - c)));
}

/// Volume of a hole, its upper rim chamfered.
double hole_volume(int facets, double r, double depth, double c, int rims) {
  return polygon_area(facets) *
         (r * r * (depth - rims * c) + rims * c / 3.0 * (r * r + r * (r + c) + (r + c) * (r + c)));
}

/// Box a x a x h, bottom edges chamfered by c.
double box_volume(double a, double h, double c) {
  const double b = a - 2 * c;
  return a * a * (h - c) + c / 3.0 * (a * a + a * b + b * b);
}

TEST(ContactMeshes, VolumesAreThoseOfClosedForms) {
  const double fall = 0.4 * std::tan(kPi / 9.0);
  const double many = polygon_area(24);
  const std::map<std::string, double> expected{
      {"plate", 0.6 * 0.4 * 0.02},
      {"block", box_volume(0.04, 0.04, 0.001)},
      {"slab", box_volume(0.06, 0.02, 0.001)},
      {"wedge_20deg", 0.3 * 0.4 * (0.02 + 0.5 * fall)},
      {"hole", many * 0.03 * 0.03 * 0.04 - hole_volume(24, 0.01, 0.03, 0.001, 1)},
      {"bush", many * 0.02 * 0.02 * 0.03 - hole_volume(24, 0.01, 0.03, 0.001, 2)},
      {"peg_100um", peg_volume(24, 0.0099, 0.05, 0.002)},
      {"peg_10um", peg_volume(24, 0.00999, 0.05, 0.002)},
      {"peg_1um", peg_volume(24, 0.009999, 0.05, 0.002)},
      {"press_peg", peg_volume(24, 0.01001, 0.06, 0.002)}};
  for (const auto& [name, volume] : expected)
    EXPECT_NEAR(volume_properties(committed(name)).volume / volume, 1.0, 2e-6) << name;
}

TEST(ContactMeshes, VolumesOfCurvedBodiesComeCloseToThoseOfTheirShape) {
  const auto ratio = [](const char* name, double volume) {
    return volume_properties(committed(name)).volume / volume;
  };
  // Inscribed: less, by about 1 - 5/8 (edge / radius)^2 and the like.
  EXPECT_NEAR(ratio("sphere", 4.0 / 3.0 * kPi * std::pow(0.025, 3)), 0.9980, 0.0004);
  // Pappus for the tube's polygon of 24 corners, around 128 flats.
  const double tube = 12.0 * std::sin(kPi / 12.0) * 0.003 * 0.003;
  EXPECT_NEAR(ratio("ring", 2.0 * polygon_area(128) * 0.02 * tube), 1.0, 1e-6);
  // Length of the centre line times the section; outward and inward bends cancel.
  const double section = 16.0 * std::sin(kPi / 16.0) * 0.004 * 0.004;
  EXPECT_NEAR(ratio("hook", section * (0.06 + 0.015 * kPi * 10.0 / 9.0)), 1.0, 1e-3);
  // Wave and chamfer, summed up over fine slices of 48 sectors.
  // Not `const`: a compiler that sees constants sums up while it compiles, for 15 s.
  volatile int slices = 20000;
  const auto thread = [&slices](double radius, double length, const auto& with_chamfer) {
    const int n = slices;
    double volume = 0.0;
    for (int i = 0; i < n; ++i) {
      const double z = length * (i + 0.5) / n;
      const auto r = [&](int j) {
        return with_chamfer(radius + 0.0005 * std::sin(2.0 * kPi * (z / 0.004 - j / 48.0)), z);
      };
      for (int j = 0; j < 48; ++j) volume += 0.5 * std::sin(kPi / 24.0) * r(j) * r(j + 1) * length / n;
    }
    return volume;
  };
  const double bolt = thread(0.0084, 0.032, [](double r, double z) { return std::min(r, 0.0074 + z); });
  const double hole =
      thread(0.0085, 0.028, [](double r, double z) { return std::max(r, 0.0095 - std::min(z, 0.028 - z)); });
  const double disc = 24.0 * std::sin(kPi / 24.0);
  EXPECT_NEAR(ratio("bolt", bolt + disc * 0.013 * 0.013 * 0.006), 1.0, 1e-3);
  EXPECT_NEAR(ratio("socket", disc * 0.016 * 0.016 * 0.028 - hole), 1.0, 1e-3);
}

/// Least distance of a vertex in the given part of the mesh from the axis, over the flats of its prism.
double radius_over_flats(const TriangleMesh& mesh, double z0, double z1, int facets, bool inner) {
  double result = inner ? 1.0 : 0.0;
  for (const Vec3& v : mesh.vertices) {
    if (v.z() < z0 || v.z() > z1) continue;
    double support = 0.0;  // of this vertex, over the flats' normals
    for (int j = 0; j < facets; ++j)
      support =
          std::max(support, v.x() * std::cos(2 * kPi * j / facets) + v.y() * std::sin(2 * kPi * j / facets));
    result = inner ? std::min(result, support) : std::max(result, support);
  }
  return result;
}

TEST(ContactMeshes, PegsHaveTheClearanceInTheirName) {
  const double hole = radius_over_flats(committed("hole"), 0.005, 0.0285, 24, true);
  EXPECT_NEAR(hole, 0.010, 2e-9);  // coordinates are whole nanometres, in single precision
  EXPECT_NEAR(radius_over_flats(committed("bush"), 0.005, 0.0285, 24, true), 0.010, 2e-9);
  for (const auto& [name, clearance] : std::map<std::string, double>{
           {"peg_100um", 1e-4}, {"peg_10um", 1e-5}, {"peg_1um", 1e-6}, {"press_peg", -1e-5}})
    EXPECT_NEAR(hole - radius_over_flats(committed(name), 0.0, 0.1, 24, false), clearance, 4e-9) << name;
}

TEST(ContactMeshes, SphereRingAndHookLieOnTheirSurfaces) {
  for (const Vec3& v : committed("sphere").vertices) EXPECT_NEAR(v.norm(), 0.025, 4e-9);
  double lowest = 0.0, lowest_on_top = -1.0;
  for (const Vec3& v : committed("hook").vertices) {
    lowest = std::min(lowest, v.z());
    if (std::abs(v.x() - 0.015) < 0.5e-3 && v.z() < -0.010) lowest_on_top = std::max(lowest_on_top, v.z());
  }
  EXPECT_NEAR(lowest, -0.019, 2e-5);
  EXPECT_NEAR(lowest_on_top, -0.011, 2e-5);
  double outermost = 0.0;
  for (const Vec3& v : committed("ring").vertices) outermost = std::max(outermost, v.x());
  EXPECT_NEAR(outermost, 0.023, 4e-9);
}

TEST(ContactMeshes, LargeMeshesAreMadeOnDemand) {
  const test::TemporaryDirectory directory;
  const std::string command =
      std::string(TAKT_BIN_DIR) + "/takt-make-meshes --large " + directory.path().string();
  ASSERT_EQ(std::system(command.c_str()), 0) << command;
  for (const auto& [large, small] :
       std::map<std::string, std::string>{{"bolt_100k", "bolt"}, {"socket_100k", "socket"}}) {
    const TriangleMesh mesh = import_solid(directory.path() / (large + ".obj"));
    EXPECT_NEAR(static_cast<double>(mesh.triangles.size()), 1e5, 5e3) << large;
    EXPECT_NEAR(volume_properties(mesh).volume / volume_properties(committed(small)).volume, 1.0, 5e-3);
  }
  const TriangleMesh peg = import_solid(directory.path() / "peg_100um_100k.obj");
  const TriangleMesh hole = import_solid(directory.path() / "hole_100k.obj");
  EXPECT_NEAR(static_cast<double>(peg.triangles.size()), 1e5, 5e3);
  EXPECT_NEAR(static_cast<double>(hole.triangles.size()), 1e5, 5e3);
  EXPECT_NEAR(
      radius_over_flats(hole, 0.005, 0.0285, 240, true) - radius_over_flats(peg, 0.0, 0.1, 240, false), 1e-4,
      4e-9);
}

TEST(ContactMeshes, FamiliesAreTheSameShapesFromCoarseToFine) {
  const test::TemporaryDirectory directory;
  const std::string command =
      std::string(TAKT_BIN_DIR) + "/takt-make-meshes --families " + directory.path().string();
  ASSERT_EQ(std::system(command.c_str()), 0) << command;
  for (int level = 3; level <= 6; ++level) {
    const TriangleMesh ball = import_solid(directory.path() / ("sphere_" + std::to_string(level) + ".obj"));
    EXPECT_EQ(ball.triangles.size(), 20U << (2 * level));
    for (const Vec3& v : ball.vertices) ASSERT_NEAR(v.norm(), 0.025, 4e-9);
  }
  for (const std::string name : {"nut", "bolt"}) {
    std::vector<TriangleMesh> meshes;
    for (const char* level : {"_1", "_2", "_3"})
      meshes.push_back(import_solid(directory.path() / (name + level + ".obj")));
    const double volume = volume_properties(meshes.back()).volume;
    for (std::size_t i = 0; i + 1 < meshes.size(); ++i) {
      EXPECT_LT(1.5 * static_cast<double>(meshes[i].triangles.size()),
                static_cast<double>(meshes[i + 1].triangles.size()));
      EXPECT_NEAR(volume_properties(meshes[i]).volume / volume, 1.0, 5e-3) << name;
    }
  }
}

TEST(ContactMeshes, InvalidArgumentsOfTheGeneratorAreReported) {
  const std::string generator = std::string(TAKT_BIN_DIR) + "/takt-make-meshes";
  for (const char* arguments : {"", " --small x", " --large", " a b", " --large a b"})
    EXPECT_EQ(WEXITSTATUS(std::system((generator + arguments + " 2> /dev/null").c_str())), 2) << arguments;
}

}  // namespace
}  // namespace takt

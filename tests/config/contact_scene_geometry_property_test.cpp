// The first contacts of the scenes' bodies, found by FCL on their triangles, are at the places of the closed
// forms in the scene files.
#include <fcl/geometry/bvh/BVH_model.h>
#include <fcl/narrowphase/collision.h>
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <numbers>
#include <string>

#include "server/geometry/mesh/import.h"

namespace takt {
namespace {

using BoxedMesh = fcl::BVHModel<fcl::OBBRSSd>;

std::shared_ptr<BoxedMesh> boxed_mesh(const std::string& name) {
  const TriangleMesh solid = import_solid(std::string(TAKT_CONFIG_DIR) + "/meshes/contact/" + name + ".obj");
  auto mesh = std::make_shared<BoxedMesh>();
  mesh->beginModel();
  for (const auto& t : solid.triangles)
    mesh->addTriangle(solid.vertices[t[0]], solid.vertices[t[1]], solid.vertices[t[2]]);
  mesh->endModel();
  return mesh;
}

/// Whether the surfaces intersect, the first body at X, the second at its origin.
bool surfaces_meet(const std::shared_ptr<BoxedMesh>& a, const Pose& X, const std::shared_ptr<BoxedMesh>& b) {
  fcl::Transform3d T = fcl::Transform3d::Identity();
  T.linear() = X.R;
  T.translation() = X.p;
  fcl::CollisionResultd result;
  return fcl::collide(a.get(), T, b.get(), fcl::Transform3d::Identity(), fcl::CollisionRequestd(), result) >
         0;
}

/// Height at which a body that comes down from `high` meets the other one; it does so above `low`.
double first_touch(const std::shared_ptr<BoxedMesh>& a, Pose X, const std::shared_ptr<BoxedMesh>& b,
                   double low, double high) {
  const auto meets = [&](double z) {
    X.p.z() = z;
    return surfaces_meet(a, X, b);
  };
  EXPECT_FALSE(meets(high));
  EXPECT_TRUE(meets(low));
  while (high - low > 1e-8) {
    const double middle = 0.5 * (low + high);
    (meets(middle) ? low : high) = middle;
  }
  return high;
}

TEST(ContactSceneGeometry, ABoltDropsByTheBacklashOfItsThread) {
  const double backlash = 0.004 / std::numbers::pi * std::asin(1e-4 / (2 * 5e-4));
  EXPECT_NEAR(first_touch(boxed_mesh("bolt"), {}, boxed_mesh("socket"), -3e-4, 0.0), -backlash, 1e-5);
}

TEST(ContactSceneGeometry, ARingTouchesItsHookWhereTheTubesCross) {
  const Pose X{Eigen::AngleAxisd(0.5 * std::numbers::pi, Vec3::UnitY()).toRotationMatrix(),
               {0.015, 0.0, 0.0}};
  // Of the centre line's lowest point, both tubes' radii higher, and the ring's radius lower. The tubes are
  // inscribed polygons: up to 3 mm (1 - cos(pi / 24)) + 4 mm (1 - cos(pi / 32)) less. Along the hook's hollow
  // side they are circumscribed: up to 11 mm (1 - cos(pi 10 / 9 / 52 / 2)) more.
  const double z = first_touch(boxed_mesh("ring"), X, boxed_mesh("hook"), -0.0285, -0.026);
  EXPECT_LE(z, -0.028 + 6.3e-6);
  EXPECT_GE(z, -0.028 - 4.6e-5);
}

TEST(ContactSceneGeometry, PegsHaveTheirClearanceOnEverySide) {
  const auto hole = boxed_mesh("hole");
  for (const auto& [name, clearance] :
       {std::pair{"peg_100um", 1e-4}, std::pair{"peg_10um", 1e-5}, std::pair{"peg_1um", 1e-6}}) {
    const auto peg = boxed_mesh(name);
    EXPECT_FALSE(surfaces_meet(peg, {Mat3::Identity(), {0.0, 0.0, 0.031}}, hole)) << name << " above";
    for (int j = 0; j < 24; ++j) {
      const Vec3 side(std::cos(2 * std::numbers::pi * j / 24), std::sin(2 * std::numbers::pi * j / 24), 0.0);
      const Vec3 inside(0.0, 0.0, 0.005);
      EXPECT_FALSE(surfaces_meet(peg, {Mat3::Identity(), inside + (clearance - 1e-8) * side}, hole))
          << name << " side " << j;
      EXPECT_TRUE(surfaces_meet(peg, {Mat3::Identity(), inside + (clearance + 1e-8) * side}, hole))
          << name << " side " << j;
    }
  }
}

TEST(ContactSceneGeometry, APressedPegIsOversizedAndItsChamferIsNot) {
  const auto peg = boxed_mesh("press_peg"), bush = boxed_mesh("bush");
  EXPECT_TRUE(surfaces_meet(peg, {Mat3::Identity(), {0.0, 0.0, -0.015}}, bush));
  // From above it enters until the chamfers lie on each other: radius 8.01 mm + height on 10 mm + height - 29
  // mm.
  const double jammed = first_touch(peg, {}, bush, 0.0268, 0.031);
  EXPECT_NEAR(jammed, 0.029 - (0.002 - 1e-5), 2e-6);
}

}  // namespace
}  // namespace takt

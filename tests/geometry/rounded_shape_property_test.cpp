// Distances of bodies made of several convex shapes against FCL's distance of triangle meshes, which uses
// another method (a tree of swept rectangles down to pairs of triangles).
#include <fcl/geometry/bvh/BVH_model.h>
#include <fcl/narrowphase/distance.h>
#include <gtest/gtest.h>

#include "server/geometry/convex/rounded_shape.h"
#include "tests/support/random_shapes.h"

namespace takt {
namespace {

using Mesh = fcl::BVHModel<fcl::RSSd>;

std::shared_ptr<Mesh> fcl_mesh(const std::vector<RoundedShape>& shapes) {
  auto mesh = std::make_shared<Mesh>();
  mesh->beginModel();
  for (const RoundedShape& shape : shapes) {
    const TriangleMesh hull = convex_hull_mesh(shape.core.vertices);
    for (const auto& t : hull.triangles)
      mesh->addTriangle(hull.vertices[t[0]], hull.vertices[t[1]], hull.vertices[t[2]]);
  }
  mesh->endModel();
  return mesh;
}

fcl::Transform3d transform(const Pose& X) {
  fcl::Transform3d T = fcl::Transform3d::Identity();
  T.linear() = X.R;
  T.translation() = X.p;
  return T;
}

std::vector<RoundedShape> random_body(test::Random& random) {
  std::vector<RoundedShape> shapes;
  const int count = random.integer(1, 4);
  for (int i = 0; i < count; ++i) {
    const Vec3 stretch(random.uniform(0.02, 0.5), random.uniform(0.02, 0.5), random.uniform(0.02, 0.5));
    std::vector<Vec3> points = random.points(stretch, random.integer(0, 1) == 0);
    const Vec3 shift = 0.3 * random.direction();
    for (Vec3& p : points) p += shift;
    shapes.push_back({ConvexShape::from_points(points), 0.0});
  }
  return shapes;
}

TEST(BodyDistance, TheDistanceAgreesWithFclOnMeshes) {
  test::Random random(7);
  int apart = 0, near = 0;
  for (int i = 0; i < 4000; ++i) {
    const auto a = random_body(random), b = random_body(random);
    const Pose X_WA{random.rotation(), random.uniform(0.0, 0.8) * random.direction()};
    const Pose X_WB{random.rotation(), random.uniform(0.0, 0.8) * random.direction()};
    const BodyDistance ours = body_distance(a, bounds_of(a), X_WA, b, bounds_of(b), X_WB, 1e3);
    ASSERT_TRUE(ours.exact);
    const auto mesh_a = fcl_mesh(a), mesh_b = fcl_mesh(b);
    fcl::DistanceRequestd request;
    fcl::DistanceResultd result;
    fcl::distance(mesh_a.get(), transform(X_WA), mesh_b.get(), transform(X_WB), request, result);
    if (ours.distance_m > 0.0) {
      ++apart;
      EXPECT_NEAR(result.min_distance, ours.distance_m, 1e-7) << i;
      EXPECT_LE(ours.at_least_m, result.min_distance + 1e-7) << i;
    } else if (result.min_distance > 1e-7) {
      // Disjoint surfaces with overlap: one body is inside the other, which meshes do not show.
      EXPECT_GT(-ours.distance_m, 0.0) << i;
    } else {
      ++near;
    }
    // With a smaller limit the known bounds must still be true.
    const BodyDistance coarse = body_distance(a, bounds_of(a), X_WA, b, bounds_of(b), X_WB, 0.05);
    EXPECT_LE(coarse.at_least_m, ours.distance_m + 1e-12) << i;
    if (coarse.exact)
      EXPECT_EQ(coarse.distance_m, ours.distance_m) << i;
    else
      EXPECT_GT(coarse.at_least_m, 0.05) << i;
  }
  EXPECT_GT(apart, 1000);
  EXPECT_GT(near, 300);
}

}  // namespace
}  // namespace takt

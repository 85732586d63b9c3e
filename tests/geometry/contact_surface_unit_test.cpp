#include "server/geometry/surface/contact_surface.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <set>

#include "server/contact/surface/contact_roles.h"
#include "server/contact/surface/contact_springs.h"
#include "server/geometry/segment_distance.h"
#include "server/geometry/surface/contact_surface_data.h"
#include "server/geometry/surface/element_corners.h"
#include "tests/support/contact_meshes.h"
#include "tests/support/contact_pairs.h"
#include "tests/support/hollow_bodies.h"
#include "tests/support/random_shapes.h"

namespace takt {
namespace {

using test::surface;

TEST(ContactSurface, LongEdgesAreDividedAndTheAreaIsKept) {
  const TriangleMesh box = test::lattice_box({0.04, 0.03, 0.02}, std::array<int, 3>{1, 1, 1});
  const double area = 2.0 * (0.04 * 0.03 + 0.03 * 0.02 + 0.02 * 0.04);
  EXPECT_EQ(surface(box)->element_count(), 12u);
  for (const double edge : {0.02, 0.005, 0.0013}) {
    const auto s = surface(box, edge);
    const auto& data = s->data();
    EXPECT_EQ(s->face_count(), 12u);
    EXPECT_NEAR(std::accumulate(data.area_m2.begin(), data.area_m2.end(), 0.0), area, 1e-12);
    EXPECT_NEAR(s->area_m2(), area, 1e-12);
    // No triangle with edges up to `edge` is larger than the equilateral one, and strips lie along the rims.
    for (const double a : data.area_m2) EXPECT_LE(a, std::sqrt(3.0) / 4.0 * edge * edge);
    EXPECT_GT(static_cast<double>(s->element_count()), area / (std::sqrt(3.0) / 4.0 * edge * edge));
  }
}

TEST(ContactSurface, CornersOfElementsEqualThoseOfTheirPieces) {
  // A body of slanted triangles, divided and not: each element is its corners' triangle, on the mesh's
  // triangle.
  for (const double edge : {0.0, 0.02, 0.0031}) {
    const auto s = surface(test::lattice_box({0.04, 0.03, 0.02}, std::array<int, 3>{2, 1, 1}), edge);
    const auto& data = s->data();
    for (std::size_t e = 0; e < data.element_count(); ++e) {
      double area = 0.0;
      Vec3 moment = Vec3::Zero();
      for (const TriangleCorners& corner : element_triangles_B(*s, e)) {
        const Vec3 twice = (corner[1] - corner[0]).cross(corner[2] - corner[0]);
        EXPECT_GT(twice.normalized().dot(data.normal(e)), 1.0 - 1e-9);
        area += 0.5 * twice.norm();
        moment += 0.5 * twice.norm() / 3.0 * (corner[0] + corner[1] + corner[2]);
      }
      EXPECT_NEAR(area, data.area_m2[e], 1e-15);
      EXPECT_LT((moment / area - data.point(e)).norm(), 1e-14);
    }
  }
}

TEST(ContactSurface, SignedDistanceToABoxIsTheClosedForm) {
  // Sides, edges and corners of a box, from outside and inside.
  const Vec3 half(0.02, 0.015, 0.01);
  const auto s = surface(test::lattice_box(2.0 * half, std::array<int, 3>{3, 2, 2}));
  test::Random random(6);
  for (int i = 0; i < 2000; ++i) {
    const Vec3 x = random.uniform(0.0, 0.04) * random.direction();
    const Vec3 beyond = x.cwiseAbs() - half;
    const double exact = beyond.maxCoeff() < 0.0 ? beyond.maxCoeff() : beyond.cwiseMax(0.0).norm();
    EXPECT_NEAR(s->data().signed_distance_m(x), exact, 1e-12);
  }
}

TEST(ContactSurface, SignedDistanceHasTheRightSignAtConcaveEdgesAndThinWalls) {
  // A box open at the top: walls and floor of 12 mm.
  const auto s = surface(test::open_box({0.2, 0.16, 0.1}, 0.012));
  const auto distance = [&](double x, double y, double z) { return s->data().signed_distance_m({x, y, z}); };
  const double bottom = s->bounds_B().lower.z(), top = s->bounds_B().upper.z();
  EXPECT_NEAR(distance(0.0, 0.0, bottom + 0.004), -0.004, 1e-12);
  EXPECT_NEAR(distance(0.0, 0.0, bottom + 0.011), -0.001, 1e-12);
  EXPECT_NEAR(distance(0.0, 0.0, bottom + 0.02), 0.008, 1e-12);
  EXPECT_NEAR(distance(0.099, 0.0, 0.5 * (bottom + top)), -0.001, 1e-12);
  // Behind the concave edge between floor and wall: the edge itself is closest.
  EXPECT_NEAR(distance(0.088 + 0.003, 0.0, bottom + 0.012 - 0.004), -0.005, 1e-12);
}

TEST(ContactSurface, FlatTrianglesAreOnePatch) {
  EXPECT_EQ(surface(test::lattice_box({0.04, 0.03, 0.02}, 0.005))->data().patches.size(), 6u);
  EXPECT_EQ(surface(test::u_shape())->data().patches.size(), 10u);
}

TEST(ContactSurface, UnusableMeshesAreRefused) {
  TriangleMesh open = test::lattice_box({0.04, 0.03, 0.02}, 0.01);
  open.triangles.pop_back();
  EXPECT_THROW(surface(open), std::invalid_argument);
  const TriangleMesh good = test::lattice_box({0.04, 0.03, 0.02}, 0.01);
  EXPECT_THROW(surface(good, -1.0), std::invalid_argument);
  EXPECT_THROW(surface(good, 1e-7), std::invalid_argument);
  EXPECT_THROW(surface(good, std::nan("")), std::invalid_argument);
}

TEST(BoxTree, TheQueryFindsEveryBoxThatASegmentTouches) {
  test::Random random(4);
  std::vector<Aabb> boxes;
  for (int i = 0; i < 500; ++i) {
    const Vec3 c = random.uniform(0.0, 1.0) * random.direction();
    const Vec3 h = random.uniform(0.0, 0.05) * random.direction().cwiseAbs();
    boxes.push_back({c - h, c + h});
  }
  const BoxTree tree(boxes);
  for (int i = 0; i < 200; ++i) {
    const Vec3 p = random.uniform(0.0, 1.0) * random.direction(),
               q = p + random.uniform(0.0, 0.4) * random.direction();
    const double margin = random.uniform(0.0, 0.02);
    std::set<std::int32_t> found;
    tree.visit_segment(p, q, margin, [&](std::int32_t k) { EXPECT_TRUE(found.insert(k).second); });
    for (std::size_t k = 0; k < boxes.size(); ++k)
      for (int step = 0; step <= 50; ++step) {
        const Vec3 x = p + step / 50.0 * (q - p);
        if (((boxes[k].lower - x).maxCoeff() <= margin) && ((x - boxes[k].upper).maxCoeff() <= margin)) {
          EXPECT_TRUE(found.count(static_cast<std::int32_t>(k)) == 1);
          break;
        }
      }
  }
}

TEST(SegmentDistance, TheDistanceIsTheLeastOfManyPoints) {
  test::Random random(9);
  for (int i = 0; i < 300; ++i) {
    std::array<Vec3, 3> t;
    for (Vec3& v : t) v = random.uniform(0.0, 1.0) * random.direction();
    const Vec3 p = random.uniform(0.0, 1.5) * random.direction(),
               q = random.uniform(0.0, 1.5) * random.direction();
    const double distance = std::sqrt(segment_triangle_squared_distance(p, q, t));
    double sampled = 1e9;
    const int n = 40;
    for (int a = 0; a <= n; ++a)
      for (int b = 0; a + b <= n; ++b) {
        const Vec3 x =
            t[0] + static_cast<double>(a) / n * (t[1] - t[0]) + static_cast<double>(b) / n * (t[2] - t[0]);
        sampled = std::min(sampled, std::sqrt(point_segment_squared_distance(x, p, q)));
      }
    EXPECT_LE(distance, sampled + 1e-12);
    EXPECT_GE(distance, sampled - 0.06);
  }
}

TEST(ContactRoles, RolesDependOnSurfacesAndIdsOnly) {
  const auto small = surface(test::lattice_box({0.02, 0.02, 0.02}, 0.005));
  const auto large = surface(test::lattice_box({0.2, 0.2, 0.2}, 0.005));
  const auto coarse = surface(test::lattice_box({0.02, 0.02, 0.02}, 0.02));
  const auto finer = surface(test::lattice_box({0.02, 0.02, 0.02}, 0.004));
  EXPECT_TRUE(first_is_base(*small, 7, *large, 1));
  EXPECT_FALSE(first_is_base(*large, 1, *small, 7));
  // The meshing of plane faces has no effect.
  EXPECT_TRUE(first_is_base(*coarse, 1, *large, 2));
  EXPECT_FALSE(first_is_base(*large, 2, *coarse, 1));
  // A shape finer than the elements of the small component makes its body carry the elements.
  const auto round = surface(test::ball(0.05, 5));
  EXPECT_FALSE(first_is_base(*coarse, 1, *round, 2));
  EXPECT_TRUE(first_is_base(*round, 2, *coarse, 1));
  EXPECT_TRUE(first_is_base(*finer, 2, *small, 1));
  EXPECT_TRUE(first_is_base(*small, 1, *small, 2));
  EXPECT_FALSE(first_is_base(*small, 2, *small, 1));
}

TEST(ContactSprings, SavedSpringsAreRestoredOrRefused) {
  const std::vector<ContactSpring> springs{{3, Vec3(0.1, 0.2, 0.3)}, {5, Vec3(-1.0, 0.0, 2.0)}};
  const std::vector<double> kept = save_springs(springs);
  const auto back = restore_springs(kept, 6);
  ASSERT_EQ(back.size(), 2u);
  EXPECT_EQ(back[1].element, 5);
  EXPECT_EQ(back[1].anchor_T, springs[1].anchor_T);
  EXPECT_THROW(restore_springs(kept, 5), std::invalid_argument);
  EXPECT_THROW(restore_springs(std::span(kept).first(7), 6), std::invalid_argument);
  for (const double bad : {-1.0, 2.5, 3.0, std::numeric_limits<double>::quiet_NaN()}) {
    std::vector<double> changed = kept;
    changed[4] = bad;
    EXPECT_THROW(restore_springs(changed, 6), std::invalid_argument) << bad;
  }
  std::vector<double> infinite = kept;
  infinite[2] = INFINITY;
  EXPECT_THROW(restore_springs(infinite, 6), std::invalid_argument);
}

TEST(PolygonalContactArguments, ArgumentsAreChecked) {
  const auto s = surface(test::lattice_box({0.02, 0.02, 0.02}, 0.01));
  EXPECT_THROW(PolygonalContact(nullptr, s, contact_law({})), std::invalid_argument);
  ContactLaw law = contact_law({});
  law.friction_velocity_m_per_s = 0.0;
  EXPECT_THROW(PolygonalContact(s, s, law), std::invalid_argument);
  law = contact_law({});
  law.stiffness_Pa_per_m = std::nan("");
  EXPECT_THROW(PolygonalContact(s, s, law), std::invalid_argument);
}

/// Of every sample, to its end: the twentieth of all of them, in rising order.
double wall_of_all_samples_m(const ContactSurface::Data& data) {
  const double least_m = 1e-3 * data.radius_m, most_m = 2.0 * data.radius_m;
  std::vector<double> all;
  for (std::size_t e = 0; e < data.element_count();
       e += std::max<std::size_t>(1, data.element_count() / 300)) {
    double s = least_m;
    while (s < most_m) {
      const double inside_m = -data.signed_distance_m(data.point(e) - s * data.normal(e));
      if (!(inside_m > 0.0)) break;
      s += std::max(inside_m, least_m);
    }
    all.push_back(s);
  }
  std::sort(all.begin(), all.end());
  return all[all.size() / 20];
}

TEST(ContactSurface, TheWallIsThatOfAllSamples) {
  const TriangleMesh open = test::open_box({0.2, 0.16, 0.10}, 0.012);
  for (const auto& s : {surface(open, 0.005), surface(test::u_shape(), 0.004), surface(test::u_shape()),
                        surface(test::ball(0.05, 3), 0.01)}) {
    EXPECT_EQ(s->wall_m(), wall_of_all_samples_m(s->data()));
    EXPECT_GT(s->wall_m(), 0.0);
  }
}

}  // namespace
}  // namespace takt

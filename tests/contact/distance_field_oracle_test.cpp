// Distance fields against closed forms and exact distances.
#include "server/geometry/surface/distance_field.h"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <stdexcept>

#include "server/geometry/surface/contact_surface_data.h"
#include "tests/support/contact_pairs.h"
#include "tests/support/random_shapes.h"

namespace takt::test {
namespace {

const Vec3 kBox(0.04, 0.03, 0.02);

Vec3 in_cube(Random& random, double half) {
  const double x = random.uniform(-half, half), y = random.uniform(-half, half),
               z = random.uniform(-half, half);
  return {x, y, z};
}

TEST(DistanceFieldOracle, BelowAFlatFaceDepthAndDirectionAreExact) {
  const auto box = surface(lattice_box(kBox, std::array<int, 3>{1, 1, 1}));
  for (const double h : {0.0005, 0.001, 0.0017}) {
    const DistanceField field(box, h);
    Random random(3);
    int met = 0;
    for (int i = 0; i < 20'000; ++i) {
      const Vec3 x = in_cube(random, 0.5).cwiseProduct(kBox);
      const Vec3 below = 0.5 * kBox - x.cwiseAbs();
      Eigen::Index axis = 0;
      const double depth = below.minCoeff(&axis);
      // The nodes around the point have the same closest face.
      Vec3 others = below;
      others[axis] = INFINITY;
      if (std::min(others.minCoeff(), kBox[axis] - depth) - depth < 6.0 * h) continue;
      ++met;
      DistanceField::Depth found;
      ASSERT_TRUE(field.find(x, found));
      EXPECT_NEAR(found.depth_m, depth, 1e-8);
      const Vec3 inward = -std::copysign(1.0, x[axis]) * Vec3::Unit(axis);
      EXPECT_LT((found.gradient - inward).norm(), 1e-8 / h * 10.0);
      EXPECT_LT(field.curvature(x).norm(), 1e-7 / (h * h));
    }
    EXPECT_GT(met, 500);
  }
}

TEST(DistanceFieldOracle, OutsideNothingIsFound) {
  const auto box = surface(lattice_box(kBox, std::array<int, 3>{1, 1, 1}));
  const DistanceField field(box, 0.001);
  Random random(5);
  for (int i = 0; i < 5000; ++i) {
    const Vec3 x = in_cube(random, 1.0).cwiseProduct(kBox);
    DistanceField::Depth found;
    const bool beside = ((x.cwiseAbs() - 0.5 * kBox).array() > 0.0).any();
    EXPECT_FALSE(beside && field.find(x, found));
    EXPECT_LE(field.at_least_m(x), box->data().signed_distance_m(x) + 1e-9);
  }
  DistanceField::Depth found;
  for (const double odd : {double{NAN}, double{INFINITY}, -double{INFINITY}, 1e300})
    EXPECT_FALSE(field.find(Vec3(odd, 0.0, 0.0), found));
  // A lower bound that is worth asking: far away it is about the distance.
  EXPECT_GT(field.at_least_m({0.0, 0.0, 0.03}), 0.01);
}

TEST(DistanceFieldOracle, TheErrorInARoundBodyFallsWithTheThirdPowerOfTheSpacing) {
  // A cylinder of 2000 sides: 2.5e-9 m beside the round one.
  const double radius = 0.002;
  const auto round = surface(prism(radius, 0.01, 2000, false));
  double last = INFINITY;
  for (const double h : {4e-4, 2e-4}) {
    const DistanceField field(round, h);
    Random random(9);
    double sum = 0.0, turned = 0.0;
    constexpr int kPoints = 3000;
    for (int i = 0; i < kPoints; ++i) {
      const double angle = random.uniform(-3.1, 3.1), depth = random.uniform(0.02, 0.1) * radius;
      const Vec3 n(std::cos(angle), std::sin(angle), 0.0);
      DistanceField::Depth found;
      ASSERT_TRUE(field.find((radius - depth) * n + Vec3(0.0, 0.0, random.uniform(-0.002, 0.002)), found));
      sum += std::abs(found.depth_m - depth);
      turned = std::max(turned, (found.gradient + n).norm());
    }
    const double error = sum / kPoints;
    RecordProperty("error_nm_at_" + std::to_string(static_cast<int>(1e6 * h)) + "_um",
                   std::to_string(1e9 * error));
    EXPECT_LT(error, last / 6.0) << h;
    EXPECT_LT(turned, 0.3 * std::pow(h / radius, 2)) << h;
    last = error;
  }
  EXPECT_LT(last, 5e-8);
}

TEST(DistanceFieldOracle, EdgesDoNotStandOut) {
  // Points on and just below a face, near its rim: no deeper than they are but for a fiftieth of a spacing.
  const auto box = surface(lattice_box(kBox, std::array<int, 3>{1, 1, 1}));
  for (const double h : {0.0005, 0.0007, 0.001}) {
    const DistanceField field(box, h);
    Random random(15);
    double most = 0.0;
    for (int i = 0; i < 20'000; ++i) {
      const double x = 0.5 * kBox.x() - random.uniform(0.0, 3.0) * h, depth = random.uniform(0.0, 0.2) * h;
      DistanceField::Depth found;
      if (!field.find({x, random.uniform(-0.014, 0.014), 0.5 * kBox.z() - depth}, found)) continue;
      most = std::max(most, found.depth_m - std::min(depth, 0.5 * kBox.x() - x));
    }
    RecordProperty("stands_out_" + std::to_string(static_cast<int>(1e6 * h)), std::to_string(most / h));
    EXPECT_LT(most, 0.02 * h) << h;
  }
}

TEST(DistanceFieldOracle, DeepPointsHaveTheExactDistance) {
  const auto box = surface(lattice_box({0.2, 0.2, 0.2}, std::array<int, 3>{2, 2, 2}));
  const DistanceField field(box, 0.001);
  Random random(13);
  for (int i = 0; i < 1000; ++i) {
    const Vec3 x = in_cube(random, 0.05);
    DistanceField::Depth found;
    ASSERT_TRUE(field.find(x, found));
    EXPECT_NEAR(found.depth_m, 0.1 - x.cwiseAbs().maxCoeff(), 1e-12);
    EXPECT_NEAR(found.gradient.norm(), 1.0, 1e-12);
  }
}

TEST(DistanceFieldOracle, DepthGradientAndCurvatureAreDerivativesOfOneAnother) {
  const auto body = surface(torus(0.03, 0.006, 60, 24));
  const DistanceField field(body, 0.0008);
  Random random(21);
  int met = 0;
  for (int i = 0; i < 4000 && met < 300; ++i) {
    const double angle = random.uniform(-3.1, 3.1);
    const Vec3 along(std::cos(angle), std::sin(angle), 0.0);
    const Vec3 x = 0.03 * along + random.uniform(0.003, 0.0058) * random.direction();
    DistanceField::Depth at;
    if (!field.find(x, at)) continue;
    ++met;
    constexpr double kStep = 1e-8;
    const Mat3 H = field.curvature(x);
    for (int k = 0; k < 3; ++k) {
      DistanceField::Depth before, after;
      ASSERT_TRUE(field.find(x - kStep * Vec3::Unit(k), before) &&
                  field.find(x + kStep * Vec3::Unit(k), after));
      EXPECT_NEAR((after.depth_m - before.depth_m) / (2.0 * kStep), at.gradient[k], 1e-5);
      // Second derivatives jump between cells.
      const Vec3 bend = (after.gradient - before.gradient) / (2.0 * kStep);
      const Mat3 beside = field.curvature(x + kStep * Vec3::Unit(k));
      if (!beside.isApprox(H, 1e-4)) continue;
      EXPECT_LT((bend - H.col(k)).norm(), 1e-3 * H.norm() + 1e-2);
    }
  }
  EXPECT_EQ(met, 300);
}

TEST(DistanceFieldOracle, TheReportSaysWhatTheFieldCostsAndWhetherItResolvesTheShape) {
  const auto box = surface(lattice_box(kBox, std::array<int, 3>{1, 1, 1}));
  const double h = default_field_spacing_m(*box);
  EXPECT_NEAR(h, kBox.norm() / 64.0, 1e-9);
  const DistanceField good(box, h);
  EXPECT_EQ(good.report().spacing_m, h);
  EXPECT_GT(good.report().bytes, good.report().blocks * 216U * 4U);
  EXPECT_LT(good.report().bytes, 20'000'000U);
  EXPECT_TRUE(good.report().resolves);
  EXPECT_LT(good.report().mean_error_m, 0.02 * h);
  // The edges are rounded, and nothing else.
  EXPECT_LT(good.report().largest_error_m, 0.5 * h);
  const Vec3 from_edges = (0.5 * kBox - good.report().largest_at.cwiseAbs());
  EXPECT_LT(from_edges[0] + from_edges[1] + from_edges[2] - from_edges.maxCoeff(), 4.0 * h);
  // A sheet of one spacing.
  const auto sheet = surface(lattice_box({0.04, 0.03, 0.001}, std::array<int, 3>{1, 1, 1}));
  EXPECT_FALSE(DistanceField(sheet, 0.001).report().resolves);
  EXPECT_TRUE(DistanceField(sheet, default_field_spacing_m(*sheet)).report().resolves);
  // Facets that are smaller than a spacing.
  const auto ring = surface(torus(0.03, 0.0012, 200, 24));
  EXPECT_FALSE(DistanceField(ring, 0.001).report().resolves);
  EXPECT_THROW(DistanceField(box, 0.0), std::invalid_argument);
  EXPECT_THROW(DistanceField(box, 1e-7), std::invalid_argument);
}

}  // namespace
}  // namespace takt::test

// Exploded views: parts stand free along the directions in which they leave.
#include "server/product/exploded_view.h"

#include <gtest/gtest.h>

#include <numeric>
#include <random>

#include "server/product/contacts.h"
#include "server/product/geometry.h"
#include "tests/support/product_bodies.h"

namespace takt::product {
namespace {

using test::box_body;
using test::plate_with_hole;
using test::product_of;
using test::turned_body;

Vec3 total(const std::vector<Vec3>& shifts) {
  return std::accumulate(shifts.begin(), shifts.end(), Vec3(Vec3::Zero()));
}

/// Smallest gap of the boxes around two parts, in their places of the view; 0 if they overlap.
double smallest_gap(const Product& product, const Explosion& explosion) {
  const auto placed = place(product);
  double smallest = std::numeric_limits<double>::infinity();
  for (std::size_t a = 0; a < placed.size(); ++a)
    for (std::size_t b = a + 1; b < placed.size(); ++b) {
      const Vec3 by = total(explosion[b]) - total(explosion[a]);
      const Vec3 gap = (placed[a].box.lower - placed[b].box.upper - by)
                           .cwiseMax(placed[b].box.lower + by - placed[a].box.upper);
      smallest = std::min(smallest, std::max(0.0, gap.maxCoeff()));
    }
  return smallest;
}

TEST(ExplodedView, AScrewedLidComesApartAlongItsAxis) {
  Product product = product_of({{plate_with_hole("Base", 0.10, 0.02, 0.00505), {0, 0, 0.03}},
                                {plate_with_hole("Lid", 0.06, 0.01, 0.00505), {0, 0, 0.045}},
                                {turned_body("Bolt", {-0.05, 0.0, 0.006}, {0.005, 0.0085}), {0, 0, 0.05}},
                                {plate_with_hole("Nut", 0.017, 0.008, 0.005), {0, 0, 0.016}}});
  product.contacts = find_contacts(product);
  const Explosion explosion = explode(product, take_apart(product));
  ASSERT_EQ(explosion.size(), 4U);
  const double gap = 0.03 * Vec3(0.10, 0.10, 0.056).norm();
  EXPECT_TRUE(explosion[0].empty()) << "the base stays";
  // By hand: the lid stands off by the gap, the tip of the bolt by the gap over the lid, the nut by it below the base.
  EXPECT_LT((total(explosion[1]) - Vec3(0, 0, gap)).norm(), 1e-12);
  EXPECT_LT((total(explosion[2]) - Vec3(0, 0, 0.05 + 2.0 * gap)).norm(), 1e-12);
  EXPECT_LT(total(explosion[3]).z(), -gap + 1e-12);
  EXPECT_NEAR(smallest_gap(product, explosion), gap, 1e-12);
}

TEST(ExplodedView, SubassembliesLeaveAsAWholeFirst) {
  Product product = product_of({{box_body("Base", {0.2, 0.2, 0.05}), {0, 0, 0.0}},
                                {box_body("Block", {0.05, 0.05, 0.05}), {0, 0, 0.05}},
                                {box_body("Clip", {0.02, 0.02, 0.02}), {0.035, 0, 0.05}}});
  Disassembly plan;
  plan.steps.resize(2);
  plan.steps[0].parts = {1, 2}, plan.steps[0].direction_W = Vec3::UnitZ();
  plan.steps[1].parts = {2}, plan.steps[1].direction_W = Vec3::UnitX();
  plan.order = {2, 1, 0};
  const Explosion explosion = explode(product, plan);
  ASSERT_EQ(explosion[1].size(), 1U);
  ASSERT_EQ(explosion[2].size(), 2U);
  EXPECT_EQ(explosion[1][0], explosion[2][0]);
  EXPECT_GT(explosion[2][1].x(), 0.0);
  EXPECT_GT(smallest_gap(product, explosion), 0.0);
}

TEST(ExplodedView, NoTwoPartsOfATowerOverlap) {
  std::mt19937 random(11);
  const auto pick = [&](double from, double to) {
    return from + (to - from) * static_cast<double>(random()) / static_cast<double>(std::mt19937::max());
  };
  for (int round = 0; round < 10; ++round) {
    std::vector<std::pair<Body, Vec3>> bodies;
    double z = 0.0;
    for (int i = 0; i < 6; ++i) {
      const Vec3 size(pick(0.03, 0.08), pick(0.03, 0.08), pick(0.01, 0.03));
      bodies.emplace_back(box_body("B" + std::to_string(i), size),
                          Vec3(pick(-0.02, 0.02), pick(-0.02, 0.02), z + 0.5 * size.z()));
      z += size.z();
    }
    Product product = product_of(std::move(bodies));
    product.contacts = find_contacts(product);
    const Disassembly plan = take_apart(product);
    ASSERT_TRUE(plan.stuck.empty());
    EXPECT_GT(smallest_gap(product, explode(product, plan)), 1e-3) << round;
  }
}

}  // namespace
}  // namespace takt::product

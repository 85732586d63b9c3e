// The collision world and its broad phase against brute force over everything.
#include "server/contact/collision/collision_world.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "server/geometry/broad_phase.h"
#include "tests/support/random_shapes.h"

namespace takt {
namespace {

using test::Random;

Component random_component(Random& random, int most_shapes) {
  Component component;
  std::vector<ConvexShape> shapes;
  for (int i = random.integer(1, most_shapes); i > 0; --i) {
    std::vector<Vec3> points = random.points(Vec3(0.05, 0.05, 0.05), random.integer(0, 1) == 1);
    const Vec3 shift = 0.15 * random.direction();
    for (Vec3& p : points) p += shift;
    shapes.push_back(ConvexShape::from_points(points));
  }
  component.convex = std::move(shapes);
  component.box = component.convex.box();
  return component;
}

bool any_overlap(const std::vector<ConvexShape>& a, const Pose& X_WA, const std::vector<ConvexShape>& b,
                 const Pose& X_WB, double margin) {
  return std::any_of(a.begin(), a.end(), [&](const ConvexShape& s) {
    return std::any_of(b.begin(), b.end(),
                       [&](const ConvexShape& t) { return convex_overlap(s, X_WA, t, X_WB, margin); });
  });
}

TEST(CollisionWorld, HierarchyAndMemoryGiveTheVerdictsOfBruteForce) {
  Random random(41);
  int overlapping = 0, asked = 0;
  DetectionCounts counts;
  std::uint64_t combinations = 0;
  for (int round = 0; round < 60; ++round) {
    std::vector<Component> components;
    for (int i = 0; i < 4; ++i) components.push_back(random_component(random, i == 0 ? 1 : 12));
    CollisionWorld world(components, 2e-4);
    // Component 0 is a box whose bounds change, as the space between a gripper's jaws.
    std::vector<ConvexShape> volume(1, ConvexShape::from_points(std::vector<Vec3>(8, Vec3::Zero())));
    world.set_shape(0, volume.front());
    std::vector<Pose> poses(4);
    for (int step = 0; step < 100; ++step) {
      volume.front().become_box({-0.1, -0.001 * step, -0.1}, {0.1, 0.001 * (step + 1), 0.1});
      world.set_box(0, volume.front().vertices.front(), volume.front().vertices.back());
      for (std::size_t i = 0; i < 4; ++i) {
        if (step == 0) poses[i] = {random.rotation(), 0.2 * random.direction()};
        poses[i].p += 0.005 * random.direction();
        poses[i].R = Eigen::AngleAxisd(0.02, random.direction()) * poses[i].R;
        world.set_pose(static_cast<int>(i), poses[i]);
      }
      for (std::size_t i = 0; i < 4; ++i)
        for (std::size_t j = i + 1; j < 4; ++j) {
          const auto& shapes_i = i == 0 ? volume : components[i].convex.shapes();
          const auto& shapes_j = components[j].convex.shapes();
          const bool expected = any_overlap(shapes_i, poses[i], shapes_j, poses[j], 2e-4);
          const int a = static_cast<int>(i), b = static_cast<int>(j);
          ASSERT_EQ(world.shapes_overlap(a, b, counts), expected) << round << " " << step;
          ASSERT_TRUE(!expected || world.boxes_overlap(a, b));
          ASSERT_EQ(world.overlaps_at(a, poses[i], b, counts),
                    any_overlap(shapes_i, poses[i], shapes_j, poses[j], 0.0));
          overlapping += expected ? 1 : 0;
          ++asked;
          combinations += 2 * shapes_i.size() * shapes_j.size();
        }
    }
  }
  EXPECT_GT(overlapping, asked / 20);
  EXPECT_LT(overlapping, asked * 19 / 20);
  EXPECT_LT(counts.mpr_calls, combinations / 3);             // the hierarchy leaves most combinations out
  EXPECT_GT(counts.answered.by_hint, counts.mpr_calls / 5);  // two margins take turns, and one shape changes
}

TEST(CollisionWorld, TheWorldReportsEveryBodyThatMoved) {
  Random random(42);
  std::vector<Component> components;
  for (int i = 0; i < 3; ++i) components.push_back(random_component(random, 2));
  CollisionWorld world(components, 2e-4);
  world.clear_moved();
  EXPECT_TRUE(world.moved().empty());
  const Pose pose{Mat3::Identity(), Vec3(1, 2, 3)};
  world.set_pose(2, pose);
  world.set_pose(2, pose);
  world.set_pose(0, Pose{});  // where it is
  EXPECT_EQ(world.moved(), std::vector<int>{2});
}

TEST(BroadPhase, TheQueryFindsEveryNearPair) {
  Random random(43);
  for (int round = 0; round < 20; ++round) {
    constexpr int kCount = 80;
    std::vector<Aabb> boxes(kCount);
    const auto place = [&](Aabb& box, const Vec3& center) {
      const Vec3 half(random.uniform(0.0, 0.1), random.uniform(0.0, 0.1), random.uniform(0.0, 0.1));
      box = {center - half, center + half};
    };
    for (Aabb& box : boxes) place(box, random.direction() * random.uniform(0.0, 1.0));
    boxes[0] = {Vec3(-2, -2, -0.1), Vec3(2, 2, 0.0)};  // a table
    BroadPhase broad_phase(kCount);
    broad_phase.build(boxes);
    for (int step = 0; step < 200; ++step) {
      const int moved = random.integer(1, kCount - 1);
      Aabb& box = boxes[static_cast<std::size_t>(moved)];
      const Vec3 by = random.log_uniform(1e-4, 0.5) * random.direction();
      box = {box.lower + by, box.upper + by};
      broad_phase.update(moved, box);
      std::vector<int> found;
      broad_phase.find(box, found);
      std::sort(found.begin(), found.end());
      ASSERT_EQ(std::adjacent_find(found.begin(), found.end()), found.end());  // each once
      for (int other = 0; other < kCount; ++other) {
        const bool is_found = std::binary_search(found.begin(), found.end(), other);
        ASSERT_EQ(is_found, broad_phase.large_box(other).overlaps(box));
        ASSERT_TRUE(is_found || !boxes[static_cast<std::size_t>(other)].overlaps(box));
      }
    }
  }
}

}  // namespace
}  // namespace takt

// Elements that ContactSearch excludes by free regions are never in contact, and penetrations from their
// planes equal those from the faces.
#include "server/contact/surface/contact_search.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "server/geometry/mesh/import.h"
#include "tests/support/contact_meshes.h"
#include "tests/support/contact_pairs.h"
#include "tests/support/random_shapes.h"

namespace takt {
namespace {

using test::Random;
using test::surface;

std::shared_ptr<const ContactSurface> mesh(const char* name) {
  return surface(import_solid(std::string(TAKT_CONFIG_DIR "/meshes/") + name + ".obj"));
}

struct SearchScene {
  const char* name;
  std::shared_ptr<const ContactSurface> base, target;
  Pose near;
  double shift_m, turn_rad;  ///< how far poses go
};

std::vector<SearchScene> search_scenes() {
  const auto hole = mesh("contact/hole"), peg = mesh("contact/peg_100um"), B = mesh("B"), C = mesh("C");
  std::vector<SearchScene> list;
  list.push_back({"peg in the hole", peg, hole, {Mat3::Identity(), Vec3(0.0, 0.0, 0.012)}, 2.5e-4, 4e-3});
  list.push_back({"peg on the floor", peg, hole, {Mat3::Identity(), Vec3(0.0, 0.0, 1e-5)}, 2e-4, 3e-3});
  list.push_back({"peg on the rim", peg, hole, {Mat3::Identity(), Vec3(0.0, 0.0, 0.0285)}, 3e-3, 0.1});
  list.push_back({"hole on the peg", hole, peg, {Mat3::Identity(), Vec3(0.0, 0.0, -0.012)}, 2.5e-4, 4e-3});
  list.push_back({"C in the pocket of B", C, B, {Mat3::Identity(), Vec3(-0.06, 0.0, 0.02)}, 1e-3, 2e-3});
  list.push_back({"ball in a socket", surface(test::ball(0.02, 4)),
                  surface(test::hollow(test::lattice_box({0.06, 0.06, 0.06}, 0.01), test::ball(0.0205, 4))),
                  Pose{}, 8e-4, 0.5});
  const Mat3 upright = Eigen::AngleAxisd(0.5 * std::numbers::pi, Vec3::UnitY()).toRotationMatrix();
  list.push_back({"ring on its hook",
                  mesh("contact/ring"),
                  mesh("contact/hook"),
                  {upright, Vec3(0.015, 0.0, -0.0283)},
                  3e-4,
                  0.05});
  list.push_back({"box at a corner",
                  surface(test::lattice_box({0.03, 0.02, 0.02}, 0.004)),
                  surface(test::lattice_box({0.03, 0.03, 0.03}, std::array<int, 3>{1, 1, 1})),
                  {Mat3::Identity(), Vec3(0.026, 0.012, 0.02)},
                  6e-3,
                  0.3});
  return list;
}

TEST(ContactSearch, TheSearchFindsTheContactsOfBruteForce) {
  for (const SearchScene& s : search_scenes()) {
    const auto &base = s.base->data(), &target = s.target->data();
    Random random(31);
    ContactSearch search(base, target);
    ContactCandidates lists;
    ContactCandidates::Work work;
    ContactDepths depths;
    std::size_t touched = 0;
    Pose X = s.near;
    for (int i = 0; i < 150; ++i) {
      // Small steps within a region's bound, and occasional jumps.
      const bool far = i % 15 == 0;
      if (far) X = s.near;
      X.p += (far ? s.shift_m : random.log_uniform(1e-9, s.shift_m)) * random.direction();
      X.R = Eigen::AngleAxisd(
                far ? s.turn_rad * random.uniform(0.0, 1.0) : random.log_uniform(1e-9, s.turn_rad),
                random.direction())
                .toRotationMatrix() *
            X.R;
      const Pose X_BT = X.inverse();
      search.find(X, X_BT);
      std::size_t hit = 0;
      const auto elements = search.elements();
      for (const ContactCluster& cluster : base.clusters) {
        if (cluster.second >= 0) continue;
        // Lists that hold for this pose alone, of all elements, from the hierarchy of all faces.
        lists.rebuild(base, target, cluster, X, 1e-7, {}, work);
        depths.prepare(lists);
        depths.find(base, target, lists, X, X_BT);
        for (const std::int32_t slot_number : depths.hits()) {
          const auto slot = static_cast<std::size_t>(slot_number);
          ASSERT_LT(hit, elements.size()) << s.name << " pose " << i;
          ASSERT_EQ(elements[hit], lists.element[slot]) << s.name << " pose " << i;
          ASSERT_EQ(search.depths_m()[hit], depths.depth_m(slot)) << s.name << " pose " << i;
          ASSERT_EQ(search.normal_B(hit), depths.normal_B(slot)) << s.name << " pose " << i;
          ++hit;
        }
      }
      ASSERT_EQ(hit, elements.size()) << s.name << " pose " << i;
      touched += hit;
    }
    EXPECT_GT(touched, 500U) << s.name;
  }
}

TEST(ContactSearch, SlidingAlongAWallNeedsNoNewLists) {
  const auto peg = mesh("contact/peg_100um"), hole = mesh("contact/hole");
  ContactSearch search(peg->data(), hole->data());
  Pose X{Mat3::Identity(), Vec3(1.005e-4, 0.0, 0.024)};
  int made = 0;
  std::size_t hits = 0;
  for (int i = 0; i < 2000; ++i) {
    X.p.z() -= 1e-5;
    made += search.find(X, X.inverse()) ? 1 : 0;
    hits += search.elements().size();
  }
  // 20 mm; the direction-independent bound of lists is a small part of the clearance.
  EXPECT_GT(hits, 2000U);
  EXPECT_LT(made, 200);
}

}  // namespace
}  // namespace takt

// The search finds the elements in contact, and their penetrations and normals, as the definition has them:
// from the closest of all faces.
#include "server/contact/surface/contact_search.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "config/meshes/generator/screw_meshes.h"
#include "server/contact/surface/contact_elements.h"
#include "server/geometry/mesh/import.h"
#include "tests/support/contact_meshes.h"
#include "tests/support/contact_pairs.h"
#include "tests/support/effort.h"
#include "tests/support/random_shapes.h"
#include "tests/support/solid_mesh.h"

namespace takt {
namespace {

using test::mesh_of;
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
  const meshes::ScrewParameters screw = meshes::iso_metric(16);
  const auto bolt = surface(mesh_of(meshes::make_bolt(screw))),
             nut = surface(mesh_of(meshes::make_nut(screw)));
  list.push_back({"nut on its bolt", nut, bolt, {Mat3::Identity(), Vec3(0.0, 0.0, 0.006)}, 1e-4, 0.02});
  list.push_back({"bolt in its nut", bolt, nut, {Mat3::Identity(), Vec3(0.0, 0.0, -0.006)}, 1e-4, 0.02});
  const meshes::GearParameters gear;
  const Mat3 half_tooth =
      Eigen::AngleAxisd(std::numbers::pi / gear.wheel_teeth, Vec3::UnitZ()).toRotationMatrix();
  list.push_back({"gear pair",
                  surface(mesh_of(meshes::make_gear("wheel", gear.wheel_teeth, gear))),
                  surface(mesh_of(meshes::make_gear("pinion", gear.pinion_teeth, gear))),
                  {half_tooth, Vec3(-0.5 * gear.module * (gear.wheel_teeth + gear.pinion_teeth), 0.0, 0.0)},
                  1e-4,
                  2e-3});
  return list;
}

/// The definition, with no index: every face is asked.
struct BruteForce {
  const ContactSurface::Data& target;

  /// Closest point; of equally close faces the lowest number.
  std::pair<std::size_t, ClosestOnFace> closest(const Vec3& x) const {
    std::pair<std::size_t, ClosestOnFace> best;
    best.second.squared_m2 = INFINITY;
    for (std::size_t f = 0; f < target.faces.size(); ++f) {
      const ClosestOnFace on = target.closest_on_face(target.faces[f], x);
      if (on.squared_m2 < best.second.squared_m2) best = {f, on};
    }
    return best;
  }
  /// Depth (m) and outward normal in the Base; no depth outside.
  std::pair<double, Vec3> depth(const Vec3& p, const Pose& X_TB, const Pose& X_BT) const {
    using Feature = ClosestOnFace::Feature;
    const Vec3 x = X_TB * p;
    const auto [f, on] = closest(x);
    const ContactFace& face = target.faces[f];
    const bool flat =
        on.feature == Feature::inside ||
        (on.feature == Feature::edge
             ? target.faces[static_cast<std::size_t>(face.neighbour[on.number])].patch == face.patch
             : target.vertex_patch[face.vertex[on.number]] == face.patch);
    if (flat) {
      const ContactPatch& patch = target.patches[static_cast<std::size_t>(face.patch)];
      const Vec3 n = X_BT.R * patch.normal;
      return {
          plane_depth(n.x(), n.y(), n.z(), patch.offset_m - patch.normal.dot(X_TB.p), p.x(), p.y(), p.z()),
          n};
    }
    const double distance = std::sqrt(on.squared_m2);
    if (!target.inside(face, on, x) || distance <= 1e-12) return {0.0, Vec3::Zero()};
    return {distance, X_BT.R * ((on.q - x) / distance)};
  }
};

/// Long: 110 000 poses of eleven pairs.
TEST(ContactSearch, TheSearchFindsTheContactsOfBruteForce) {
  const std::size_t poses = test::effort() == 1 ? 150 : 1000 * test::effort();
  for (const SearchScene& s : search_scenes()) {
    const auto &base = s.base->data(), &target = s.target->data();
    const BruteForce all{target};
    Random random(31);
    ContactSearch search(base, target);
    std::size_t touched = 0;
    Pose X = s.near;
    // Every face of every element: about as many tests for each scene.
    const std::size_t asked = test::effort() == 1 ? 300'000 : 100'000;
    const auto stride = static_cast<std::uint32_t>(1 + base.element_count() * target.faces.size() / asked);
    for (std::uint32_t i = 0; i < poses; ++i) {
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
      const auto elements = search.elements();
      touched += elements.size();
      for (std::size_t hit = 1; hit < elements.size(); ++hit) ASSERT_LT(elements[hit - 1], elements[hit]);
      for (std::uint32_t e = i % stride; e < base.element_count(); e += stride) {
        const auto at = std::lower_bound(elements.begin(), elements.end(), static_cast<std::int32_t>(e));
        const bool found = at != elements.end() && *at == static_cast<std::int32_t>(e);
        const auto [depth, normal_B] = all.depth(base.point(e), X, X_BT);
        ASSERT_EQ(found, depth > 0.0) << s.name << " pose " << i << " element " << e;
        if (!found) continue;
        const auto hit = static_cast<std::size_t>(at - elements.begin());
        ASSERT_EQ(search.depths_m()[hit], depth) << s.name << " pose " << i << " element " << e;
        ASSERT_EQ(search.normal_B(hit), normal_B) << s.name << " pose " << i << " element " << e;
      }
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

// Held patches: along the motion for which they are held, and beside it, the contact of the search.
#include "server/contact/surface/held_patch.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <string>

#include "config/meshes/generator/cap_screw_meshes.h"
#include "config/meshes/generator/screw_meshes.h"
#include "server/contact/surface/polygonal_contact.h"
#include "tests/support/contact_meshes.h"
#include "tests/support/contact_pairs.h"
#include "tests/support/random_shapes.h"
#include "tests/support/solid_mesh.h"

namespace takt {
namespace {

using test::mesh_of;
using test::Random;
using test::surface;

struct SlidingScene {
  std::string name;
  std::shared_ptr<const ContactSurface> base, target;
  RelativeMotion motion;  ///< without speed beside the sliding one
  double beside_m;        ///< how far starts are random
};

/// Sliding with some 0.1 m/s, pressed a few micrometres.
std::vector<SlidingScene> sliding_scenes() {
  std::vector<SlidingScene> list;
  const meshes::ScrewParameters screw = meshes::iso_metric(16);
  const auto bolt = surface(mesh_of(meshes::make_bolt(screw))),
             nut = surface(mesh_of(meshes::make_nut(screw)));
  const double w = -14.0, lead_m = screw.pitch / (2.0 * std::numbers::pi);
  // The nut rests on the flanks below it as deep as its clearance allows.
  const double drop_m = 2.0 * screw.clearance * std::tan(std::numbers::pi / 6.0);
  list.push_back({"nut on its bolt",
                  nut,
                  bolt,
                  {{Mat3::Identity(), Vec3(0.0, 0.0, 0.006 - 0.5 * drop_m)},
                   {Vec3(0.0, 0.0, w * lead_m), Vec3(0.0, 0.0, w)}},
                  2e-6});
  list.push_back({"ball in a socket",
                  surface(test::ball(0.02, 4)),
                  surface(test::hollow(test::lattice_box({0.06, 0.06, 0.06}, 0.01), test::ball(0.0202, 4))),
                  {{Mat3::Identity(), Vec3(0.0, 0.0, -2.4e-4)}, {Vec3::Zero(), Vec3(3.0, 2.0, -2.0)}},
                  2e-6});
  return list;
}

RelativeMotion after(const RelativeMotion& start, double t) {
  RelativeMotion motion = start;
  motion.X_TB.p += t * start.V_TB_T.v;
  const double angle = t * start.V_TB_T.w.norm();
  if (angle > 0.0)
    motion.X_TB.R = Eigen::AngleAxisd(angle, start.V_TB_T.w.normalized()).toRotationMatrix() * motion.X_TB.R;
  return motion;
}

RelativeMotion random_start(const SlidingScene& scene, Random& random) {
  RelativeMotion start = after(scene.motion, random.uniform(0.0, 5e-3));
  start.X_TB.p += scene.beside_m * random.direction();
  start.V_TB_T.v += random.uniform(0.0, 1e-3) * random.direction();
  return start;
}

TEST(HeldPatch, AlongItsMotionTheForcesAreThoseOfTheSearch) {
  for (const SlidingScene& scene : sliding_scenes()) {
    PolygonalContact held(scene.base, scene.target, test::frictionless_law()),
        searched(scene.base, scene.target, test::frictionless_law());
    Random random(7);
    double difference = 0.0, sum = 0.0;
    for (int trial = 0; trial < 8; ++trial) {
      const RelativeMotion start = random_start(scene, random);
      held.release();
      ASSERT_TRUE(held.hold(start, 0.0)) << scene.name;
      const std::uint64_t searches = held.counts().searches;
      for (const double t : {0.0, 2e-4, 5e-4, 1e-3, 2e-3}) {
        const RelativeMotion now = after(start, t);
        const ContactResult a = test::evaluate(held, now), b = test::evaluate(searched, now);
        ASSERT_GT(b.normal_force_N, 0.0) << scene.name;
        const double apart = (a.F_B_T.f - b.F_B_T.f).norm();
        if (t == 0.0) {
          // Rounded edges that go inwards are the only difference.
          EXPECT_LT(apart, 1e-3 * b.normal_force_N) << scene.name << " trial " << trial;
        }
        EXPECT_LT(apart, 0.02 * b.normal_force_N) << scene.name << " trial " << trial << " after " << t;
        difference += apart, sum += b.normal_force_N;
      }
      EXPECT_EQ(held.counts().searches, searches) << scene.name;
    }
    EXPECT_LT(difference, 2e-3 * sum) << scene.name;
    RecordProperty(scene.name, std::to_string(difference / sum));
  }
}

TEST(HeldPatch, BesideItsMotionTheBitsAreThoseOfTheSearch) {
  constexpr double kFar_m = 5e-4;  // some faces
  for (const SlidingScene& scene : sliding_scenes()) {
    PolygonalContact held(scene.base, scene.target, test::frictionless_law()),
        searched(scene.base, scene.target, test::frictionless_law());
    Random random(8);
    for (int trial = 0; trial < 8; ++trial) {
      const RelativeMotion start = random_start(scene, random);
      held.release();
      ASSERT_TRUE(held.hold(start, 0.0));
      RelativeMotion now = after(start, 5e-4);
      now.X_TB.p += kFar_m * random.direction();
      const ContactResult a = test::evaluate(held, now), b = test::evaluate(searched, now);
      EXPECT_EQ(a.F_B_T.f, b.F_B_T.f) << scene.name;
      EXPECT_EQ(a.elements, b.elements) << scene.name;
    }
  }
}

// A cap screw rattles in its hole: most elements come from afar, past edges that are sharper than a right angle.
TEST(HeldPatch, NothingPressesAtTheStartThatTheSearchDoesNotFind) {
  const meshes::CapScrewParameters screw;
  const auto base = surface(mesh_of(meshes::make_cap_screw(screw))),
             target = surface(mesh_of(meshes::make_tapped_block(screw)));
  const RelativeMotion hangs{
      {Eigen::AngleAxisd(std::numbers::pi, Vec3::UnitX()).toRotationMatrix(), Vec3(0.0, 0.0, 0.0087154)}, {}};
  PolygonalContact held(base, target, test::frictionless_law()),
      searched(base, target, test::frictionless_law());
  Random random(9);
  double difference = 0.0, sum = 0.0;
  for (int trial = 0; trial < 20; ++trial) {
    RelativeMotion start = hangs;
    start.X_TB.p += random.uniform(0.0, 8e-5) * random.direction();
    start.V_TB_T = {random.uniform(0.0, 0.05) * random.direction(),
                    random.uniform(0.0, 12.0) * random.direction()};
    held.release();
    ASSERT_TRUE(held.hold(start, 0.0));
    const ContactResult a = test::evaluate(held, start), b = test::evaluate(searched, start);
    difference += std::abs(a.elastic_energy_J - b.elastic_energy_J);
    sum += b.elastic_energy_J;
    EXPECT_LT(a.elastic_energy_J, 1.02 * b.elastic_energy_J + 1e-12) << "trial " << trial;
  }
  EXPECT_GT(sum, 0.0);
  EXPECT_LT(difference, 0.01 * sum);
  RecordProperty("difference", std::to_string(difference / sum));
}

// Beside its path an element passes other edges than on it.
TEST(HeldPatch, BesideItsMotionAnElementPressesAsTheSearchFinds) {
  const meshes::CapScrewParameters screw;
  const auto base = surface(mesh_of(meshes::make_cap_screw(screw))),
             target = surface(mesh_of(meshes::make_tapped_block(screw)));
  const RelativeMotion hangs{
      {Eigen::AngleAxisd(std::numbers::pi, Vec3::UnitX()).toRotationMatrix(), Vec3(0.0, 0.0, 0.0087154)}, {}};
  constexpr double kBeside_m = 1.5e-5;
  PolygonalContact held(base, target, test::frictionless_law()),
      searched(base, target, test::frictionless_law());
  Random random(11);
  double difference = 0.0, sum = 0.0;
  for (int trial = 0; trial < 60; ++trial) {
    RelativeMotion start = hangs;
    start.X_TB.p += random.uniform(0.0, 3e-5) * random.direction();
    start.V_TB_T = {random.uniform(0.0, 0.02) * random.direction(),
                    Vec3(0.0, 0.0, random.uniform(-12.0, 12.0))};
    held.release();
    ASSERT_TRUE(held.hold(start, 0.0));
    const std::uint64_t searches = held.counts().searches;
    for (int i = 0; i < 8; ++i) {
      RelativeMotion now = after(start, random.uniform(0.0, 1.5e-3));
      now.X_TB.p += kBeside_m * random.direction();
      const double a = test::evaluate(held, now).elastic_energy_J,
                   b = test::evaluate(searched, now).elastic_energy_J;
      EXPECT_NEAR(a, b, 1e-3 * b + 1e-12) << "trial " << trial;
      difference += std::abs(a - b), sum += b;
    }
    EXPECT_EQ(held.counts().searches, searches) << "trial " << trial;
  }
  EXPECT_GT(sum, 0.0);
  EXPECT_LT(difference, 1e-5 * sum);
  RecordProperty("difference", std::to_string(difference / sum));
}

TEST(HeldPatch, APatchIsHeldForTwiceAsLongAsTheOneBeforeServed) {
  constexpr double kNext_s = 1e-4, kServed_s = 0.0075;
  const SlidingScene scene = sliding_scenes().front();
  PolygonalContact contact(scene.base, scene.target, test::frictionless_law());
  EXPECT_TRUE(contact.hold(scene.motion, kNext_s));
  EXPECT_FALSE(contact.hold(after(scene.motion, 0.0015), kNext_s));
  EXPECT_TRUE(contact.hold(after(scene.motion, kServed_s), 0.003));
  ASSERT_NE(contact.held_from(), nullptr);
  EXPECT_NEAR(contact.held_from()->most_s, 2.0 * kServed_s, 1e-6);
  EXPECT_FALSE(contact.hold(after(scene.motion, 2.9 * kServed_s), kNext_s));
  // What a snapshot keeps gives the same patch.
  PolygonalContact restored(scene.base, scene.target, test::frictionless_law());
  restored.hold_from(*contact.held_from());
  EXPECT_FALSE(restored.hold(after(scene.motion, 2.9 * kServed_s), kNext_s));
  EXPECT_TRUE(restored.hold(after(scene.motion, 2.99 * kServed_s), kNext_s));
}

TEST(HeldPatch, ItIsHeldAsLongAsItCoversTheNextStep) {
  const SlidingScene scene = sliding_scenes().front();
  PolygonalContact contact(scene.base, scene.target, test::frictionless_law());
  ASSERT_TRUE(contact.can_hold());
  EXPECT_TRUE(contact.hold(scene.motion, 1e-4));
  EXPECT_FALSE(contact.hold(after(scene.motion, 1e-3), 1e-4));
  EXPECT_TRUE(contact.hold(after(scene.motion, 1e-3), 1.0));   // longer than any
  EXPECT_TRUE(contact.hold(after(scene.motion, 0.05), 1e-4));  // far along
  RelativeMotion beside = after(scene.motion, 0.05);
  beside.X_TB.p.x() += 1e-4;
  EXPECT_TRUE(contact.hold(beside, 1e-4));
  EXPECT_NE(contact.held_from(), nullptr);
  contact.release();
  EXPECT_EQ(contact.held_from(), nullptr);
  RelativeMotion broken = scene.motion;
  broken.V_TB_T.v.x() = NAN;
  contact.hold(broken, 1e-4);
  EXPECT_EQ(contact.held_from(), nullptr);
}

TEST(HeldPatch, FlatSurfacesAreSearchedAsBefore) {
  const auto box = surface(test::lattice_box({0.03, 0.02, 0.02}, 0.004));
  PolygonalContact contact(box, box, test::frictionless_law());
  EXPECT_FALSE(contact.can_hold());
  EXPECT_FALSE(contact.hold({}, 1e-3));
}

}  // namespace
}  // namespace takt

// Pressures element by element, against the sums of the simulation itself and closed forms.
#include "server/simulation/model/pressed_elements.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "server/scenario/contact_pair_names.h"
#include "tests/support/contact_meshes.h"
#include "tests/support/contact_scene.h"

namespace takt {
namespace {

using Patterns = std::vector<std::string>;

using test::kG;
using test::kLayer_Pa_per_m;
using test::library_mesh;
using test::SceneText;
using test::TemporaryDirectory;

double area_m2(const PressedElement& element) {
  const auto& c = element.corner_B;
  return 0.5 * (c[1] - c[0]).cross(c[2] - c[0]).norm();
}

std::shared_ptr<const CellModel> ball_on_plate(const TemporaryDirectory& directory, int levels) {
  directory.write("ball.obj", test::obj_text("ball", test::ball(0.025, levels)));
  SceneText text;
  text.parts = "  Ball: {mesh: ball.obj, mass_kg: 0.5, hierarchy: 1, pose: {position_m: [0, 0, 0.0248]}}";
  text.grounds = "  Plate: {mesh: " + library_mesh("plate") + "}";
  return load_scene(directory, text);
}

TEST(PressedElements, PressuresOfABallFollowTheDepthAndCarryItsWeight) {
  const TemporaryDirectory directory;
  const auto cell = ball_on_plate(directory, 5);
  Simulation simulation(cell);
  while (simulation.time_s() < 0.6) ASSERT_TRUE(simulation.step({})) << simulation.fault();
  const Snapshot snapshot = simulation.make_snapshot();
  const std::uint64_t hash = simulation.state_hash();
  const auto counted = simulation.contact_counts().made;
  PressedElements elements(cell->contact);
  const auto pairs = find_contact_pairs(cell->contact, cell->description, Patterns{"Ball-*"});
  ASSERT_EQ(pairs.size(), 1U);
  const std::vector<PressedPair> pressed = elements.read(snapshot, pairs);
  ASSERT_EQ(pressed.size(), 1U);
  const PressedPair& pair = pressed.front();
  const ContactSample& reported = snapshot.contacts.pressing().front();
  EXPECT_EQ(pair.base, reported.base);
  EXPECT_EQ(static_cast<int>(pair.elements.size()), reported.result.elements);
  EXPECT_EQ(pair.omitted, 0U);
  EXPECT_DOUBLE_EQ(pair.largest_pressure_Pa, reported.result.largest_pressure_Pa);
  double carried_N = 0.0, sum_m2 = 0.0;
  // The closed form at rest: pressure = layer modulus times depth below the plate's face (z = 0), where the
  // ball is the base; of the plate's elements, below the ball.
  const bool ball_is_base = cell->description.components[static_cast<std::size_t>(pair.base)].name == "Ball";
  const ComponentSample& base = snapshot.components[static_cast<std::size_t>(pair.base)];
  const Pose X_WB = Pose::from_quaternion(base.p_WB, base.q_WB);
  for (const PressedElement& element : pair.elements) {
    const auto& c = element.corner_B;
    const Vec3 p_W = X_WB * ((c[0] + c[1] + c[2]) / 3.0);
    carried_N += area_m2(element) * element.pressure_Pa;
    sum_m2 += area_m2(element);
    if (!ball_is_base) continue;
    EXPECT_NEAR(element.pressure_Pa, kLayer_Pa_per_m * -p_W.z(), 0.02 * pair.largest_pressure_Pa);
  }
  EXPECT_NEAR(carried_N, 0.5 * kG, 0.02 * 0.5 * kG);
  EXPECT_NEAR(sum_m2, reported.result.area_m2, 1e-9 * sum_m2);
  // The simulation does not notice.
  EXPECT_EQ(simulation.state_hash(), hash);
  EXPECT_EQ(simulation.contact_counts().made, counted);
  // Without requested pairs the result is empty.
  EXPECT_TRUE(elements.read(snapshot, {}).empty());
}

TEST(PressedElements, TheStrongestElementsAreListedWhenThereAreTooMany) {
  const TemporaryDirectory directory;
  SceneText text;
  text.contact = "{element_edge_m: 0.0012, defaults: {friction: 0.3}}";
  text.parts = "  Slab: {mesh: " + library_mesh("slab") + ", mass_kg: 0.2, hierarchy: 1}";
  text.grounds = "  Plate: {mesh: " + library_mesh("plate") + "}";
  const auto cell = load_scene(directory, text);
  Simulation simulation(cell);
  for (int i = 0; i < 5; ++i) ASSERT_TRUE(simulation.step({})) << simulation.fault();
  const Snapshot snapshot = simulation.make_snapshot();
  PressedElements elements(cell->contact);
  const std::vector<std::size_t> all = find_contact_pairs(cell->contact, cell->description, Patterns{"*"});
  const std::vector<PressedPair> pressed = elements.read(snapshot, all);
  ASSERT_EQ(pressed.size(), 1U);
  const auto whole = static_cast<std::size_t>(snapshot.contacts.pressing().front().result.elements);
  ASSERT_GT(whole, PressedElements::kMaxElements);
  // An element along a rim is up to three triangles.
  EXPECT_LE(pressed[0].elements.size(), PressedElements::kMaxElements);
  EXPECT_GT(pressed[0].elements.size(), PressedElements::kMaxElements - 3);
  EXPECT_GE(pressed[0].omitted, whole - pressed[0].elements.size());
  EXPECT_LT(pressed[0].omitted, whole - pressed[0].elements.size() / 2);
  EXPECT_DOUBLE_EQ(pressed[0].largest_pressure_Pa,
                   snapshot.contacts.pressing().front().result.largest_pressure_Pa);
}

TEST(ContactPairNames, NamesFitInEitherOrderAndUnknownNamesAreReported) {
  const TemporaryDirectory directory;
  const auto cell = ball_on_plate(directory, 2);
  std::vector<std::string> unknown;
  EXPECT_EQ(find_contact_pairs(cell->contact, cell->description, Patterns{"Plate-Ball"}, &unknown).size(),
            1U);
  EXPECT_EQ(
      find_contact_pairs(cell->contact, cell->description, Patterns{"Ball-Plate", "*"}, &unknown).size(), 1U);
  EXPECT_TRUE(unknown.empty());
  EXPECT_TRUE(
      find_contact_pairs(cell->contact, cell->description, Patterns{"Ball-Table", "x"}, &unknown).empty());
  EXPECT_EQ(unknown, (std::vector<std::string>{"Ball-Table", "x"}));
}

}  // namespace
}  // namespace takt

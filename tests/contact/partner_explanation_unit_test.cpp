// The reason of every decision of the partner search, one situation per rule, and the listing of sequences.
#include "server/contact/holding/partner_explanation.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/box_cell.h"

namespace takt {
namespace {

using ::testing::ElementsAre;

constexpr ContactGraph::Vertex kGripper{ComponentType::gripper, 0}, kGround{ComponentType::ground, 0};

ContactGraph::Vertex part(int hierarchy) {
  return {ComponentType::part, hierarchy};
}

ContactGraph graph(std::vector<ContactGraph::Vertex> vertices,
                   const std::vector<std::pair<int, int>>& contacts) {
  ContactGraph g(vertices.size());
  g.vertices = std::move(vertices);
  for (const auto& [a, b] : contacts) g.add_contact(a, b);
  return g;
}

void expect(const PartnerDecision& d, int partner, PartnerRule rule, int rival) {
  EXPECT_EQ(d.partner, partner);
  EXPECT_EQ(to_string(d.rule), to_string(rule));
  EXPECT_EQ(d.rival, rival);
}

TEST(PartnerDecision, APartWithoutAReachableEndHasNoPartner) {
  // A Part of lower hierarchy is touched, but no sequence leads there.
  const ContactGraph g = graph({part(2), part(1), kGround}, {{0, 1}});
  expect(decide_partner(g, 0, 2), -1, PartnerRule::nothing_reachable, -1);
}

TEST(PartnerDecision, TheOnlyEndIsThePartnerForAnyNumberOfSequences) {
  const ContactGraph g = graph({part(1), part(2), part(3), kGround}, {{0, 1}, {0, 2}, {1, 3}, {2, 3}});
  const PartnerDecision d = decide_partner(g, 0, -1);
  expect(d, 3, PartnerRule::only_end, -1);
  EXPECT_EQ(d.contacts, 2);
}

TEST(PartnerDecision, ADistantGripperBeatsTheGroundThatHeldThePart) {
  const ContactGraph g = graph({part(1), part(2), kGround, kGripper}, {{0, 2}, {0, 1}, {1, 3}});
  const PartnerDecision d = decide_partner(g, 0, 2);
  expect(d, 3, PartnerRule::end_type, 2);
  EXPECT_EQ(d.contacts, 2);
  EXPECT_EQ(d.rival_contacts, 1);
}

TEST(PartnerDecision, AGroundBeatsAPart) {
  const ContactGraph g = graph({part(1), part(2), part(2), kGround}, {{0, 1}, {0, 2}, {2, 3}});
  expect(decide_partner(g, 0, 1), 3, PartnerRule::end_type, 1);
}

TEST(PartnerDecision, TheShorterSequenceBeatsThePresentPartner) {
  const ContactGraph g = graph({part(1), part(2), kGripper, kGripper}, {{0, 1}, {1, 2}, {0, 3}});
  expect(decide_partner(g, 0, 2), 3, PartnerRule::shorter_sequence, 2);
}

TEST(PartnerDecision, ThePresentPartnerBeatsTheLowerId) {
  const ContactGraph g = graph({part(1), kGround, kGround}, {{0, 1}, {0, 2}});
  expect(decide_partner(g, 0, 2), 2, PartnerRule::present_partner, 1);
}

TEST(PartnerDecision, TheLowerIdIsThePartnerWhereNeitherHeldThePart) {
  const ContactGraph g = graph({part(1), kGround, kGround}, {{0, 1}, {0, 2}});
  expect(decide_partner(g, 0, -1), 1, PartnerRule::lower_id, 2);
}

TEST(PartnerDecision, TheStrongestRivalIsNamed) {
  // The search finds the ground first, but without the partner the other gripper would hold the Part.
  const ContactGraph g =
      graph({part(1), part(2), kGround, kGripper, kGripper}, {{0, 2}, {0, 4}, {0, 1}, {1, 3}});
  expect(decide_partner(g, 0, -1), 4, PartnerRule::shorter_sequence, 3);
}

TEST(SequenceListing, SequencesToThePartnerComeFirstThenByTypeAndLength) {
  // Thesis Fig. 3.15: P 0, O 1, B 2, C 3, T 4, G 5; (3.38) to (3.40): POG, PBT, POBT.
  const ContactGraph g = graph({part(2), part(3), part(4), part(3), kGround, kGripper},
                               {{0, 1}, {0, 2}, {1, 2}, {2, 3}, {2, 4}, {1, 5}});
  const SequenceListing listing = list_sequences(g, 0, 5, {});
  EXPECT_EQ(listing.count, 3U);
  EXPECT_THAT(listing.sequences,
              ElementsAre(ElementsAre(0, 1, 5), ElementsAre(0, 2, 4), ElementsAre(0, 1, 2, 4)));
}

/// Layers of fully connected Parts on a ground: width^layers sequences.
ContactGraph layers(int count, int width) {
  ContactGraph g(static_cast<std::size_t>(count * width + 2));
  g.vertices.front() = part(0);
  g.vertices.back() = kGround;
  const int ground = count * width + 1;
  for (int layer = 0; layer < count; ++layer) {
    for (int i = 0; i < width; ++i) {
      const int v = 1 + layer * width + i;
      g.vertices[static_cast<std::size_t>(v)] = part(layer + 1);
      if (layer == 0) g.add_contact(0, v);
      if (layer + 1 == count) g.add_contact(v, ground);
      for (int k = 0; k < width && layer > 0; ++k) g.add_contact(v, 1 + (layer - 1) * width + k);
    }
  }
  return g;
}

TEST(SequenceListing, ExponentiallyManySequencesAreCountedAndSomeListed) {
  const SequenceListing listing = list_sequences(layers(12, 10), 0, 121, {});
  EXPECT_EQ(listing.count, 1'000'000'000'000U);
  // 200 of 14 components each are more than the 2000 vertices allowed.
  EXPECT_EQ(listing.sequences.size(), 142U);
  const SequenceListing shorter = list_sequences(layers(5, 10), 0, 51, {});
  EXPECT_EQ(shorter.count, 100'000U);
  EXPECT_EQ(shorter.sequences.size(), 200U);
  EXPECT_EQ(list_sequences(layers(40, 10), 0, 401, {}).count, std::numeric_limits<std::uint64_t>::max());
}

TEST(SequenceListing, TheListingEndsAtItsLimitOfContacts) {
  ListingLimits limits;
  limits.visits = 50;
  const SequenceListing listing = list_sequences(layers(5, 10), 0, 51, limits);
  EXPECT_EQ(listing.count, 100'000U);
  EXPECT_LT(listing.sequences.size(), 50U);
}

TEST(ContactDepth, TheDepthIsThatOfTheDeepestPairOfConvexPieces) {
  // An L of two boxes under a cube: one leg is 2 mm deep in it, the other 5 mm.
  std::vector<Component> components(2);
  const auto box = [](const Vec3& lower, const Vec3& upper) {
    std::vector<Vec3> corners;
    for (int i = 0; i < 8; ++i)
      corners.emplace_back((i & 1) ? upper.x() : lower.x(), (i & 2) ? upper.y() : lower.y(),
                           (i & 4) ? upper.z() : lower.z());
    return ConvexShape::from_points(corners);
  };
  components[0].convex = {box({0.0, 0.0, 0.0}, {0.1, 0.1, 0.1})};
  components[1].convex = {box({-0.02, 0.0, -0.1}, {0.02, 0.1, 0.002}),
                          box({0.06, 0.0, -0.1}, {0.12, 0.1, 0.005})};
  for (Component& c : components) c.box = c.convex.box();
  const CollisionWorld world(components, 0.0002);
  int budget = 10;
  const ContactDepth depth = contact_depth(world, 0, 1, budget);
  EXPECT_TRUE(depth.known);
  EXPECT_NEAR(depth.distance_m, -0.005, 1e-9);
  EXPECT_NEAR(depth.normal_W.z(), -1.0, 1e-9);
  EXPECT_NEAR(depth.position_W.z(), 0.0025, 1e-9);
  EXPECT_EQ(budget, 8);
  budget = 1;
  EXPECT_FALSE(contact_depth(world, 0, 1, budget).known);
}

}  // namespace
}  // namespace takt

// Connected touching pairs, and the carriers of Parts: the rules on small contact graphs.
#include "server/contact/holding/connection_rules.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/contact/holding/support_tree.h"

namespace takt {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;
using Keys = std::vector<ConnectionKey>;

// Fig. 3.15: P and O and C in B, B on table T; P also overlaps B. Two grippers G, H.
enum Id : int { P, O, B, C, T, G, H };

ContactGraph assembly(const std::vector<std::pair<int, int>>& more = {}) {
  ContactGraph graph(7);
  graph.vertices = {{ComponentType::part, 2},   {ComponentType::part, 3},   {ComponentType::part, 4},
                    {ComponentType::part, 3},   {ComponentType::ground, 0}, {ComponentType::gripper, 0},
                    {ComponentType::gripper, 0}};
  for (const auto& [a, b] : {std::pair{P, O}, {P, B}, {O, B}, {B, C}, {B, T}}) graph.add_contact(a, b);
  for (const auto& [a, b] : more) graph.add_contact(a, b);
  return graph;
}

Keys plain(const ContactGraph& graph) {
  Keys keys;
  for (const int part : {P, O, B, C}) substitute_force_connections(graph, part, keys);
  return keys;
}
Keys extended(const ContactGraph& graph, int present = -1) {
  Keys keys;
  for (const int part : {P, O, B, C}) extended_substitute_force_connections(graph, part, present, keys);
  return keys;
}

TEST(ConnectionRules, ThePlainRuleConnectsAllTouchingPairs) {
  EXPECT_THAT(plain(assembly({{O, G}})),
              ElementsAre(ConnectionKey{P, O}, ConnectionKey{P, B}, ConnectionKey{O, B}, ConnectionKey{O, G},
                          ConnectionKey{B, T}, ConnectionKey{C, B}));
}

TEST(ConnectionRules, TheExtendedRuleWithoutAGripperEqualsThePlainRule) {
  EXPECT_EQ(extended(assembly()), plain(assembly()));
}

TEST(ConnectionRules, AGripperComesBeforeAGround) {
  const Keys keys = extended(assembly({{B, G}}));
  // B is carried, and all that is lower rides on it.
  EXPECT_THAT(keys, ElementsAre(ConnectionKey{P, O}, ConnectionKey{P, B}, ConnectionKey{O, B},
                                ConnectionKey{B, G}, ConnectionKey{C, B}));
}

TEST(ConnectionRules, AGraspedPartReleasesPartsOfHigherRank) {
  EXPECT_THAT(extended(assembly({{O, G}})),
              ElementsAre(ConnectionKey{P, O}, ConnectionKey{P, B}, ConnectionKey{O, G}, ConnectionKey{B, T},
                          ConnectionKey{C, B}));
  // Both in hand: each hangs on its own gripper.
  EXPECT_THAT(extended(assembly({{O, G}, {P, G}})), ElementsAre(ConnectionKey{P, G}, ConnectionKey{O, G},
                                                                ConnectionKey{B, T}, ConnectionKey{C, B}));
}

TEST(ConnectionRules, PartsOfEqualRankConnectOnlyWhileUngrasped) {
  ContactGraph graph(3);
  graph.vertices = {{ComponentType::part, 2}, {ComponentType::part, 2}, {ComponentType::gripper, 0}};
  graph.add_contact(0, 1);
  Keys keys;
  for (const int part : {0, 1}) extended_substitute_force_connections(graph, part, -1, keys);
  EXPECT_THAT(keys, ElementsAre(ConnectionKey{0, 1}));
  for (const int held : {0, 1}) {
    ContactGraph grasped = graph;
    grasped.add_contact(held, 2);
    keys.clear();
    for (const int part : {0, 1}) extended_substitute_force_connections(grasped, part, -1, keys);
    EXPECT_THAT(keys, ElementsAre(ConnectionKey{held, 2})) << held;
  }
}

TEST(ConnectionRules, ThePresentGripperStaysWhenASecondOneTouches) {
  const ContactGraph graph = assembly({{B, G}, {B, H}});
  Keys keys;
  extended_substitute_force_connections(graph, B, -1, keys);
  extended_substitute_force_connections(graph, B, H, keys);
  extended_substitute_force_connections(graph, B, T, keys);
  EXPECT_THAT(keys, ElementsAre(ConnectionKey{B, G}, ConnectionKey{B, H}, ConnectionKey{B, G}));
}

class SupportTreeTest : public testing::Test {
 protected:
  SupportTreeTest() : components_(7) {
    const ContactGraph graph = assembly();
    for (std::size_t i = 0; i < 7; ++i) {
      components_[i].type = graph.vertices[i].type;
      components_[i].hierarchy = graph.vertices[i].hierarchy;
    }
  }
  SupportTree grown(const ContactGraph& graph) {
    SupportTree tree(components_);
    const std::vector<int> parts{P, O, B, C};
    tree.grow(graph, parts, [](int, int) { return true; });
    return tree;
  }
  std::vector<Component> components_;
};

TEST_F(SupportTreeTest, TheTreeGrowsFromTheTable) {
  const SupportTree tree = grown(assembly());
  EXPECT_EQ(tree.carrier(B), T);
  EXPECT_EQ(tree.carrier(O), B);
  EXPECT_EQ(tree.carrier(C), B);
  EXPECT_EQ(tree.carrier(P), B);  // one connection nearer to the table than over O
  for (const int part : {P, O, B, C}) EXPECT_EQ(tree.support(part), T);
}

TEST_F(SupportTreeTest, AGripperIsPreferredAtEqualDistance) {
  const SupportTree tree = grown(assembly({{O, G}}));
  EXPECT_EQ(tree.carrier(O), G);
  EXPECT_EQ(tree.carrier(B), T);
  EXPECT_EQ(tree.carrier(P), O);
  EXPECT_EQ(tree.support(P), G);
  EXPECT_EQ(grown(assembly({{B, G}})).carrier(B), G);
}

TEST_F(SupportTreeTest, AFreeClusterHangsOnItsHighestPart) {
  ContactGraph graph = assembly();
  graph.remove_contact(B, T);
  const SupportTree tree = grown(graph);
  EXPECT_EQ(tree.carrier(B), -1);
  EXPECT_EQ(tree.carrier(O), B);
  for (const int part : {P, O, B, C}) EXPECT_EQ(tree.support(part), -1);
}

TEST_F(SupportTreeTest, AnOpenConnectionCarriesNothing) {
  SupportTree tree(components_);
  const std::vector<int> parts{P, O, B, C};
  tree.grow(assembly(), parts, [](int a, int b) { return std::minmax(a, b) != std::minmax<int>(B, C); });
  EXPECT_EQ(tree.carrier(C), -1);
  EXPECT_EQ(tree.support(C), -1);
}

}  // namespace
}  // namespace takt

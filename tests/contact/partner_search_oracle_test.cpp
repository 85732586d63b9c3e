// The partner search on the thesis' own example (Fig. 3.15, equations (3.38) to (3.40), Table 3.3) and its
// tie rules.
#include "server/contact/holding/partner_search.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

namespace takt {
namespace {

using ::testing::ElementsAre;
using ::testing::UnorderedElementsAre;

constexpr const char* kNames = "POBCTG";
enum Id : int { P, O, B, C, T, G };

std::string text(const std::vector<int>& sequence) {
  std::string result;
  for (const int id : sequence) result += kNames[id];
  return result;
}

std::vector<std::string> texts(const std::vector<std::vector<int>>& sequences) {
  std::vector<std::string> result;
  for (const auto& sequence : sequences) result.push_back(text(sequence));
  return result;
}

/// The assembly of Fig. 3.15: on table T, O grasped by G, P also overlapping the hull of B.
ContactGraph assembly(bool grasped) {
  ContactGraph graph(6);
  graph.vertices = {{ComponentType::part, 2}, {ComponentType::part, 3},   {ComponentType::part, 4},
                    {ComponentType::part, 3}, {ComponentType::ground, 0}, {ComponentType::gripper, 0}};
  for (const auto& [a, b] : {std::pair{P, O}, {P, B}, {O, B}, {B, C}, {B, T}}) graph.add_contact(a, b);
  if (grasped) graph.add_contact(O, G);
  return graph;
}

TEST(PartnerSearch, SequencesAreThoseOfTheThesis) {
  const ContactGraph graph = assembly(true);
  EXPECT_THAT(texts(list_sequences(graph, P).back().resulting), UnorderedElementsAre("POG", "PBT", "POBT"));
}

TEST(PartnerSearch, TheStepsAreThoseOfTable33) {
  const auto steps = list_sequences(assembly(true), P);
  ASSERT_EQ(steps.size(), 4U);
  EXPECT_THAT(texts(steps[0].queue), ElementsAre("P"));
  EXPECT_THAT(texts(steps[0].found), UnorderedElementsAre("PO", "PB"));
  EXPECT_THAT(texts(steps[0].resulting), ElementsAre());
  EXPECT_THAT(texts(steps[1].queue), UnorderedElementsAre("PO", "PB"));
  EXPECT_THAT(texts(steps[1].found), UnorderedElementsAre("POG", "POB", "PBT"));
  EXPECT_THAT(texts(steps[1].resulting), ElementsAre());
  EXPECT_THAT(texts(steps[2].queue), UnorderedElementsAre("POG", "POB", "PBT"));
  EXPECT_THAT(texts(steps[2].found), ElementsAre("POBT"));
  EXPECT_THAT(texts(steps[2].resulting), UnorderedElementsAre("POG", "PBT"));
  EXPECT_THAT(texts(steps[3].queue), ElementsAre("POBT"));
  EXPECT_THAT(texts(steps[3].found), ElementsAre());
  EXPECT_THAT(texts(steps[3].resulting), UnorderedElementsAre("POG", "PBT", "POBT"));
}

TEST(PartnerSearch, AGripperComesBeforeAGroundAndAGroundBeforeAPart) {
  PartnerSearch search(6);
  const ContactGraph grasped = assembly(true);
  EXPECT_EQ(search.find(grasped, P, -1), G);
  EXPECT_EQ(search.find(grasped, O, -1), G);
  EXPECT_EQ(search.find(grasped, B, -1), T);
  EXPECT_EQ(search.find(grasped, C, -1), T);
  const ContactGraph placed = assembly(false);
  for (const int part : {P, O, B, C}) EXPECT_EQ(search.find(placed, part, -1), T) << kNames[part];
}

TEST(PartnerSearch, AFreeAssemblyHangsOnItsBase) {
  ContactGraph graph(6);
  graph.vertices = assembly(false).vertices;
  for (const auto& [a, b] : {std::pair{P, O}, {O, B}, {B, C}}) graph.add_contact(a, b);
  PartnerSearch search(6);
  EXPECT_EQ(search.find(graph, P, -1), B);
  EXPECT_EQ(search.find(graph, O, -1), B);
  EXPECT_EQ(search.find(graph, C, -1), B);
  EXPECT_EQ(search.find(graph, B, -1), -1);
}

TEST(PartnerSearch, SequencesEndAtGrippersAndGrounds) {
  // As printed, Algorithm 1 would run on from G through C to T, or from T to C.
  ContactGraph graph = assembly(true);
  graph.clear_contacts();
  graph.add_contact(O, G);
  graph.add_contact(G, C);
  graph.add_contact(C, T);
  EXPECT_THAT(texts(list_sequences(graph, O).back().resulting), ElementsAre("OG"));
  PartnerSearch search(6);
  EXPECT_EQ(search.find(graph, O, -1), G);
}

TEST(PartnerSearch, TiesGoToTheShorterSequenceThePresentPartnerAndTheLowerId) {
  ContactGraph graph(4);  // a Part between two grippers, and a second Part above it
  graph.vertices = {{ComponentType::part, 1},
                    {ComponentType::gripper, 0},
                    {ComponentType::gripper, 0},
                    {ComponentType::part, 2}};
  graph.add_contact(0, 1);
  graph.add_contact(0, 2);
  PartnerSearch search(4);
  EXPECT_EQ(search.find(graph, 0, -1), 1);
  EXPECT_EQ(search.find(graph, 0, 2), 2) << "a handover passes only when the first gripper opens";
  EXPECT_EQ(search.find(graph, 0, 1), 1);
  graph.clear_contacts();
  graph.add_contact(0, 2);
  graph.add_contact(0, 3);
  graph.add_contact(3, 1);
  EXPECT_EQ(search.find(graph, 0, 1), 2) << "the shorter sequence wins over the present partner";
}

}  // namespace
}  // namespace takt

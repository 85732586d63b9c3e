// The partner search against listing every sequence, on random contact graphs.
#include "server/contact/partner_search.h"

#include <gtest/gtest.h>

#include <random>
#include <set>

namespace takt {
namespace {

/// Partner from the full list of sequences, by the rules in words: type of the end, length, present partner,
/// id.
int partner_by_listing(const ContactGraph& graph, int part, int present) {
  const std::vector<SearchStep> steps = list_sequences(graph, part);
  int best = -1;
  std::tuple<int, std::size_t, bool, int> best_key{};
  for (const std::vector<int>& sequence : steps.back().resulting) {
    const int end = sequence.back();
    const ComponentType type = graph.vertices[static_cast<std::size_t>(end)].type;
    const int preference = type == ComponentType::gripper ? 0 : type == ComponentType::ground ? 1 : 2;
    const std::tuple<int, std::size_t, bool, int> key{preference, sequence.size(), end != present, end};
    if (best == -1 || key < best_key) best = end, best_key = key;
  }
  return best;
}

TEST(PartnerSearchProperty, EqualsListingAllSequencesOnRandomGraphs) {
  std::mt19937 random(20261121);
  const auto below = [&](int n) { return static_cast<int>(random() % static_cast<unsigned>(n)); };
  int with_partner = 0;
  for (int trial = 0; trial < 100000; ++trial) {
    const int count = 3 + below(7);
    ContactGraph graph(static_cast<std::size_t>(count));
    for (auto& vertex : graph.vertices) {
      const int kind = below(6);
      vertex.type = kind == 0   ? ComponentType::gripper
                    : kind == 1 ? ComponentType::ground
                                : ComponentType::part;
      vertex.hierarchy = 1 + below(4);
    }
    for (int a = 0; a < count; ++a) {
      for (int b = a + 1; b < count; ++b) {
        const bool part = graph.vertices[static_cast<std::size_t>(a)].type == ComponentType::part ||
                          graph.vertices[static_cast<std::size_t>(b)].type == ComponentType::part;
        if (part && below(100) < 40) graph.add_contact(a, b);
      }
    }
    PartnerSearch search(static_cast<std::size_t>(count));
    for (int part = 0; part < count; ++part) {
      if (graph.vertices[static_cast<std::size_t>(part)].type != ComponentType::part) continue;
      const int present = below(count + 1) - 1;
      const int found = search.find(graph, part, present);
      ASSERT_EQ(found, partner_by_listing(graph, part, present)) << "trial " << trial << ", part " << part;
      with_partner += found >= 0 ? 1 : 0;
    }
  }
  EXPECT_GT(with_partner, 100000);
}

}  // namespace
}  // namespace takt

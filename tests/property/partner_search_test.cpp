// The partner search against listing every sequence, on random contact graphs.
#include "server/contact/partner_search.h"

#include <gtest/gtest.h>

#include <random>

#include "tests/support/box_oracle.h"

namespace takt {
namespace {

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
      ASSERT_EQ(found, test::partner_by_listing(graph, part, present))
          << "trial " << trial << ", part " << part;
      with_partner += found >= 0 ? 1 : 0;
    }
  }
  EXPECT_GT(with_partner, 100000);
}

}  // namespace
}  // namespace takt

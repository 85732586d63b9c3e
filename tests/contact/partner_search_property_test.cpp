// The partner search against listing every sequence, on random contact graphs.
#include "server/contact/holding/partner_search.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <map>
#include <random>
#include <tuple>

#include "server/contact/holding/partner_explanation.h"

#include "tests/support/box_oracle.h"

namespace takt {
namespace {

/// The deciding rule, from the full list: the first in which the partner differs from the best of all other
/// ends.
PartnerRule rule_by_listing(const std::vector<std::vector<int>>& sequences, const ContactGraph& graph,
                            int partner, int present) {
  if (sequences.empty()) return PartnerRule::nothing_reachable;
  using Key = std::tuple<int, std::size_t, bool, int>;
  std::map<int, Key> best;  // by end
  for (const std::vector<int>& sequence : sequences) {
    const int end = sequence.back();
    const ComponentType type = graph.vertices[static_cast<std::size_t>(end)].type;
    const int rank = type == ComponentType::gripper ? 0 : type == ComponentType::ground ? 1 : 2;
    const Key key{rank, sequence.size(), end != present, end};
    const auto [entry, fresh] = best.try_emplace(end, key);
    if (!fresh) entry->second = std::min(entry->second, key);
  }
  const Key mine = best.at(partner);
  best.erase(partner);
  if (best.empty()) return PartnerRule::only_end;
  const Key other = std::min_element(best.begin(), best.end(), [](const auto& a, const auto& b) {
                      return a.second < b.second;
                    })->second;
  if (std::get<0>(mine) != std::get<0>(other)) return PartnerRule::end_type;
  if (std::get<1>(mine) != std::get<1>(other)) return PartnerRule::shorter_sequence;
  return std::get<2>(mine) != std::get<2>(other) ? PartnerRule::present_partner : PartnerRule::lower_id;
}

TEST(PartnerSearchProperty, TheSearchEqualsListingAllSequencesOnRandomGraphs) {
  std::mt19937 random(20261121);
  const auto below = [&](int n) { return static_cast<int>(random() % static_cast<unsigned>(n)); };
  int with_partner = 0;
  std::array<int, 6> rules{};
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

      // The explanation contains the same decision, and all sequences.
      const PartnerDecision decision = decide_partner(graph, part, present);
      ASSERT_EQ(decision.partner, found) << "trial " << trial << ", part " << part;
      std::vector<std::vector<int>> all = list_sequences(graph, part).back().resulting;
      std::vector<std::vector<int>> sequences = all;
      ASSERT_EQ(decision.rule, rule_by_listing(sequences, graph, found, present))
          << "trial " << trial << ", part " << part;
      ++rules[static_cast<std::size_t>(decision.rule)];
      // Without the partner the rival would hold the Part.
      if (decision.rival >= 0) {
        std::erase_if(sequences, [&](const auto& s) { return s.back() == found; });
        const auto rank = [&](const std::vector<int>& s) {
          return std::tuple(
              graph.vertices[static_cast<std::size_t>(s.back())].type == ComponentType::gripper  ? 0
              : graph.vertices[static_cast<std::size_t>(s.back())].type == ComponentType::ground ? 1
                                                                                                 : 2,
              s.size(), s.back() != present, s.back());
        };
        const auto strongest =
            std::min_element(sequences.begin(), sequences.end(),
                             [&](const auto& a, const auto& b) { return rank(a) < rank(b); });
        ASSERT_EQ(strongest->back(), decision.rival);
        ASSERT_EQ(static_cast<int>(strongest->size()) - 1, decision.rival_contacts);
      }
      ListingLimits no_limits;
      no_limits.sequences = no_limits.vertices = no_limits.visits = 1'000'000'000;
      SequenceListing listing = list_sequences(graph, part, found, no_limits);
      if (found >= 0) {
        ASSERT_EQ(listing.sequences.front().back(), found);
        ASSERT_EQ(static_cast<int>(listing.sequences.front().size()) - 1, decision.contacts);
      }
      ASSERT_EQ(listing.count, all.size());
      std::sort(listing.sequences.begin(), listing.sequences.end());
      std::sort(all.begin(), all.end());
      ASSERT_EQ(listing.sequences, all) << "trial " << trial << ", part " << part;
    }
  }
  EXPECT_GT(with_partner, 100000);
  for (const int count : rules) EXPECT_GT(count, 1000);
}

}  // namespace
}  // namespace takt

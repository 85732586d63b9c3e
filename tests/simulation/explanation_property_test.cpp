// Explanations in random cells with random handling: they agree with the simulation's decisions and have no
// effect.
#include "server/simulation/step/explanation.h"

#include <gtest/gtest.h>

#include <array>
#include <utility>
#include <vector>

#include "server/simulation/step/simulation.h"
#include "tests/support/random_handling.h"

namespace takt::test {
namespace {

struct Since {
  double time_s = 0.0;
  std::uint64_t step = 0;
  int before = -1;
};

TEST(Explanation, TheExplanationEqualsTheDecisionInAnyAssembly) {
  std::array<std::uint64_t, 6> rules{};
  std::uint64_t contacts = 0, changes = 0;
  for (unsigned seed = 21; seed < 25; ++seed) {
    RandomCellOptions options;
    options.seed = seed;
    options.parts = 40;
    options.grippers = 3;
    const RandomCell cell(options);
    RandomHandling handling(cell, seed);
    Simulation asked(cell.model()), silent(cell.model());
    Snapshot snapshot = asked.make_snapshot();
    std::vector<Since> since(cell.model()->components.size());
    const auto note = [&] {
      for (const ConnectionChange& change : asked.events().connection_changes) {
        since[static_cast<std::size_t>(change.part)] = {change.time_s, change.step, change.from};
        ++changes;
      }
    };
    note();
    while (snapshot.step < 5000) {
      const std::vector<Command> commands = handling.commands(snapshot);
      ASSERT_TRUE(asked.step(commands));
      ASSERT_TRUE(silent.step(commands));
      asked.read_snapshot(snapshot);
      note();
      const bool changed = !asked.events().connection_changes.empty();
      if (snapshot.step % 50 != 0 && !changed) continue;
      for (const int part : cell.parts) {
        const Explanation e = asked.explain(part);
        const ComponentSample& sample = snapshot.components[static_cast<std::size_t>(part)];
        const Since& truth = since[static_cast<std::size_t>(part)];
        ASSERT_EQ(e.decision.partner, sample.partner) << "Part " << part << " at step " << snapshot.step;
        ASSERT_EQ(e.state, sample.state);
        ASSERT_EQ(e.step, snapshot.step);
        ASSERT_EQ(e.since.time_s, truth.time_s);
        ASSERT_EQ(e.since.step, truth.step);
        ASSERT_EQ(e.since.before, truth.before);
        ++rules[static_cast<std::size_t>(e.decision.rule)];
        if (sample.partner >= 0) {
          ASSERT_EQ(e.sequences.sequences.front().back(), sample.partner);
          ASSERT_EQ(e.connections.size(), 1U);
          ASSERT_GE(e.contacts.size(), static_cast<std::size_t>(e.decision.contacts));
        }
        for (const ExplainedContact& contact : e.contacts) {
          ASSERT_TRUE(contact.depth.known);
          ASSERT_LE(contact.depth.distance_m, 0.0002 + 1e-6) << contact.a << " " << contact.b;
          ++contacts;
        }
        // Without held Parts, the connection's wrench is the only one on the Part.
        if (sample.partner >= 0 && e.held_count == 0) {
          ASSERT_LE((e.connections[0].on_base_W.f - sample.F_Bo_W.f).norm(), 1e-12);
        }
      }
    }
    ASSERT_EQ(asked.state_hash(), silent.state_hash());
    asked.reset();
    for (const int part : cell.parts) EXPECT_EQ(asked.explain(part).since.time_s, 0.0);
  }
  EXPECT_GT(changes, 100U);
  EXPECT_GT(contacts, 10000U);
  for (const PartnerRule rule : {PartnerRule::nothing_reachable, PartnerRule::only_end, PartnerRule::end_type,
                                 PartnerRule::shorter_sequence}) {
    EXPECT_GT(rules[static_cast<std::size_t>(rule)], 0U) << to_string(rule);
  }
}

}  // namespace
}  // namespace takt::test

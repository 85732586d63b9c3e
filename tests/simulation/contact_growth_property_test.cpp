// What surface contact keeps in memory follows the number of Parts, not that of their pairs.
#include <gtest/gtest.h>

#include "tests/support/pushed_crowd.h"

namespace takt {
namespace {

struct Kept {
  ContactInteraction::Size size;
  double parts = 0.0, pairs = 0.0;
};

Kept kept_by(int count) {
  test::PushedCrowd crowd(count);
  Simulation simulation(crowd.model());
  while (simulation.time_s() < 1.0) {
    if (!simulation.step(crowd.commands(simulation))) ADD_FAILURE() << simulation.fault();
    if (!simulation.fault().empty()) break;
  }
  // All but the pushed ones sleep by now.
  EXPECT_GT(simulation.statistics().part_steps_skipped, static_cast<std::uint64_t>(count) * 50U);
  return {simulation.contact_size(), static_cast<double>(count),
          static_cast<double>(simulation.model().contact.pairs.size())};
}

TEST(ContactGrowth, ContactsAndNearPairsGrowWithThePartsNotWithTheirPairs) {
  // The grid has less of an edge the larger it is: up to a fifth more neighbours each.
  const Kept few = kept_by(200), many = kept_by(600);
  ASSERT_GT(many.pairs / few.pairs, 8.0);
  const double grown = 1.2 * many.parts / few.parts;
  EXPECT_LT(static_cast<double>(many.size.near_pairs), grown * static_cast<double>(few.size.near_pairs));
  EXPECT_LT(static_cast<double>(many.size.contacts), 8.0 * many.parts);
  EXPECT_LT(static_cast<double>(many.size.contacts_with_buffers), 2.0 * many.parts);
  EXPECT_GE(many.size.contacts_with_buffers, 600U);  // each Part presses on its table
}

}  // namespace
}  // namespace takt

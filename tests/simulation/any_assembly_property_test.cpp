// Any assembly: random cells, random handling, and their invariants. The verdicts of the simulation are
// compared with a second, slow computation; its motion with closed forms.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <utility>
#include <vector>

#include "server/simulation/step/simulation.h"
#include "tests/support/assembly_oracles.h"
#include "tests/support/effort.h"
#include "tests/support/random_handling.h"

namespace takt::test {
namespace {

/// Kinetic plus gravitational energy of all Parts, zero at rest on the floor (J).
double mechanical_energy(const RandomCell& cell, const Snapshot& s) {
  double energy = 0.0;
  for (const int part : cell.parts) {
    const Component& c = cell.model()->components[static_cast<std::size_t>(part)];
    const ComponentSample& sample = s.components[static_cast<std::size_t>(part)];
    const Vec3 p = center_of_mass(*cell.model(), s, part);
    const Vec3 w_B = sample.q_WB.conjugate() * sample.V_WB.w;
    energy += 0.5 * c.mass_kg * velocity_at(s, part, p).squaredNorm() + 0.5 * w_B.dot(c.I_BBcm_B * w_B) +
              c.mass_kg * kGravity_m_s2 * (p.z() - RandomCell::kFloor_m);
  }
  return energy;
}

struct Trial {
  RandomCellOptions cell;
  std::uint64_t busy_steps = 8000;     ///< with arms moving
  std::uint64_t passive_steps = 1500;  ///< all grippers open, no robot moves
  std::uint64_t every = 1;             ///< partners are compared in every n-th step
};

struct Coverage {
  RandomHandling::Counts done;
  std::uint64_t answers = 0, unlisted = 0, captures = 0, part_steps = 0, assembly_steps = 0;
  std::size_t largest_assembly = 0;
  std::ptrdiff_t passed_on = 0;  ///< Parts that went from hand to hand
  std::ptrdiff_t let_go = 0;     ///< Parts in the hands that opened all at once
};

void run_trial(const Trial& trial, Coverage& coverage) {
  SCOPED_TRACE("seed " + std::to_string(trial.cell.seed));
  const RandomCell cell(trial.cell);
  RandomHandling handling(cell, trial.cell.seed + 1000);
  PartnerOracle partners(cell);
  HoldOracle holds(cell);
  FallOracle falls(cell);
  Simulation simulation(cell.model());
  Snapshot before = simulation.make_snapshot(), after = before;
  std::vector<std::vector<Command>> sent;
  const auto is_palm = [&](int id) {
    return std::find(cell.palms.begin(), cell.palms.end(), id) != cell.palms.end();
  };
  const auto advance = [&](std::vector<Command> commands) {
    ASSERT_TRUE(simulation.step(commands)) << simulation.fault();
    sent.push_back(std::move(commands));
    for (const ConnectionChange& change : simulation.events().connection_changes) {
      coverage.passed_on += (is_palm(change.from) && is_palm(change.to)) ? 1 : 0;
    }
    std::swap(before, after);
    simulation.read_snapshot(after);
    for (std::size_t g = 0; g < cell.palms.size(); ++g)
      ASSERT_EQ(after.grippers[g].closed, handling.closed(g));
    partners.follow(before, after);
    if (before.step % trial.every == 0) partners.check(before, after);
    if (!testing::Test::HasFatalFailure()) holds.check(before, after);
    if (!testing::Test::HasFatalFailure()) falls.check(before, after);
  };

  while (after.step < trial.busy_steps && !testing::Test::HasFatalFailure())
    advance(handling.commands(after));
  // All arms stop, some with a Part in hand; when all motion has ended and no spring is under load, all hands
  // open at once.
  handling.abandon();
  const auto at_rest = [&] {
    return std::all_of(cell.parts.begin(), cell.parts.end(), [&](int part) {
      const Twist& V = after.components[static_cast<std::size_t>(part)].V_WB;
      return V.v.norm() < 1e-9 && V.w.norm() < 1e-9;
    });
  };
  for (int i = 0; i < 3000 && !at_rest() && !testing::Test::HasFatalFailure(); ++i) advance({});
  ASSERT_TRUE(at_rest()) << "three seconds after the last motion";
  for (const int part : cell.parts) {
    const int partner = after.components[static_cast<std::size_t>(part)].partner;
    coverage.let_go += is_palm(partner) ? 1 : 0;
  }
  const double energy = mechanical_energy(cell, after);
  advance(handling.let_go());
  for (std::uint64_t i = 0; i < trial.passive_steps && !testing::Test::HasFatalFailure(); ++i) {
    advance({});
    ASSERT_LE(mechanical_energy(cell, after), energy * (1.0 + 1e-6)) << "step " << after.step;
  }
  if (testing::Test::HasFatalFailure()) return;

  // The same commands without observation: the same bits.
  Simulation again(cell.model());
  for (const std::vector<Command>& commands : sent) ASSERT_TRUE(again.step(commands));
  ASSERT_EQ(again.state_hash(), simulation.state_hash());

  const RandomHandling::Counts& done = handling.counts();
  coverage.done.picks += done.picks, coverage.done.tilts += done.tilts;
  coverage.done.handovers += done.handovers, coverage.done.on_tables += done.on_tables;
  coverage.done.on_parts += done.on_parts, coverage.done.drops += done.drops;
  coverage.done.throws += done.throws;
  coverage.answers += partners.answers, coverage.unlisted += partners.unlisted;
  coverage.captures += holds.captures;
  coverage.part_steps += falls.part_steps, coverage.assembly_steps += falls.assembly_steps;
  coverage.largest_assembly = std::max(coverage.largest_assembly, falls.largest_assembly);
  std::printf("seed %u: %zu Parts, %.0f steps, %d picks, worst hold %.2f / %.2f of the bound, %.0f unclear\n",
              trial.cell.seed, cell.parts.size(), static_cast<double>(after.step), done.picks, holds.worst,
              holds.worst_angle, static_cast<double>(partners.unclear_steps));
}

TEST(AnyAssembly, NoPartIsLostUnderRandomHandling) {
  const int trials = 5 * static_cast<int>(effort());
  Coverage coverage;
  for (int seed = 1; seed <= trials; ++seed) {
    Trial trial;
    trial.cell.seed = static_cast<unsigned>(seed);
    trial.cell.parts = 10 + 6 * (seed % 11);
    trial.cell.grippers = 2 + seed % 3;
    trial.cell.tables = 1 + seed % 2;
    run_trial(trial, coverage);
    if (HasFatalFailure()) return;
  }
  // The trials reached their purpose.
  EXPECT_GT(coverage.done.picks, 4 * trials);
  EXPECT_GT(coverage.done.handovers, 3 * trials / 10);
  EXPECT_GT(coverage.done.on_tables, trials / 2);
  EXPECT_GT(coverage.done.on_parts, trials / 2);
  EXPECT_GT(coverage.done.drops, 3 * trials / 10);
  EXPECT_GT(coverage.done.throws, 3 * trials / 10);
  EXPECT_GT(coverage.part_steps, 100U * static_cast<unsigned>(trials));
  EXPECT_GT(coverage.assembly_steps, 100U * static_cast<unsigned>(trials));
  EXPECT_GT(coverage.passed_on, 3 * trials / 10);
  EXPECT_GT(coverage.let_go, trials / 2);
  EXPECT_LT(coverage.unlisted, coverage.answers / 100);
  std::printf(
      "picks %d, tilts %d, handovers %d, on tables %d, on Parts %d, drops %d, throws %d; %.0f catches, "
      "%.0f + %.0f steps of fall, up to %zu Parts in one, %.0f passed on, %.0f let go at the end\n",
      coverage.done.picks, coverage.done.tilts, coverage.done.handovers, coverage.done.on_tables,
      coverage.done.on_parts, coverage.done.drops, coverage.done.throws,
      static_cast<double>(coverage.captures), static_cast<double>(coverage.part_steps),
      static_cast<double>(coverage.assembly_steps), coverage.largest_assembly,
      static_cast<double>(coverage.passed_on), static_cast<double>(coverage.let_go));
}

TEST(AnyAssembly, FiveHundredPartsKeepTheirPartners) {
  Coverage coverage;
  Trial trial;
  trial.cell = {77, 500, 4, 4, 5};
  trial.busy_steps = 4000, trial.passive_steps = 500, trial.every = 20;
  run_trial(trial, coverage);
  EXPECT_GT(coverage.done.picks, 5);
  EXPECT_LT(coverage.unlisted, coverage.answers / 100);
}

TEST(AnyAssembly, TenSecondsWithoutMotionGainNoEnergy) {
  Coverage coverage;
  Trial trial;
  trial.cell = {88, 40, 3, 2, 3};
  trial.busy_steps = 2500, trial.passive_steps = 10000, trial.every = 10;
  run_trial(trial, coverage);
  EXPECT_GT(coverage.let_go, 0);
  EXPECT_GT(coverage.assembly_steps, 0U);
}

}  // namespace
}  // namespace takt::test

// A saved state continues with the same bits, in the same simulation and in a new one: random assemblies
// handled at random, every solver, surface contact with both laws of friction. Altered or foreign bytes are
// refused or harmless, and never leave half a state.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <memory>
#include <random>

#include "server/simulation/model/model_hash.h"
#include "server/simulation/model/solver.h"
#include "tests/support/algorithm_cells.h"
#include "tests/support/random_handling.h"
#include "tests/support/state_runs.h"

namespace takt::test {
namespace {

/// Commands of a run in which gantries handle Parts at random.
StepCommands handling(const RandomCell& cell, const std::shared_ptr<const CellModel>& model, unsigned seed,
                      std::size_t steps) {
  StepCommands commands;
  RandomHandling hands(cell, seed);
  Simulation simulation(model);
  Snapshot snapshot = simulation.make_snapshot();
  for (std::size_t i = 0; i < steps; ++i) {
    simulation.read_snapshot(snapshot);
    commands.push_back(hands.commands(snapshot));
    EXPECT_TRUE(simulation.step(commands.back())) << simulation.fault();
  }
  return commands;
}

std::vector<std::size_t> some_steps(unsigned seed, std::size_t count, std::size_t below) {
  std::mt19937 dice(seed);
  std::vector<std::size_t> steps{0};
  while (steps.size() < count) steps.push_back(dice() % below);
  std::sort(steps.begin(), steps.end());
  steps.erase(std::unique(steps.begin(), steps.end()), steps.end());
  return steps;
}

RandomCellOptions small_cell(unsigned seed) {
  RandomCellOptions options;
  options.seed = seed;
  options.parts = 24;
  return options;
}

class SavedAssembly : public testing::TestWithParam<unsigned> {};
TEST_P(SavedAssembly, ASavedAssemblyContinuesWithTheSameBits) {
  const RandomCell cell(small_cell(GetParam()));
  const StepCommands commands = handling(cell, cell.model(), GetParam(), 5000);
  check_restored_runs(cell.model(), commands, some_steps(GetParam(), 6, 4500), 1200);
}
INSTANTIATE_TEST_SUITE_P(Seeds, SavedAssembly, testing::Range(1U, 7U));

TEST(SavedState, AStateSavedWithoutSleepingContinuesWithTheSameBits) {
  const RandomCell cell(small_cell(11));
  auto model = std::make_shared<CellModel>(*cell.model());
  model->interaction.exact_sleeping = false;
  const StepCommands commands = handling(cell, model, 11, 1500);
  check_restored_runs(model, commands, {700}, 300);
  EXPECT_EQ(model_hash(*model), model_hash(*cell.model()));
}

class SavedSolver : public testing::TestWithParam<std::string> {};
TEST_P(SavedSolver, ASavedSolverContinuesWithTheSameBits) {
  RandomCellOptions options = small_cell(3);
  options.parts = 8;
  const RandomCell cell(options);
  auto model = std::make_shared<CellModel>(*cell.model());
  model->solver.name = GetParam();
  model->solver.tolerance = solver_default_tolerance(GetParam());
  const StepCommands commands = handling(cell, model, 5, 1800);
  check_restored_runs(model, commands, some_steps(4, 4, 1500), 400);
}
std::vector<std::string> names() {
  return {solver_names().begin(), solver_names().end()};
}
INSTANTIATE_TEST_SUITE_P(Solvers, SavedSolver, testing::ValuesIn(names()),
                         [](const auto& test) { return test.param; });

class SavedAlgorithm : public testing::TestWithParam<InteractionAlgorithm> {};
TEST_P(SavedAlgorithm, ASavedAlgorithmContinuesWithTheSameBits) {
  RandomCellOptions options = small_cell(8);
  options.parts = 8;
  const RandomCell cell(options);
  auto model = under_algorithm(cell, GetParam());
  // Commands are made for milliseconds; here one in forty steps.
  const StepCommands coarse = handling(cell, cell.model(), 8, 300);
  StepCommands commands(40 * coarse.size());
  for (std::size_t i = 0; i < coarse.size(); ++i) commands[40 * i] = coarse[i];
  check_restored_runs(model, commands, some_steps(9, 3, 10000), 2000);
}
INSTANTIATE_TEST_SUITE_P(Algorithms, SavedAlgorithm,
                         testing::Values(InteractionAlgorithm::substitute_force,
                                         InteractionAlgorithm::extended_substitute_force));

struct SavedRun {
  SavedRun() : cell(small_cell(2)), simulation(cell.model()) {
    commands = handling(cell, cell.model(), 2, 1500);
    for (std::size_t i = 0; i < 1000; ++i) EXPECT_TRUE(simulation.step(commands[i]));
    EXPECT_EQ(simulation.attach(cell.parts[0], cell.palms[0]), "");
    EXPECT_TRUE(simulation.step(commands[1000]));
    simulation.save_state(bytes);
  }
  RandomCell cell;
  Simulation simulation;
  StepCommands commands;
  std::vector<std::byte> bytes;
};

// Altered in one to eight places, cut off, or lengthened: refused bytes have no effect, accepted ones can be
// advanced, or end in a fault.
TEST(SavedState, AlteredBytesAreRefusedOrHarmless) {
  const SavedRun saved;
  std::mt19937 dice(1);
  Simulation target(saved.cell.model());
  for (std::size_t i = 0; i < 30; ++i) ASSERT_TRUE(target.step(saved.commands[i]));
  std::vector<std::byte> before, after;
  int refused = 0, taken = 0;
  for (int trial = 0; trial < 1000; ++trial) {
    std::vector<std::byte> bytes = saved.bytes;
    const unsigned kind = dice() % 8;
    if (kind == 0) {
      bytes.resize(dice() % bytes.size());
    } else if (kind == 1) {
      bytes.insert(bytes.begin() + static_cast<std::ptrdiff_t>(dice() % bytes.size()), std::byte{1});
    } else {
      for (unsigned n = dice() % 8 + 1; n > 0; --n) {
        const std::size_t at = dice() % bytes.size();
        if (kind < 6) {
          bytes[at] ^= static_cast<std::byte>(1U << dice() % 8U);
        } else {  // a whole number of eight bytes
          static constexpr std::uint64_t kOdd[] = {
              0, ~0ULL, 0x7FF0000000000000ULL, 0x7FF8000000000001ULL, 0x7E37E43C8800759CULL, 1ULL << 63U};
          const std::uint64_t value = kOdd[dice() % 6];
          std::memcpy(&bytes[std::min(at, bytes.size() - 8)], &value, 8);
        }
      }
    }
    target.save_state(before);
    const std::uint32_t epoch = target.epoch();
    const std::string why = target.restore_state(bytes);
    if (!why.empty()) {
      ++refused;
      EXPECT_GT(why.size(), 20U) << why;
      target.save_state(after);
      ASSERT_EQ(before, after) << why;
      ASSERT_EQ(target.epoch(), epoch);
      continue;
    }
    ++taken;
    static_cast<void>(target.make_snapshot());
    for (std::size_t i = 1001; i < 1004; ++i) {
      const bool advanced = target.step(saved.commands[i]);
      ASSERT_EQ(advanced, target.fault().empty());
    }
    for (const int part : saved.cell.parts) static_cast<void>(target.explain(part));
    for (const PairConnection& pair : target.connections()) static_cast<void>(target.pair_wrench(pair));
  }
  EXPECT_GT(refused, 200);
  EXPECT_GT(taken, 50) << "the test must get beyond the reader";
  ASSERT_EQ(target.restore_state(saved.bytes), "");
  EXPECT_EQ(target.state_hash(), saved.simulation.state_hash());
}

TEST(SavedState, ForeignBytesAreRefusedWithASentence) {
  const SavedRun saved;
  Simulation target(saved.cell.model());
  const std::vector<std::byte> nothing, zeros(1000);
  EXPECT_NE(target.restore_state(nothing).find("end too early"), std::string::npos);
  EXPECT_NE(target.restore_state(zeros).find("no saved state"), std::string::npos);
  std::vector<std::byte> earlier = saved.bytes;
  earlier[8] = std::byte{9};  // the format, behind eight letters
  EXPECT_NE(target.restore_state(earlier).find("it has format 9, this program reads format 13"),
            std::string::npos);
  auto other = std::make_shared<CellModel>(*saved.cell.model());
  other->components[static_cast<std::size_t>(saved.cell.parts[0])].mass_kg *= 2.0;
  Simulation of_other(other);
  EXPECT_NE(of_other.restore_state(saved.bytes).find("of another model"), std::string::npos);
  EXPECT_EQ(of_other.epoch(), 0U);
}

/// A Part that spins too fast for the step: its quaternion grows, sooner or later. All bytes of save_state()
/// can be restored; an unrestorable state is refused and gives no bytes.
TEST(SavedState, TheStateOfARunawayIsRefusedWithAReason) {
  RandomCellOptions options = small_cell(2);
  options.parts = 3;
  const RandomCell cell(options);
  int good = 0, refused = 0;
  for (const double spin : {100.0, 1000.0, 2000.0, 3000.0, 5000.0, 1e4, 1e5}) {
    auto model = std::make_shared<CellModel>(*cell.model());
    model->parts[0].V_WB_initial.w.z() = spin;
    Simulation run(model), other(model);
    for (int i = 0; i < 40 && run.step({}); ++i) {
      std::vector<std::byte> bytes{std::byte{1}};
      const std::uint64_t hash = run.state_hash();
      const std::string why = run.save_state(bytes);
      EXPECT_EQ(run.state_hash(), hash);
      if (why.empty()) {
        ++good;
        ASSERT_EQ(other.restore_state(bytes), "") << spin << " rad/s, step " << run.step_index();
      } else {
        ++refused;
        EXPECT_TRUE(bytes.empty());
        EXPECT_NE(why.find("is no unit quaternion"), std::string::npos) << why;
      }
    }
  }
  EXPECT_GT(good, 40);
  EXPECT_GT(refused, 3);
}

TEST(SavedState, TheEpochAfterARestoreIsNew) {
  const RandomCell cell(small_cell(2));
  Simulation first(cell.model());
  for (int i = 0; i < 5; ++i) first.reset();
  std::vector<std::byte> bytes;
  first.save_state(bytes);
  Simulation second(cell.model());
  ASSERT_EQ(second.restore_state(bytes), "");
  EXPECT_EQ(second.epoch(), 6U);
  ASSERT_EQ(second.restore_state(bytes), "");
  EXPECT_EQ(second.epoch(), 7U);
}

TEST(SavedState, AFaultIsPartOfTheState) {
  const SavedRun saved;
  Simulation first(saved.cell.model());
  JointCommand wrong;
  wrong.robot = 0;
  wrong.position[0] = std::nan("");
  const std::vector<Command> commands{wrong};
  ASSERT_FALSE(first.step(commands));
  std::vector<std::byte> bytes;
  first.save_state(bytes);
  Simulation second(saved.cell.model());
  ASSERT_EQ(second.restore_state(bytes), "");
  EXPECT_EQ(second.fault(), first.fault());
  EXPECT_FALSE(second.step({}));
  second.reset();
  EXPECT_TRUE(second.step({}));
}

}  // namespace
}  // namespace takt::test

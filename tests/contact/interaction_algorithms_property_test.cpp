// Random assemblies, handled at random, under each of the three algorithms: states stay finite, every
// connection balances force and moment, the connections are those of the rules, and Parts without drive lose
// energy.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "server/contact/holding/connections.h"
#include "server/simulation/step/simulation.h"
#include "tests/support/algorithm_cells.h"
#include "tests/support/assembly_oracles.h"
#include "tests/support/effort.h"
#include "tests/support/random_handling.h"

namespace takt::test {
namespace {

constexpr int kFewestSubsteps = 40;  // in a millisecond, the step for which commands and oracles are made
static_assert(kFewestSubsteps * kLongestChainStep_s == kStep_s);

struct AlgorithmTrial {
  unsigned seed;
  InteractionAlgorithm algorithm;
  bool feed_forward;
};

std::shared_ptr<const CellModel> model_of(const RandomCell& cell, const AlgorithmTrial& trial, int substeps) {
  auto model = under_algorithm(cell, trial.algorithm, kStep_s / substeps);
  model->interaction.weight_feed_forward = trial.feed_forward;
  return model;
}

/// Sums the wrenches of all connections per component and compares them with those of the snapshot.
void check_balance(const Simulation& simulation, const Snapshot& s, double& largest) {
  const CellModel& model = simulation.model();
  std::vector<Wrench> sums(model.components.size());  // about the origins, as in snapshots
  Vec3 total_f = Vec3::Zero(), total_t = Vec3::Zero();
  double size = 1.0;
  for (const PairConnection& pair : simulation.connections()) {
    const Wrench on_base = simulation.pair_wrench(pair);
    ASSERT_TRUE(on_base.f.allFinite() && on_base.t.allFinite());
    const Vec3 at = center_of_mass(model, s, pair.base);
    size += on_base.f.norm() + on_base.t.norm();
    const auto add = [&](int id, double sign) {
      const Vec3 arm = at - s.components[static_cast<std::size_t>(id)].p_WB;
      sums[static_cast<std::size_t>(id)] +=
          Wrench{sign * on_base.f, sign * (on_base.t + arm.cross(on_base.f))};
    };
    add(pair.base, 1.0);
    add(pair.connection.partner, -1.0);
  }
  for (std::size_t i = 0; i < sums.size(); ++i) {
    const ComponentSample& sample = s.components[i];
    ASSERT_LE((sums[i].f - sample.F_Bo_W.f).norm(), 1e-10 * size) << model.components[i].name;
    ASSERT_LE((sums[i].t - sample.F_Bo_W.t).norm(), 1e-10 * size) << model.components[i].name;
    total_f += sample.F_Bo_W.f;
    total_t += sample.F_Bo_W.t + sample.p_WB.cross(sample.F_Bo_W.f);
  }
  ASSERT_LE(total_f.norm(), 1e-10 * size);
  ASSERT_LE(total_t.norm(), 1e-10 * size);
  largest = std::max(largest, size);
}

/// Kinetic energy, height over the floor, and the springs of all connections (J).
double energy(const RandomCell& cell, const Simulation& simulation, const Snapshot& s) {
  const CellModel& model = simulation.model();
  double sum = 0.0;
  for (const int part : cell.parts) {
    const Component& c = model.components[static_cast<std::size_t>(part)];
    const ComponentSample& sample = s.components[static_cast<std::size_t>(part)];
    const Vec3 p = center_of_mass(model, s, part);
    const Vec3 w_B = sample.q_WB.conjugate() * sample.V_WB.w;
    sum += 0.5 * c.mass_kg * velocity_at(s, part, p).squaredNorm() + 0.5 * w_B.dot(c.I_BBcm_B * w_B) +
           c.mass_kg * kGravity_m_s2 * (p.z() - RandomCell::kFloor_m);
  }
  for (const PairConnection& pair : simulation.connections()) {
    const Connection& connection = pair.connection;
    const ComponentSample& base = s.components[static_cast<std::size_t>(pair.base)];
    const ComponentSample& target = s.components[static_cast<std::size_t>(connection.partner)];
    const Vec3 stretch =
        target.p_WB + target.q_WB * connection.p_TBcm_T - center_of_mass(model, s, pair.base);
    const Mat3 E =
        base.q_WB.toRotationMatrix().transpose() * target.q_WB.toRotationMatrix() * connection.R_TB;
    const Eigen::AngleAxisd turn(E);
    const Vec3 angle_B = turn.angle() * turn.axis();
    sum += 0.5 * connection.gains.k_tr_N_per_m * stretch.squaredNorm() +
           0.5 * angle_B.dot(connection.gains.K_rot_B * angle_B);
  }
  return sum;
}

/// Invariants of the set of connections, for any poses.
void check_rules(const RandomCell& cell, const Simulation& simulation, const Snapshot& s) {
  const CellModel& model = simulation.model();
  const auto type = [&](int id) { return model.components[static_cast<std::size_t>(id)].type; };
  const auto rank = [&](int id) { return model.components[static_cast<std::size_t>(id)].hierarchy; };
  const std::span<const PairConnection> all = simulation.connections();
  ASSERT_TRUE(std::is_sorted(all.begin(), all.end(), [](const PairConnection& a, const PairConnection& b) {
    return a.key() < b.key();
  }));
  std::vector<int> supports(model.components.size(), 0);
  std::vector<char> grasped(model.components.size(), 0);
  for (const PairConnection& pair : all) {
    ASSERT_EQ(type(pair.base), ComponentType::part);
    const int target = pair.connection.partner;
    if (type(target) == ComponentType::gripper) grasped[static_cast<std::size_t>(pair.base)] = 1;
    if (type(target) != ComponentType::part) ++supports[static_cast<std::size_t>(pair.base)];
  }
  for (const int part : cell.parts) {
    const int partner = s.components[static_cast<std::size_t>(part)].partner;
    const bool connected = std::any_of(all.begin(), all.end(), [&](const PairConnection& pair) {
      return (pair.base == part && pair.connection.partner == partner) ||
             (pair.base == partner && pair.connection.partner == part);
    });
    ASSERT_TRUE(partner == -1 || connected) << part;
    ASSERT_TRUE(partner >= 0 || supports[static_cast<std::size_t>(part)] == 0) << part;
    // The chain of holders has no cycle.
    int steps = 0;
    for (int at = part; at >= 0 && type(at) == ComponentType::part; ++steps) {
      ASSERT_LE(steps, static_cast<int>(cell.parts.size())) << "a circle of carriers";
      at = s.components[static_cast<std::size_t>(at)].partner;
    }
  }
  if (model.interaction.algorithm != InteractionAlgorithm::extended_substitute_force) return;
  for (const int part : cell.parts) ASSERT_LE(supports[static_cast<std::size_t>(part)], 1);
  for (const PairConnection& pair : all) {
    const int target = pair.connection.partner;
    if (type(target) == ComponentType::ground) {
      ASSERT_FALSE(grasped[static_cast<std::size_t>(pair.base)]);
    }
    if (type(target) != ComponentType::part) continue;
    ASSERT_FALSE(grasped[static_cast<std::size_t>(pair.base)]);
    if (grasped[static_cast<std::size_t>(target)]) {
      ASSERT_GT(rank(target), rank(pair.base));
    }
  }
}

/// False as soon as a mode of the assemblies may be too fast for the step: the trial is then no measure.
bool run_algorithm_trial(const AlgorithmTrial& trial, int substeps, int& picks) {
  SCOPED_TRACE(std::string(to_string(trial.algorithm)) +
               (trial.feed_forward ? ", feed-forward" : ", thesis' law") + ", seed " +
               std::to_string(trial.seed));
  RandomCellOptions options;
  options.seed = trial.seed;
  options.parts = 24;
  const RandomCell cell(options);
  RandomHandling handling(cell, trial.seed + 1000);
  Simulation simulation(model_of(cell, trial, substeps));
  Snapshot s = simulation.make_snapshot();
  double largest = 0.0;
  bool stable = true;
  const auto advance = [&](const std::vector<Command>& commands) {
    for (int i = 0; i < substeps && stable; ++i) {
      ASSERT_TRUE(simulation.step(i == 0 ? std::span<const Command>(commands) : std::span<const Command>()))
          << simulation.fault();
      if (i > 0 && simulation.events().connection_changes.empty()) continue;
      simulation.read_snapshot(s);
      const double step_s = kStep_s / substeps;
      stable = step_s * bound_of_damping_per_s(simulation.model(), s, simulation.connections()) <= 2.0;
    }
    if (!stable) return;
    simulation.read_snapshot(s);
    check_balance(simulation, s, largest);
    if (!testing::Test::HasFatalFailure()) check_rules(cell, simulation, s);
  };
  const auto goes_on = [&] { return stable && !testing::Test::HasFatalFailure(); };
  for (int i = 0; i < 1500 && goes_on(); ++i) {
    Snapshot coarse = s;
    coarse.step = s.step / static_cast<std::uint64_t>(substeps);
    advance(handling.commands(coarse));
  }
  // Open jaws, no drive: from here on energy only decreases.
  handling.abandon();
  for (int i = 0; i < 50 && goes_on(); ++i) advance({});  // set-points run out
  if (goes_on()) advance(handling.let_go());
  double before = energy(cell, simulation, s);
  const double first = before;
  for (int i = 0; i < 500 && goes_on(); ++i) {
    advance({});
    if (!goes_on() || trial.feed_forward) continue;  // there the feed-forward works against the weight
    const double now = energy(cell, simulation, s);
    // To second order in the stretch the law is not that of a potential (the force acts at the Base, not at
    // the spring's other end): 5e-7 for a tumbling Part caught at 3 m/s. And the spring lifts a Part that was
    // caught within another one out of it.
    if (now > before + 1e-5 * first)
      ADD_FAILURE() << "step " << s.step << ": " << before << " -> " << now << " J";
    before = now;
  }
  if (!stable) return false;
  if (!testing::Test::HasFailure()) {
    EXPECT_LE(energy(cell, simulation, s), first * (1.0 + 1e-6));
    picks += handling.counts().picks;
  }
  return true;
}

TEST(InteractionAlgorithmsProperty, RandomAssembliesKeepForceBalanceRulesAndEnergy) {
  int picks = 0;
  for (const InteractionAlgorithm algorithm :
       {InteractionAlgorithm::substitute_force, InteractionAlgorithm::extended_substitute_force,
        InteractionAlgorithm::partner_search}) {
    for (const bool feed_forward : {true, false}) {
      for (unsigned seed = 11; seed < 11 + effort(); ++seed) {
        int substeps = kFewestSubsteps;
        while (!run_algorithm_trial({seed, algorithm, feed_forward}, substeps, picks)) {
          substeps *= 2;
          ASSERT_LE(substeps, 16 * kFewestSubsteps) << "seed " << seed;
        }
        if (HasFailure()) return;
      }
    }
  }
  EXPECT_GT(picks, 6 * static_cast<int>(effort()));
}

}  // namespace
}  // namespace takt::test

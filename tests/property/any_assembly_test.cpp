// Any assembly: random cells, random handling, and what must hold whatever happens. The verdicts of the
// simulation are compared with a second, slow answer; its motion with closed forms.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <tuple>
#include <utility>
#include <vector>

#include "server/simulation/simulation.h"
#include "tests/support/random_handling.h"

namespace takt::test {
namespace {

constexpr double kGravity = 9.80665;
constexpr double kStep_s = 0.001;
constexpr double kPole = 313.158;          // sqrt(g / 0.1 mm), 1/s: the double pole of every connection
constexpr double kUnclear_m = 1e-7;        // pairs so near the margin may be either
constexpr double kListingLimit = 20000.0;  // sequences per Part up to which all are listed
constexpr double kEuler = 2.718281828459;

Vec3 center_of_mass(const CellModel& model, const Snapshot& s, int id) {
  const ComponentSample& c = s.components[static_cast<std::size_t>(id)];
  return c.p_WB + c.q_WB * model.components[static_cast<std::size_t>(id)].p_BBcm;
}
Vec3 velocity_at(const Snapshot& s, int id, const Vec3& p_W) {
  const ComponentSample& c = s.components[static_cast<std::size_t>(id)];
  return c.V_WB.at(p_W - c.p_WB);
}

/// Partners by brute force, each time the simulation decides them.
class PartnerOracle {
 public:
  explicit PartnerOracle(const RandomCell& cell) : cell_(cell), model_(*cell.model()) {}

  /// `before`: the poses on which the step from it to `after` decided.
  void check(const Snapshot& before, const Snapshot& after) {
    std::vector<std::pair<int, int>> certain, unclear;
    overlaps(before, after, certain, unclear);
    if (certain != contacts_ || !unclear.empty() || graphs_.empty()) {
      contacts_ = certain;
      graphs_.assign(1, graph(certain));
      if (!unclear.empty()) {
        certain.insert(certain.end(), unclear.begin(), unclear.end());
        graphs_.push_back(graph(certain));
        contacts_.clear();
        ++unclear_steps;
      }
      counts_ = {};
      for (const ContactGraph& g : graphs_) counts_.push_back(count_sequences(g));
      answers_.clear();
    }
    for (const int part : cell_.parts) {
      const int found = after.components[static_cast<std::size_t>(part)].partner;
      const int present = before.components[static_cast<std::size_t>(part)].partner;
      bool right = false, listed = true;
      for (std::size_t i = 0; i < graphs_.size() && !right; ++i) {
        if (counts_[i][static_cast<std::size_t>(part)] > kListingLimit) {
          listed = false;
          continue;
        }
        const auto [entry, fresh] = answers_.try_emplace({i, part, present}, -1);
        if (fresh) entry->second = partner_by_listing(graphs_[i], part, present);
        right = entry->second == found;
      }
      ++(listed ? answers : unlisted);
      if (listed) {
        ASSERT_TRUE(right) << "Part " << part << " has partner " << found << " (before: " << present
                           << ") at step " << before.step;
      }
    }
  }
  bool touched(int part) const {
    for (const ContactGraph& g : graphs_) {
      if (!g.neighbours[static_cast<std::size_t>(part)].empty()) return true;
    }
    return false;
  }

  std::uint64_t answers = 0, unlisted = 0, unclear_steps = 0;

 private:
  void overlaps(const Snapshot& before, const Snapshot& after, std::vector<std::pair<int, int>>& certain,
                std::vector<std::pair<int, int>>& unclear) const {
    std::vector<std::pair<int, OrientedBox>> others;
    for (const int id : cell_.parts) others.emplace_back(id, cell_.box(before, id));
    const std::size_t parts = others.size();
    for (const int id : cell_.grounds) others.emplace_back(id, cell_.box(before, id));
    for (std::size_t g = 0; g < cell_.palms.size(); ++g) {
      if (after.grippers[g].closed) others.emplace_back(cell_.palms[g], cell_.grasp_volume(before, g));
    }
    for (std::size_t a = 0; a < parts; ++a) {
      for (std::size_t b = a + 1; b < others.size(); ++b) {
        const Nearness verdict =
            nearness(others[a].second, others[b].second, model_.interaction.contact_margin_m, kUnclear_m);
        if (verdict == Nearness::touching) certain.emplace_back(others[a].first, others[b].first);
        if (verdict == Nearness::unclear) unclear.emplace_back(others[a].first, others[b].first);
      }
    }
  }
  ContactGraph graph(const std::vector<std::pair<int, int>>& pairs) const {
    ContactGraph g(model_.components.size());
    for (std::size_t i = 0; i < g.vertices.size(); ++i) {
      g.vertices[i] = {model_.components[i].type, model_.components[i].hierarchy};
    }
    for (const auto& [a, b] : pairs) g.add_contact(a, b);
    g.sort_contacts();
    return g;
  }

  const RandomCell& cell_;
  const CellModel& model_;
  std::vector<std::pair<int, int>> contacts_;
  std::vector<ContactGraph> graphs_;
  std::vector<std::vector<double>> counts_;
  std::map<std::tuple<std::size_t, int, int>, int> answers_;
};

/// Where a held Part is, against where it was when its partner took it: no further off than a critically
/// damped spring allows for the speed at which it was caught and the acceleration of what holds it.
class HoldOracle {
 public:
  explicit HoldOracle(const RandomCell& cell)
      : cell_(cell), model_(*cell.model()), holds_(model_.components.size()) {}

  void check(const Snapshot& before, const Snapshot& after) {
    for (const int part : cell_.parts) {
      const int partner = after.components[static_cast<std::size_t>(part)].partner;
      Hold& hold = holds_[static_cast<std::size_t>(part)];
      if (partner < 0 || model_.components[static_cast<std::size_t>(partner)].type == ComponentType::part) {
        hold.partner = -1;
        continue;
      }
      const Vec3 p0 = center_of_mass(model_, before, part), p1 = center_of_mass(model_, after, part);
      const ComponentSample& t0 = before.components[static_cast<std::size_t>(partner)];
      const ComponentSample& t1 = after.components[static_cast<std::size_t>(partner)];
      const ComponentSample& b0 = before.components[static_cast<std::size_t>(part)];
      const ComponentSample& b1 = after.components[static_cast<std::size_t>(part)];
      if (hold.partner != partner) {
        hold = {};
        hold.partner = partner;
        hold.p_T = t0.q_WB.conjugate() * (p0 - t0.p_WB);
        hold.q_TB = t0.q_WB.conjugate() * b0.q_WB;
        hold.slip = (velocity_at(before, partner, p0) - velocity_at(before, part, p0)).norm();
        hold.turn = (t0.V_WB.w - b0.V_WB.w).norm();
        ++captures;
      }
      hold.acceleration =
          std::max(hold.acceleration,
                   (velocity_at(after, partner, p1) - velocity_at(before, partner, p0)).norm() / kStep_s);
      hold.spin = std::max(hold.spin, (t1.V_WB.w - t0.V_WB.w).norm() / kStep_s);
      // x'' + 2 w x' + w^2 x = a from x' = v: |x| <= v / (e w) + max |a| / w^2.
      const double allowed =
          1.1 * (hold.slip / (kEuler * kPole) + hold.acceleration / (kPole * kPole)) + 1e-7;
      const double allowed_angle = 1.1 * (hold.turn / (kEuler * kPole) + hold.spin / (kPole * kPole)) + 1e-6;
      const double off = (t1.q_WB * hold.p_T + t1.p_WB - p1).norm();
      const double angle = (t1.q_WB * hold.q_TB).angularDistance(b1.q_WB);
      worst = std::max(worst, off / allowed), worst_angle = std::max(worst_angle, angle / allowed_angle);
      ASSERT_LE(off, allowed) << "Part " << part << " in " << partner << " at step " << after.step
                              << ", caught at " << hold.slip << " m/s";
      ASSERT_LE(angle, allowed_angle) << "Part " << part << " in " << partner << " at step " << after.step
                                      << ", caught at " << hold.turn << " rad/s";
    }
  }

  double worst = 0.0, worst_angle = 0.0;
  std::uint64_t captures = 0;

 private:
  struct Hold {
    int partner = -1;
    Vec3 p_T = Vec3::Zero();
    Quat q_TB = Quat::Identity();
    double slip = 0.0, turn = 0.0, acceleration = 0.0, spin = 0.0;
  };
  const RandomCell& cell_;
  const CellModel& model_;
  std::vector<Hold> holds_;
};

/// A Part that nothing holds and that holds nothing falls on a parabola; a cube turns at a constant rate. An
/// assembly that nothing holds falls with its centre of mass on a parabola.
class FallOracle {
 public:
  explicit FallOracle(const RandomCell& cell)
      : cell_(cell), model_(*cell.model()), falls_(model_.components.size()) {}

  void check(const Snapshot& before, const Snapshot& after) {
    std::map<int, std::vector<int>> loose;  // by root: the Parts of an assembly that nothing holds
    for (const int part : cell_.parts) {
      const int partner = after.components[static_cast<std::size_t>(part)].partner;
      if (partner < 0) loose[part].push_back(part);
      if (partner >= 0 && model_.components[static_cast<std::size_t>(partner)].type == ComponentType::part) {
        loose[partner].push_back(part);
      }
    }
    for (const int part : cell_.parts) {
      const auto entry = loose.find(part);
      if (entry == loose.end() || entry->second.size() > 1) falls_[static_cast<std::size_t>(part)].steps = 0;
    }
    for (const auto& [root, assembly] : loose) {
      if (assembly.size() == 1) {
        check_part(root, before, after);
      } else {
        Vec3 change = Vec3::Zero();
        double mass = 0.0, speed = 0.0;
        for (const int part : assembly) {
          const double m = model_.components[static_cast<std::size_t>(part)].mass_kg;
          const Vec3 v0 = velocity_at(before, part, center_of_mass(model_, before, part));
          const Vec3 v1 = velocity_at(after, part, center_of_mass(model_, after, part));
          change += m * (v1 - v0), mass += m, speed = std::max(speed, v1.norm());
        }
        ASSERT_LE((change / mass + Vec3(0.0, 0.0, kGravity * kStep_s)).norm(), 1e-12 * (1.0 + speed))
            << "assembly of " << root << " at step " << after.step;
        ++assembly_steps;
        largest_assembly = std::max(largest_assembly, assembly.size());
      }
    }
  }

  std::uint64_t part_steps = 0, assembly_steps = 0;
  std::size_t largest_assembly = 0;

 private:
  struct Fall {
    std::uint64_t steps = 0;  ///< since it began
    Vec3 p, v, w;
    Quat q;
  };

  void check_part(int part, const Snapshot& before, const Snapshot& after) {
    Fall& fall = falls_[static_cast<std::size_t>(part)];
    const ComponentSample& b = before.components[static_cast<std::size_t>(part)];
    const ComponentSample& a = after.components[static_cast<std::size_t>(part)];
    if (fall.steps == 0) {
      fall.p = center_of_mass(model_, before, part);
      fall.v = velocity_at(before, part, fall.p);
      fall.w = b.V_WB.w, fall.q = b.q_WB;
    }
    ++fall.steps;
    ++part_steps;
    const double t = kStep_s * static_cast<double>(fall.steps);
    const Vec3 g(0.0, 0.0, -kGravity);
    const Vec3 p = center_of_mass(model_, after, part);
    ASSERT_LE((p - (fall.p + t * fall.v + 0.5 * t * t * g)).norm(), 1e-11 * (1.0 + p.norm()))
        << "Part " << part;
    ASSERT_LE((velocity_at(after, part, p) - (fall.v + t * g)).norm(), 1e-11 * (1.0 + fall.v.norm()));
    const Vec3& size = cell_.size(part);
    if (size.x() != size.y() || size.x() != size.z()) return;
    ASSERT_LE((a.V_WB.w - fall.w).norm(), 1e-11 * (1.0 + fall.w.norm()));
    // What order two leaves of a rotation: angle^3 / 12 per step.
    const double rate = fall.w.norm(), angle = rate * kStep_s;
    const Quat turned = rate > 0.0 ? Quat(Eigen::AngleAxisd(rate * t, fall.w / rate)) * fall.q : fall.q;
    ASSERT_LE(turned.angularDistance(a.q_WB),
              angle * angle * angle / 12.0 * static_cast<double>(fall.steps) + 1e-7);
  }

  const RandomCell& cell_;
  const CellModel& model_;
  std::vector<Fall> falls_;
};

/// Kinetic plus gravitational energy of all Parts, zero at rest on the floor (J).
double mechanical_energy(const RandomCell& cell, const Snapshot& s) {
  double energy = 0.0;
  for (const int part : cell.parts) {
    const Component& c = cell.model()->components[static_cast<std::size_t>(part)];
    const ComponentSample& sample = s.components[static_cast<std::size_t>(part)];
    const Vec3 p = center_of_mass(*cell.model(), s, part);
    const Vec3 w_B = sample.q_WB.conjugate() * sample.V_WB.w;
    energy += 0.5 * c.mass_kg * velocity_at(s, part, p).squaredNorm() + 0.5 * w_B.dot(c.I_BBcm_B * w_B) +
              c.mass_kg * kGravity * (p.z() - RandomCell::kFloor_m);
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
    for (const ConnectionChange& change : simulation.connection_changes()) {
      coverage.passed_on += (is_palm(change.from) && is_palm(change.to)) ? 1 : 0;
    }
    std::swap(before, after);
    simulation.read_snapshot(after);
    for (std::size_t g = 0; g < cell.palms.size(); ++g)
      ASSERT_EQ(after.grippers[g].closed, handling.closed(g));
    if (before.step % trial.every == 0) partners.check(before, after);
    if (!testing::Test::HasFatalFailure()) holds.check(before, after);
    if (!testing::Test::HasFatalFailure()) falls.check(before, after);
  };

  while (after.step < trial.busy_steps && !testing::Test::HasFatalFailure())
    advance(handling.commands(after));
  // All arms stop, some with something in hand; when no spring is under load any more, all hands open at
  // once.
  handling.abandon();
  for (int i = 0; i < 300 && !testing::Test::HasFatalFailure(); ++i) advance({});
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

  // The same commands, nobody looking: the same bits.
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

/// TAKT_TEST_TRIALS asks for more than the suite has time for.
unsigned trials() {
  const char* text = std::getenv("TAKT_TEST_TRIALS");
  return text != nullptr ? static_cast<unsigned>(std::max(10, std::atoi(text))) : 10U;
}

TEST(AnyAssembly, NoPartIsLostWhateverIsDoneToIt) {
  Coverage coverage;
  for (unsigned seed = 1; seed <= trials(); ++seed) {
    Trial trial;
    trial.cell.seed = seed;
    trial.cell.parts = 10 + 6 * static_cast<int>(seed % 11);
    trial.cell.grippers = 2 + static_cast<int>(seed % 3);
    trial.cell.tables = 1 + static_cast<int>(seed % 2);
    run_trial(trial, coverage);
    if (HasFatalFailure()) return;
  }
  // The trials did what they are for.
  EXPECT_GT(coverage.done.picks, 40);
  EXPECT_GT(coverage.done.handovers, 3);
  EXPECT_GT(coverage.done.on_tables, 5);
  EXPECT_GT(coverage.done.on_parts, 5);
  EXPECT_GT(coverage.done.drops, 3);
  EXPECT_GT(coverage.done.throws, 3);
  EXPECT_GT(coverage.part_steps, 1000U);
  EXPECT_GT(coverage.assembly_steps, 1000U);
  EXPECT_GT(coverage.passed_on, 3);
  EXPECT_GT(coverage.let_go, 5);
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

TEST(AnyAssembly, FiveHundredParts) {
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

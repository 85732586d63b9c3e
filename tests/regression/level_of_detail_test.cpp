// Changing the level of detail of the block scenario while it runs: nothing jumps, what follows is small, and
// the assembly ends where it always does.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <map>

#include "server/headless/in_process_controller.h"
#include "server/headless/report.h"
#include "tests/support/block_scenario_run.h"

namespace takt {
namespace {

struct Switch {
  double time_s;
  int level;
};

struct SwitchedRun {
  std::vector<ConnectionChange> changes;
  Snapshot end;
  double largest_jump_m = 0.0, largest_turn_rad = 0.0;  ///< of any component, at the instants of a switch
  double largest_speed_jump_m_per_s = 0.0;              ///< of a Part
  std::map<double, double> transient_m;  ///< by time of the switch: see transient_after()
  std::string fault;
};

/// What a switch upsets: within this time after it, how far any component is from where it is without it.
constexpr double kTransient_s = 0.5;

struct Block {
  Scenario scenario = read_scenario(std::filesystem::path(TAKT_CONFIG_DIR) / "scenarios/block_assembly.yaml");
  std::shared_ptr<const CellModel> cell = build_cell(scenario);
};
const Block& block() {
  static const Block given;
  return given;
}

/// Positions of all components after every step.
using Paths = std::vector<std::vector<Vec3>>;

double largest_distance(const Snapshot& a, const Snapshot& b) {
  double largest = 0.0;
  for (std::size_t i = 0; i < a.components.size(); ++i)
    largest = std::max(largest, (a.components[i].p_WB - b.components[i].p_WB).norm());
  return largest;
}

SwitchedRun run(const std::vector<Switch>& switches, int start_level, Paths* paths = nullptr,
                const Paths* without = nullptr) {
  SwitchedRun r;
  Simulation simulation(block().cell);
  EXPECT_EQ(simulation.set_level_of_detail(-1, start_level), "");
  InProcessController controller(block().scenario.controller_program.string(), simulation);
  Snapshot before = simulation.make_snapshot(), after = before;
  std::size_t next = 0;
  double latest_s = -kTransient_s;
  const auto steps = static_cast<std::uint64_t>(std::llround(block().scenario.duration_s / block().cell->step_s));
  while (simulation.step_index() < steps) {
    if (next < switches.size() && simulation.time_s() >= switches[next].time_s - 1e-9) {
      simulation.read_snapshot(before);
      EXPECT_EQ(simulation.set_level_of_detail(-1, switches[next].level), "");
      simulation.read_snapshot(after);
      r.largest_jump_m = std::max(r.largest_jump_m, largest_distance(before, after));
      for (std::size_t i = 0; i < before.components.size(); ++i) {
        const ComponentSample &a = before.components[i], &b = after.components[i];
        r.largest_turn_rad = std::max(r.largest_turn_rad, a.q_WB.angularDistance(b.q_WB));
        EXPECT_EQ(a.partner, b.partner);
        if (a.state != PartState::fixed)
          r.largest_speed_jump_m_per_s = std::max(r.largest_speed_jump_m_per_s, (a.V_WB.v - b.V_WB.v).norm());
      }
      latest_s = switches[next].time_s;
      ++next;
    }
    if (!simulation.step(controller.commands(simulation))) {
      r.fault = simulation.fault();
      return r;
    }
    for (const ConnectionChange& change : simulation.connection_changes()) r.changes.push_back(change);
    const bool watched = without != nullptr && simulation.time_s() < latest_s + kTransient_s;
    if (paths == nullptr && !watched) continue;
    simulation.read_snapshot(after);
    if (paths != nullptr) {
      std::vector<Vec3>& path = paths->emplace_back();
      for (const ComponentSample& c : after.components) path.push_back(c.p_WB);
    }
    if (watched) {
      const std::vector<Vec3>& path = (*without)[simulation.step_index() - 1];
      for (std::size_t i = 0; i < path.size(); ++i)
        r.transient_m[latest_s] = std::max(r.transient_m[latest_s], (after.components[i].p_WB - path[i]).norm());
    }
  }
  r.end = simulation.make_snapshot();
  return r;
}

TEST(LevelOfDetail, Explore) {
  Paths paths1, paths2;
  const SwitchedRun one = run({}, 1, &paths1);
  const SwitchedRun two = run({}, 2, &paths2);
  std::printf("fault %s / %s, changes %zu %zu\n", one.fault.c_str(), two.fault.c_str(), one.changes.size(), two.changes.size());
  double lag = 0, at = 0;
  for (std::size_t k = 0; k < paths1.size(); ++k)
    for (std::size_t i = 0; i < paths1[k].size(); ++i)
      if ((paths1[k][i] - paths2[k][i]).norm() > lag) { lag = (paths1[k][i] - paths2[k][i]).norm(); at = 1e-3 * double(k); }
  std::printf("lag %g at %g, end %g\n", lag, at, largest_distance(one.end, two.end));
  std::vector<Switch> s;
  for (double t : {0.0, 1.0, 3.9, 4.6, 6.0, 7.5, 9.95, 12.0, 17.0, 18.5, 21.0, 24.0, 31.5, 33.0, 35.0, 39.0, 41.0, 41.5})
    s.push_back({t, s.size() % 2 == 0 ? 2 : 1});
  const SwitchedRun mixed = run(s, 1, nullptr, &paths1);
  const SwitchedRun mixed2 = run(s, 1, nullptr, &paths2);
  std::printf("mixed fault %s jump %g turn %g speed %g end %g changes %zu\n", mixed.fault.c_str(), mixed.largest_jump_m, mixed.largest_turn_rad, mixed.largest_speed_jump_m_per_s, largest_distance(mixed.end, one.end), mixed.changes.size());
  for (const Switch& w : s) std::printf("%6.2f -> %d  from LoD1 %g m, from LoD2 %g m\n", w.time_s, w.level, mixed.transient_m.at(w.time_s), mixed2.transient_m.at(w.time_s));
}

}  // namespace
}  // namespace takt

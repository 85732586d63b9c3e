#pragma once
// Runs that save their state at some step, and runs that restore it beside them.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "server/simulation/model/cell_model.h"
#include "server/simulation/step/simulation.h"

namespace takt::test {

using StepCommands = std::vector<std::vector<Command>>;

inline void expect_same_snapshots(const Snapshot& a, const Snapshot& b) {
  ASSERT_EQ(a.step, b.step);
  ASSERT_EQ(a.time_s, b.time_s);
  ASSERT_EQ(a.state_hash, b.state_hash);
  for (std::size_t i = 0; i < a.components.size(); ++i) {
    const ComponentSample &x = a.components[i], &y = b.components[i];
    ASSERT_EQ(x.p_WB, y.p_WB) << i;
    ASSERT_EQ(x.q_WB.coeffs(), y.q_WB.coeffs()) << i;
    ASSERT_TRUE(x.V_WB == y.V_WB) << i;
    ASSERT_EQ(x.F_Bo_W.f, y.F_Bo_W.f) << i;
    ASSERT_EQ(x.F_Bo_W.t, y.F_Bo_W.t) << i;
    ASSERT_EQ(x.state, y.state) << i;
    ASSERT_EQ(x.partner, y.partner) << i;
  }
  for (std::size_t i = 0; i < a.robots.size(); ++i) {
    ASSERT_EQ(a.robots[i].position, b.robots[i].position);
    ASSERT_EQ(a.robots[i].velocity, b.robots[i].velocity);
    ASSERT_EQ(a.robots[i].effort, b.robots[i].effort);
    ASSERT_EQ(a.robots[i].level_of_detail, b.robots[i].level_of_detail);
    ASSERT_EQ(a.robots[i].power.electrical_energy_J, b.robots[i].power.electrical_energy_J);
    ASSERT_EQ(a.robots[i].commands_applied, b.robots[i].commands_applied);
    ASSERT_EQ(a.robots[i].newest_stamp, b.robots[i].newest_stamp);
  }
  for (std::size_t i = 0; i < a.grippers.size(); ++i) {
    ASSERT_EQ(a.grippers[i].width_m, b.grippers[i].width_m);
    ASSERT_EQ(a.grippers[i].force_N, b.grippers[i].force_N);
    ASSERT_EQ(a.grippers[i].closed, b.grippers[i].closed);
    ASSERT_EQ(a.grippers[i].moving, b.grippers[i].moving);
    ASSERT_EQ(a.grippers[i].in_position, b.grippers[i].in_position);
    ASSERT_EQ(a.grippers[i].part, b.grippers[i].part);
    ASSERT_EQ(a.grippers[i].commands_applied, b.grippers[i].commands_applied);
  }
  ASSERT_EQ(a.contacts.count, b.contacts.count);
  ASSERT_EQ(a.contacts.acting, b.contacts.acting);
}

inline void expect_same_changes(const Simulation& a, const Simulation& b) {
  const auto x = a.events().connection_changes, y = b.events().connection_changes;
  ASSERT_EQ(x.size(), y.size()) << "at step " << a.step_index();
  for (std::size_t i = 0; i < x.size(); ++i) {
    ASSERT_EQ(x[i].part, y[i].part);
    ASSERT_EQ(x[i].from, y[i].from);
    ASSERT_EQ(x[i].to, y[i].to);
  }
  const auto e = a.events().collision_events, f = b.events().collision_events;
  ASSERT_EQ(e.size(), f.size()) << "at step " << a.step_index();
  for (std::size_t i = 0; i < e.size(); ++i) {
    ASSERT_EQ(e[i].kind, f[i].kind);
    ASSERT_EQ(e[i].a, f[i].a);
    ASSERT_EQ(e[i].b, f[i].b);
    ASSERT_EQ(e[i].distance_m, f[i].distance_m);
    ASSERT_EQ(e[i].duration_s, f[i].duration_s);
  }
}

/// The run with these commands saves at some steps; then the same simulation and a new one restore each of
/// these states, and continue for `go_on` steps with the same commands: the same bits and the same reports.
inline void check_restored_runs(const std::shared_ptr<const CellModel>& model, const StepCommands& commands,
                                const std::vector<std::size_t>& save_at, std::size_t go_on,
                                const std::function<void(Simulation&)>& prepare = {}) {
  Simulation run(model);
  if (prepare) prepare(run);
  std::vector<std::vector<std::byte>> saved(save_at.size());
  std::vector<std::uint64_t> hashes;
  std::vector<Snapshot> seen;  // at the end of each stretch, and where it begins
  for (std::size_t i = 0; i < commands.size(); ++i) {
    for (std::size_t k = 0; k < save_at.size(); ++k) {
      if (save_at[k] == i) {
        run.save_state(saved[k]);
        seen.push_back(run.make_snapshot());
      }
    }
    ASSERT_TRUE(run.step(commands[i])) << run.fault();
    hashes.push_back(run.state_hash());
  }
  for (std::size_t k = 0; k < save_at.size(); ++k) {
    Simulation fresh(model);
    const std::uint32_t epoch = run.epoch();
    ASSERT_EQ(run.restore_state(saved[k]), "");
    ASSERT_EQ(fresh.restore_state(saved[k]), "");
    EXPECT_GT(run.epoch(), epoch);
    expect_same_snapshots(run.make_snapshot(), seen[k]);
    expect_same_snapshots(fresh.make_snapshot(), seen[k]);
    const std::size_t end = std::min(commands.size(), save_at[k] + go_on);
    std::vector<std::byte> unused;
    for (std::size_t i = save_at[k]; i < end; ++i) {
      // Saving may restart a solver, so these runs save at the same steps as the first.
      if (i > save_at[k] && std::find(save_at.begin(), save_at.end(), i) != save_at.end()) {
        run.save_state(unused);
        fresh.save_state(unused);
      }
      ASSERT_TRUE(run.step(commands[i])) << run.fault();
      ASSERT_TRUE(fresh.step(commands[i])) << fresh.fault();
      ASSERT_EQ(run.state_hash(), hashes[i]) << "saved at " << save_at[k] << ", step " << i;
      ASSERT_EQ(fresh.state_hash(), hashes[i]) << "saved at " << save_at[k] << ", step " << i;
      expect_same_changes(run, fresh);
    }
    expect_same_snapshots(run.make_snapshot(), fresh.make_snapshot());
  }
}

}  // namespace takt::test

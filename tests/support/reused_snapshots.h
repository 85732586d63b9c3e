#pragma once
// Snapshots that are read again and again, some seldom, beside the only one of a simulation that was restored from the same
// state.
#include <gtest/gtest.h>

#include <array>
#include <functional>
#include <memory>
#include <vector>

#include "tests/support/device_cell.h"
#include "tests/support/snapshot_bits.h"

namespace takt::test {

inline void expect_no_traces_of_earlier_samples(const std::shared_ptr<const CellModel>& model, double seconds,
                                                const std::function<void(DeviceCell&)>& before_step) {
  constexpr std::array<int, 3> kIntervals{1, 9, 45};
  DeviceCell cell(model);
  Simulation& simulation = cell.simulation();
  std::vector<Snapshot> snapshots(kIntervals.size(), simulation.make_snapshot());
  std::vector<std::byte> state;
  const int steps = static_cast<int>(seconds / cell.description().step_s);
  for (int step = 0; step < steps; ++step) {
    before_step(cell);
    ASSERT_TRUE(cell.step());
    for (std::size_t i = 0; i < snapshots.size(); ++i) {
      if (step % kIntervals[i] != 0) continue;
      simulation.read_snapshot(snapshots[i]);
      if (step % kIntervals.back() != 0) continue;
      ASSERT_EQ(simulation.save_state(state), "");
      Simulation restored(model);
      ASSERT_EQ(restored.restore_state(state), "");
      ASSERT_NO_FATAL_FAILURE(expect_same_bits(snapshots[i], restored.make_snapshot()))
          << "read each " << kIntervals[i] << " steps";
    }
  }
}

}  // namespace takt::test

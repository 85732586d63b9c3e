#pragma once
// States of the simulation saved between two steps: by request, and periodically for another thread that
// writes them to the disk.
#include <cstdint>
#include <string>
#include <vector>

#include "idl/common/triple_buffer.h"
#include "server/runtime/auto_reset_event.h"
#include "server/runtime/loop/loop_context.h"
#include "server/runtime/recording/snapshot_file.h"

namespace takt {

/// The state of the simulation between two steps, and of its loop.
struct SavedState {
  std::vector<std::byte> bytes;  ///< of Simulation::save_state()
  SnapshotIdentity identity;
  SimulationState state{};
  Pace pace{};
  double factor = 1.0;
};

class PeriodicSaver {
 public:
  /// `every_s`: wall time; 0: never. The context outlives it.
  PeriodicSaver(LoopContext& loop, double every_s);

  /// The newest periodic state; for one thread, which is woken by news().
  TripleBuffer<SavedState>& saved() { return saved_; }
  AutoResetEvent& news() { return news_; }

  // The following functions are for the loop's thread, or any thread ahead of its start.

  /// Empty on success, else the reason why the state cannot be saved (Simulation::save_state).
  std::string save(SavedState& saved);
  /// After a change of the simulation: the next state is saved.
  void note_change() { changed_ = true; }
  void save_if_due();

 private:
  LoopContext& loop_;
  const double every_s_;
  TripleBuffer<SavedState> saved_;
  AutoResetEvent news_;
  SnapshotIdentity identity_;  ///< of this cell; step and time change
  bool changed_ = true;
  bool refused_ = false;  ///< the newest one
  std::int64_t due_ns_ = 0;
};

}  // namespace takt

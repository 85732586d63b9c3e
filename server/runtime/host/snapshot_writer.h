#pragma once
// Writes the states that a loop saves periodically (RunLoopOptions::save_every_s) to the disk, in a thread of
// its own: the loop uses no files. A failed write costs an event; the next state is a new attempt.
#include <atomic>
#include <thread>

#include "server/runtime/loop/run_loop.h"
#include "server/runtime/recording/session_store.h"

namespace takt {

class SnapshotWriter {
 public:
  /// `session`: source and changes of the loop's cell. All must outlive this.
  SnapshotWriter(RunLoop& loop, SessionStore& store, Session session);
  /// Writes the remaining state. The loop must have ended, or never started.
  ~SnapshotWriter();
  SnapshotWriter(const SnapshotWriter&) = delete;
  SnapshotWriter& operator=(const SnapshotWriter&) = delete;

 private:
  void run();
  void write_newest();

  RunLoop& loop_;
  SessionStore& store_;
  Session session_;
  bool failing_ = false;
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

}  // namespace takt

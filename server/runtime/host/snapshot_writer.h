#pragma once
// Writes the states that a loop saves now and then (RunLoopOptions::save_every_s) to the disk, in a thread of
// its own: the loop knows no file. A disk that refuses costs an event, and is tried again with the next
// state.
#include <atomic>
#include <thread>

#include "server/runtime/loop/run_loop.h"
#include "server/runtime/recording/session_store.h"

namespace takt {

class SnapshotWriter {
 public:
  /// `session`: source and changes of the loop's cell. All must outlive this.
  SnapshotWriter(RunLoop& loop, SessionStore& store, Session session);
  /// Writes what is left. The loop must have ended, or never begun.
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

#pragma once
// Records changes of the simulation to a file (command_log.h).
//
// The step loop only appends to a preallocated ring: no allocation, lock or system call in the step's path. A
// thread writes. A failing disk, or one that is slower than the ring is large, ends the recording and is
// reported within a second; the simulation continues.
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <mutex>
#include <span>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "idl/common/byte_ring.h"
#include "server/runtime/auto_reset_event.h"
#include "server/runtime/recording/command_log.h"

namespace takt {

class Simulation;

struct RecorderOptions {
  std::string version, cell;     ///< of the server
  bool replace = false;          ///< an existing file; else it is an error
  std::size_t ring = 8U << 20U;  ///< bytes that may wait to be written
  /// Steps between checkpoints, at most kMaxTrail.
  std::size_t checkpoint_every = kMaxTrail;
  /// Called once, from the writing thread, with a sentence, if the recording has ended early.
  std::function<void(const std::string&)> on_failure{};
};

class LogRecorder {
 public:
  /// Opens the file. Throws LogError.
  LogRecorder(std::filesystem::path file, RecorderOptions options);
  /// Writes the waiting records. No thread may append any more.
  ~LogRecorder();
  LogRecorder(const LogRecorder&) = delete;
  LogRecorder& operator=(const LogRecorder&) = delete;

  const std::filesystem::path& file() const { return file_; }
  /// Number of accepted records, and of bytes on the disk.
  std::uint64_t records() const { return records_.load(std::memory_order_relaxed); }
  std::uint64_t written_bytes() const { return written_.load(std::memory_order_relaxed); }
  bool failed() const { return failed_.load(std::memory_order_acquire); }
  /// Why; empty: it has not failed.
  std::string failure() const;
  /// Waits until all accepted records are on the disk, or the recording has failed. Not for the loop.
  void flush();

  // From here on: one thread at a time, the step loop's while it runs.

  /// Starts a scenario. `at_its_beginning`: it is as loaded; else its state is recorded too, which may
  /// restart its solver. Allocates. Empty on success, else the reason why the state cannot be recorded
  /// (Simulation::save_state).
  std::string begin_scenario(LogScenario logged, Simulation& simulation, bool at_its_beginning);
  /// A change of the simulation ahead of this step.
  template <typename Record>
  void note(std::uint64_t step, const Record& record) {
    ring_.begin();
    encode(ring_, step, record);
    commit();
  }
  /// Ahead of every step: whether deadlines count in it. Only changes are recorded.
  void deadlines(const Simulation& simulation, bool count);
  /// Ahead of the step that begins with these commands.
  void commands(const Simulation& simulation, std::span<const Command> batch);
  /// After a step was taken.
  void stepped(const Simulation& simulation);
  /// Call it ahead of reset() and restore_state(), which change the contents of a checkpoint.
  void checkpoint(const Simulation& simulation);
  /// `step`: the step after the restored state. Allocates.
  void restored(std::uint64_t step, std::span<const std::byte> state);
  void end_scenario(const Simulation& simulation);

 private:
  void commit();
  std::uint64_t keep_state(std::span<const std::byte> state);

  void run();
  void write_waiting();
  template <typename Record>
  void frame(const Record& record);
  void write_out();
  void fail(const std::string& why);

  std::filesystem::path file_;
  RecorderOptions options_;
  ByteRing ring_;
  std::atomic<std::uint64_t> records_{0}, written_{0};
  std::atomic<bool> overflowed_{false}, failed_{false}, stop_{false};
  LogCheckpoint checkpoint_;    // producer; the next one
  std::uint64_t states_ = 0;    // producer
  int deadlines_watched_ = -1;  // producer; -1: not recorded in this scenario yet
  mutable std::mutex mutex_;
  std::vector<LogState> waiting_states_;  // guarded by mutex_
  std::string failure_;                   // guarded by mutex_

  // The writing thread only.
  int fd_ = -1;
  LogFraming framing_;
  std::vector<std::byte> record_, out_;
  std::atomic<std::uint64_t> flushes_wanted_{0}, flushes_done_{0};
  AutoResetEvent news_;
  std::thread thread_;
};

}  // namespace takt

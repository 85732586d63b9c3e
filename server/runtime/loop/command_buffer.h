#pragma once
// Buffer of commands for the step loop. Adapter threads append one command at a time; the loop takes all of
// them at once. The only coupling between the threads is a mutex held for the length of a push or a swap.
#include <algorithm>
#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <mutex>
#include <optional>
#include <span>
#include <vector>

#include "idl/common/lockstep.h"
#include "server/runtime/requests/motion_goal.h"
#include "server/simulation/model/cell_description.h"
#include "server/simulation/model/command.h"

namespace takt {

SimTime stamp_of(const Command& command);

struct ReceivedCommand {
  Command command;
  int target = -1;               ///< target_of() the command
  std::uint64_t sender = 0;      ///< identifies the sender within this run of the server
  std::int64_t received_ns = 0;  ///< monotonic clock, when the adapter took it off the wire
  GoalPtr goal{};                ///< that the command serves, or nullptr
};

class CommandBuffer {
 public:
  static constexpr std::size_t kDefaultCapacity = 1024;

  /// `cell` must outlive the buffer; it supplies the number of targets and their names in messages.
  explicit CommandBuffer(const CellDescription& cell, std::size_t capacity = kDefaultCapacity);

  /// Any thread. Stores the command for the loop, or returns the reason of a refusal:
  /// - stale: its stamp is older than the newest accepted one of the same robot or gripper and the same
  ///   sender. A stamp from the future (a foreign clock, a forged command) does not make commands with the present or
  ///   an earlier stamp stale, nor the second of two later ones in order. In lockstep one of the sender's last kMostLookahead
  ///   stamps again is no fault either: a controller repeats its answers, and the loop passes over those it has.
  /// - malformed: the buffer is full, because the loop has not run for that many commands.
  /// `wake`: whether the loop has reason to look, see expect().
  std::optional<Rejection> append(const Command& command, std::uint64_t sender, std::int64_t received_ns,
                                  bool* wake = nullptr, GoalPtr goal = nullptr);

  /// Loop thread, ahead of a wait in lockstep: commands with this stamp are missing for these targets. Until the next
  /// take_all() each of them but the last gives no reason to wake the loop, nor do commands with later stamps.
  void expect(SimTime stamp, std::span<const int> missing);

  /// Loop thread. Replaces the contents of `out` by all commands since the last call, in the order of
  /// arrival. Does not allocate as long as `out` keeps the storage given to it here. `may_wait` false: if
  /// another thread is appending at that time, `out` becomes empty, and the next call returns all commands.
  /// So a thread that lost its processor during an append does not delay a loop in real time.
  void take_all(std::vector<ReceivedCommand>& out, bool may_wait = true);

  /// Loop thread: the present simulated time, for the rule about stamps.
  SimTime present() const { return {present_ns_.load(std::memory_order_relaxed)}; }
  void set_present(SimTime present) { present_ns_.store(present.ns, std::memory_order_relaxed); }
  /// Loop thread: whether the cell is in lockstep, likewise.
  void set_lockstep(bool lockstep) { lockstep_.store(lockstep, std::memory_order_relaxed); }

  /// Loop thread, on a reset: discards waiting commands and the newest stamps.
  void forget();

  std::size_t capacity() const { return capacity_; }

 private:
  struct Target {
    bool has_accepted(SimTime stamp) const {
      return std::ranges::find(last_stamps, stamp) != last_stamps.end();
    }

    SimTime newest_stamp;
    std::array<SimTime, kMostLookahead> last_stamps{};  ///< that were accepted from the sender: a ring
    std::size_t next = 0;                               ///< place in the ring
    SimTime
        older_stamp;  ///< of the sender's last command, where it was refused for a newest stamp in the future
    std::uint64_t sender = 0;
  };

  const CellDescription& cell_;
  const std::size_t capacity_;
  std::atomic<std::int64_t> present_ns_{0};
  std::atomic<bool> lockstep_{false};
  std::atomic<bool> empty_{true};
  std::mutex mutex_;
  std::vector<ReceivedCommand> waiting_;  // guarded by mutex_
  std::vector<Target> targets_;           // guarded by mutex_; see target_of()
  SimTime expected_stamp_;                // guarded by mutex_, as the next two
  std::vector<bool> missing_;             // by target
  std::size_t missing_count_ = 0;
};

}  // namespace takt

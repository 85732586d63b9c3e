#pragma once
// Where commands wait for the step loop. Adapter threads append one command at a time; the loop takes
// everything that has come in since. A mutex held for the length of a push or a swap is all the coupling
// there is between them.
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <mutex>
#include <optional>
#include <vector>

#include "server/simulation/model/cell_description.h"
#include "server/simulation/model/command.h"

namespace takt {

SimTime stamp_of(const Command& command);

struct ReceivedCommand {
  Command command;
  int target = -1;               ///< target_of() the command
  std::uint64_t sender = 0;      ///< identifies the sender within this run of the server
  std::int64_t received_ns = 0;  ///< monotonic clock, when the adapter took it off the wire
};

class CommandBuffer {
 public:
  static constexpr std::size_t kDefaultCapacity = 1024;

  /// `cell` must outlive the buffer; it supplies the number of targets and their names in messages.
  explicit CommandBuffer(const CellDescription& cell, std::size_t capacity = kDefaultCapacity);

  /// Any thread. Keeps the command for the loop, or says why not:
  /// - stale: its stamp is older than the newest accepted one of the same robot or gripper and the same
  /// sender. A stamp
  ///   from the future (a foreign clock) does not make stale what is stamped with the present or before.
  /// - malformed: the buffer is full, because the loop has not run for that many commands.
  std::optional<Rejection> append(const Command& command, std::uint64_t sender, std::int64_t received_ns);

  /// Loop thread. Replaces the contents of `out` by all commands since the last call, in the order of
  /// arrival. Does not allocate as long as `out` keeps the storage it was given here. `may_wait` false: when
  /// another thread is just appending, nothing is taken, and the next call takes it all. So a loop in real
  /// time is not held up by a thread that lost its processor half-way.
  void take_all(std::vector<ReceivedCommand>& out, bool may_wait = true);

  /// Loop thread: the present simulated time, for the rule about stamps.
  void set_present(SimTime present) { present_ns_.store(present.ns, std::memory_order_relaxed); }

  /// Loop thread, on a reset: forgets what waits and what was the newest stamp.
  void forget();

  std::size_t capacity() const { return capacity_; }

 private:
  struct Target {
    SimTime newest_stamp;
    std::uint64_t sender = 0;
  };

  const CellDescription& cell_;
  const std::size_t capacity_;
  std::atomic<std::int64_t> present_ns_{0};
  std::atomic<bool> empty_{true};
  std::mutex mutex_;
  std::vector<ReceivedCommand> waiting_;  // guarded by mutex_
  std::vector<Target> targets_;           // guarded by mutex_; see target_of()
};

}  // namespace takt

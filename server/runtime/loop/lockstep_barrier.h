#pragma once
// Lockstep: the boundaries of the registered controllers (controller_registry.h), and the wait at them.
//
// At a step that is a boundary of a controller the loop waits until every target of that controller has a
// command stamped with that step's time, to the nanosecond. While a robot follows a trajectory, its
// controller has no commands to send for it. An event reports a late controller; after its time-out the
// simulation pauses.
#include <array>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "idl/common/fixed_string.h"
#include "server/runtime/loop/command_buffer.h"
#include "server/runtime/loop/controller_registry.h"
#include "server/runtime/loop/loop_context.h"

namespace takt {

class LockstepBarrier {
 public:
  /// The status shows waits of at least this length at once (wall time).
  static constexpr std::int64_t kWaitInStatus_ns = 20'000'000;

  explicit LockstepBarrier(LoopContext& loop);

  ControllerRegistry& controllers() { return controllers_; }
  const ControllerRegistry& controllers() const { return controllers_; }

  /// In lockstep: whether a command may wait for its boundary. A refused one is reported in an event and
  /// counted, unless it answers a state that was sent twice, also behind the end of its controller. `known_sender`: its
  /// sender's was the last command admitted for the target. `may_repeat`: of what it answered ahead of a reset.
  bool admits(const ReceivedCommand& received, bool known_sender, bool may_repeat);
  /// At any pace: the boundary of the target's controller that the stamp names, if it lies ahead of the next one, within
  /// the lookahead.
  std::optional<std::uint64_t> boundary_ahead(const ReceivedCommand& received) const;
  /// At the boundary of a command that was sent ahead: whether its robot follows a trajectory. The command is then refused,
  /// as admits() does.
  bool refuses_beside_trajectory(const ReceivedCommand& received);
  std::uint64_t refused() const { return refused_; }

  struct Verdict {
    bool open = true;                       ///< all commands are present: the step may be taken
    bool news_for_status = false;           ///< the wait has just become long
    std::optional<events::OfLoop> timeout;  ///< the last time-out, for the pause; earlier ones are emitted
  };
  /// In lockstep, ahead of a step; `has_command` of a target. `single_step`: a step without controllers.
  Verdict check(const std::function<bool(int target)>& has_command, bool single_step);
  /// The targets whose commands the present step lacks, in `out`.
  void missing(const std::function<bool(int target)>& has_command, std::vector<int>& out) const;
  /// Whether the present step is a boundary of a controller that has not sent all its commands for it. Those of robots that
  /// follow trajectories count too: the controller waits for the instant all the same.
  bool is_waited_for(const std::function<bool(int target)>& has_command) const;
  /// The step was taken: its boundaries are crossed.
  void crossed(std::uint64_t step);
  /// Ends the wait; the next one starts at zero.
  void stop_waiting() { wait_began_ns_ = 0; }
  /// Names of the controllers that are waited for.
  std::span<const FixedString<128>> waiting_for() const { return {waiting_for_.data(), waiting_count_}; }
  void clear_waiting_for() { waiting_count_ = 0; }

 private:
  bool covered_by_trajectory(int target, double time_s) const;
  /// Reports a late controller; returns the event of its time-out when that has passed.
  std::optional<events::OfLoop> wait_for(ControllerRegistry::Controller& controller, int missing_target,
                                         Verdict& verdict);
  void name(std::string_view controller) { waiting_for_[waiting_count_++].assign(controller); }

  LoopContext& loop_;
  ControllerRegistry controllers_;
  std::int64_t wait_began_ns_ = 0;  ///< at the present boundary; 0: no wait
  bool wait_in_status_ = false;
  std::array<FixedString<128>, ControllerRegistry::kMaxControllers> waiting_for_;
  std::size_t waiting_count_ = 0;
  std::uint64_t refused_ = 0;
};

}  // namespace takt

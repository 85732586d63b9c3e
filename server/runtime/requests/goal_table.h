#pragma once
// The goals of one action as ROS 2 counts them: identities, states, cancellation and expiry. Without transport and
// without clock; what a goal does is not known here. Source: ROS 2 rcl_action (goal_state_machine.c, action_server.c).
#include <array>
#include <cstdint>
#include <optional>
#include <vector>

namespace takt {

using GoalId = std::array<std::uint8_t, 16>;

/// Numbers of action_msgs/msg/GoalStatus.
enum class GoalState : std::int8_t {
  unknown = 0,
  accepted = 1,
  executing = 2,
  canceling = 3,
  succeeded = 4,
  canceled = 5,
  aborted = 6,
};
inline bool is_end(GoalState state) {
  return state >= GoalState::succeeded;
}

/// Numbers of action_msgs/srv/CancelGoal.
enum class CancelCode : std::int8_t { ok = 0, rejected = 1, unknown_goal = 2, terminated = 3 };

class GoalTable {
 public:
  /// How long the result of an ended goal is kept: the default of ROS 2.
  static constexpr std::int64_t kKept_ns = 10'000'000'000;
  /// Most goals of an action at a time, running and ended ones.
  static constexpr std::size_t kMaxGoals = 1000;

  struct Goal {
    GoalId id{};
    std::int64_t stamp_ns = 0;  ///< when it was accepted
    GoalState state = GoalState::accepted;
    std::uint64_t number = 0;   ///< of the server, never used twice
    std::int64_t ended_ns = 0;  ///< on the caller's clock of expire()
  };

  /// The goal is new in state accepted. False, without effect, if the id is known already or there are kMaxGoals.
  bool accept(const GoalId& id, std::int64_t stamp_ns, std::uint64_t number);
  /// Undoes accept(): the goal was refused after all.
  void withdraw(std::uint64_t number);
  /// Changes the state along the permitted transitions: accepted -> executing | canceling, executing -> canceling |
  /// succeeded | aborted, canceling -> succeeded | aborted | canceled. An accepted goal that ends goes through
  /// executing. False, without effect, for any other change.
  bool change(std::uint64_t number, GoalState state, std::int64_t now_ns);

  struct Cancellation {
    CancelCode code = CancelCode::ok;
    std::vector<Goal> goals;  ///< that can be cancelled and are meant, in the order of acceptance
  };
  /// Which goals a request means: without id and stamp all; with a stamp those accepted at or before it; with an id
  /// that one; with both, both. The states stay.
  Cancellation find_cancelled(const GoalId& id, std::int64_t stamp_ns) const;

  const Goal* find(const GoalId& id) const;
  const Goal* find(std::uint64_t number) const;
  /// In the order of acceptance.
  const std::vector<Goal>& goals() const { return goals_; }
  std::size_t running() const;

  /// Forgets goals that ended kKept_ns ago and returns them.
  std::vector<Goal> expire(std::int64_t now_ns);
  /// Wall time at which the next goal expires, or std::nullopt.
  std::optional<std::int64_t> next_expiry_ns() const;

 private:
  std::vector<Goal> goals_;
};

}  // namespace takt

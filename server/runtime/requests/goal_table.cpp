#include "server/runtime/requests/goal_table.h"

#include <algorithm>

namespace takt {
namespace {

bool permitted(GoalState from, GoalState to) {
  switch (from) {
    case GoalState::accepted:
      return to != GoalState::unknown && to != GoalState::accepted && to != GoalState::canceled;
    case GoalState::executing:
      return to == GoalState::canceling || to == GoalState::succeeded || to == GoalState::aborted;
    case GoalState::canceling:
      return is_end(to);
    default:
      return false;
  }
}

bool can_be_cancelled(const GoalTable::Goal& goal) {
  return goal.state == GoalState::accepted || goal.state == GoalState::executing;
}

}  // namespace

bool GoalTable::accept(const GoalId& id, std::int64_t stamp_ns, std::uint64_t number) {
  if (find(id) != nullptr || goals_.size() >= kMaxGoals) return false;
  goals_.push_back({id, stamp_ns, GoalState::accepted, number, 0});
  return true;
}

void GoalTable::withdraw(std::uint64_t number) {
  std::erase_if(goals_, [&](const Goal& goal) { return goal.number == number; });
}

bool GoalTable::change(std::uint64_t number, GoalState state, std::int64_t now_ns) {
  const auto goal =
      std::find_if(goals_.begin(), goals_.end(), [&](const Goal& each) { return each.number == number; });
  if (goal == goals_.end() || !permitted(goal->state, state)) return false;
  goal->state = state;
  if (is_end(state)) goal->ended_ns = now_ns;
  return true;
}

GoalTable::Cancellation GoalTable::find_cancelled(const GoalId& id, std::int64_t stamp_ns) const {
  const bool one = id != GoalId{};
  Cancellation found;
  if (one && stamp_ns == 0) {
    const Goal* goal = find(id);
    if (goal == nullptr) {
      found.code = CancelCode::unknown_goal;
    } else if (!can_be_cancelled(*goal)) {
      found.code = CancelCode::terminated;
    } else {
      found.goals.push_back(*goal);
    }
    return found;
  }
  for (const Goal& goal : goals_) {
    const bool meant =
        (stamp_ns == 0 && !one) || (stamp_ns != 0 && goal.stamp_ns <= stamp_ns) || goal.id == id;
    if (meant && can_be_cancelled(goal)) found.goals.push_back(goal);
  }
  return found;
}

const GoalTable::Goal* GoalTable::find(const GoalId& id) const {
  const auto goal =
      std::find_if(goals_.begin(), goals_.end(), [&](const Goal& each) { return each.id == id; });
  return goal == goals_.end() ? nullptr : &*goal;
}

const GoalTable::Goal* GoalTable::find(std::uint64_t number) const {
  const auto goal =
      std::find_if(goals_.begin(), goals_.end(), [&](const Goal& each) { return each.number == number; });
  return goal == goals_.end() ? nullptr : &*goal;
}

std::size_t GoalTable::running() const {
  return static_cast<std::size_t>(
      std::count_if(goals_.begin(), goals_.end(), [](const Goal& goal) { return !is_end(goal.state); }));
}

std::vector<GoalTable::Goal> GoalTable::expire(std::int64_t now_ns) {
  std::vector<Goal> gone;
  std::erase_if(goals_, [&](const Goal& goal) {
    const bool old = is_end(goal.state) && now_ns - goal.ended_ns >= kKept_ns;
    if (old) gone.push_back(goal);
    return old;
  });
  return gone;
}

std::optional<std::int64_t> GoalTable::next_expiry_ns() const {
  std::optional<std::int64_t> next;
  for (const Goal& goal : goals_)
    if (is_end(goal.state)) next = std::min(next.value_or(INT64_MAX), goal.ended_ns + kKept_ns);
  return next;
}

}  // namespace takt

// Goals of an action against the rules of ROS 2: rcl_action (goal_state_machine.c, action_server.c).
#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <utility>

#include "server/runtime/requests/goal_table.h"

namespace takt {
namespace {

using State = GoalState;
constexpr std::int64_t kOneSecond_ns = 1'000'000'000;

GoalId id(std::uint8_t number) {
  GoalId made{};
  made[15] = number;
  return made;
}

/// Brings goal 1 from acceptance to the state, along a permitted way.
GoalTable at(State state) {
  GoalTable table;
  EXPECT_TRUE(table.accept(id(1), 5, 1));
  if (state == State::accepted) return table;
  EXPECT_TRUE(table.change(1, State::executing, 0));
  if (state == State::canceled) {
    EXPECT_TRUE(table.change(1, State::canceling, 0));
  }
  if (state != State::executing) {
    EXPECT_TRUE(table.change(1, state, 7));
  }
  EXPECT_EQ(table.find(std::uint64_t{1})->state, state);
  return table;
}

/// The transitions of the design document of ROS 2; a goal that ends right after its acceptance goes through executing.
TEST(GoalTable, AGoalChangesAlongThePermittedTransitionsOnly) {
  const std::set<std::pair<State, State>> permitted{
      {State::accepted, State::executing},  {State::accepted, State::canceling},
      {State::accepted, State::succeeded},  {State::accepted, State::aborted},
      {State::executing, State::canceling}, {State::executing, State::succeeded},
      {State::executing, State::aborted},   {State::canceling, State::succeeded},
      {State::canceling, State::aborted},   {State::canceling, State::canceled},
  };
  for (int from = 1; from <= 6; ++from)
    for (int to = 0; to <= 6; ++to) {
      GoalTable table = at(static_cast<State>(from));
      const bool expected = permitted.contains({static_cast<State>(from), static_cast<State>(to)});
      EXPECT_EQ(table.change(1, static_cast<State>(to), 9), expected) << from << " to " << to;
      EXPECT_EQ(table.find(id(1))->state, static_cast<State>(expected ? to : from));
    }
  GoalTable empty;
  EXPECT_FALSE(empty.change(1, State::executing, 0));
}

TEST(GoalTable, AKnownIdIsRefusedUntilItsGoalIsForgotten) {
  GoalTable table;
  EXPECT_TRUE(table.accept(id(1), 5, 1));
  EXPECT_FALSE(table.accept(id(1), 6, 2));
  EXPECT_TRUE(table.change(1, State::succeeded, 3 * kOneSecond_ns));
  EXPECT_FALSE(table.accept(id(1), 7, 3));
  EXPECT_EQ(table.next_expiry_ns(), 13 * kOneSecond_ns);
  EXPECT_TRUE(table.expire(13 * kOneSecond_ns - 1).empty());
  ASSERT_EQ(table.expire(13 * kOneSecond_ns).size(), 1U);
  EXPECT_EQ(table.find(id(1)), nullptr);
  EXPECT_TRUE(table.accept(id(1), 8, 4));
  EXPECT_TRUE(table.expire(100 * kOneSecond_ns).empty()) << "a goal that runs stays";
}

TEST(GoalTable, TheNumberOfGoalsIsBounded) {
  GoalTable table;
  for (std::uint64_t i = 1; i <= GoalTable::kMaxGoals; ++i) {
    GoalId made{};
    made[0] = static_cast<std::uint8_t>(i), made[1] = static_cast<std::uint8_t>(i >> 8U);
    ASSERT_TRUE(table.accept(made, 0, i));
  }
  EXPECT_FALSE(table.accept(id(1), 0, 0));
}

/// Five goals in each state, accepted at 1 s to 5 s; those in accepted and executing can be cancelled.
TEST(GoalTable, ACancellationMeansOneGoalOrThoseUpToATimeOrBothOrAll) {
  for (int state = 1; state <= 6; ++state) {
    const bool possible = state <= 2;
    GoalTable table;
    for (std::uint8_t i = 1; i <= 5; ++i) {
      ASSERT_TRUE(table.accept(id(i), i * kOneSecond_ns, i));
      if (state == 1) continue;
      ASSERT_TRUE(table.change(i, State::executing, 0));
      if (state == 5) {
        ASSERT_TRUE(table.change(i, State::canceling, 0));
      }
      if (state > 2) {
        ASSERT_TRUE(table.change(i, static_cast<State>(state), 0));
      }
    }
    const auto numbers = [&](const GoalId& of, std::int64_t stamp_ns) {
      std::vector<std::uint64_t> found;
      for (const auto& goal : table.find_cancelled(of, stamp_ns).goals) found.push_back(goal.number);
      return found;
    };
    const auto code = [&](const GoalId& of, std::int64_t stamp_ns) {
      return table.find_cancelled(of, stamp_ns).code;
    };
    using Numbers = std::vector<std::uint64_t>;
    const auto if_possible = [&](Numbers wanted) { return possible ? wanted : Numbers{}; };
    EXPECT_EQ(numbers({}, 0), if_possible({1, 2, 3, 4, 5})) << state;
    EXPECT_EQ(numbers({}, 3 * kOneSecond_ns), if_possible({1, 2, 3})) << state;
    EXPECT_EQ(numbers(id(4), 0), if_possible({4})) << state;
    EXPECT_EQ(numbers(id(4), 2 * kOneSecond_ns), if_possible({1, 2, 4})) << state;
    EXPECT_EQ(numbers(id(9), 2 * kOneSecond_ns), if_possible({1, 2})) << state;
    EXPECT_EQ(code(id(4), 0), possible ? CancelCode::ok : CancelCode::terminated) << state;
    EXPECT_EQ(code(id(9), 0), CancelCode::unknown_goal);
    EXPECT_EQ(code({}, 0), CancelCode::ok);
    EXPECT_EQ(code({}, 3 * kOneSecond_ns), CancelCode::ok);
  }
}

}  // namespace
}  // namespace takt

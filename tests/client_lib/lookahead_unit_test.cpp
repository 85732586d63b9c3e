// A program that does not look at the cell asks for no more of a state than its time, so that a controller may run it ahead of
// the cell.
#include <gtest/gtest.h>

#include <string>

#include "client_lib/controller/controller.h"
#include "tests/support/controller_test_cell.h"

namespace takt::controller {
namespace {

/// Counts the looks that go beyond the time.
class CountedState final : public StateSource {
 public:
  explicit CountedState(const CellState& state) : state_(state) {}
  const CellState& read(StatePart part, std::size_t) override {
    if (part != StatePart::time) ++looks;
    return state_;
  }
  int looks = 0;

 private:
  const CellState& state_;
};

/// Looks in the periods of a program with this text in its routine, beside those of the first one.
int looks(const std::string& text) {
  const ProgramFile program("period_s = 0.008\nroutine('Robot1', function(r)\n" + text + "\nend)\n");
  const CellDescription cell = block_cell();
  Controller controller(program.path(), cell);
  CellState state = initial_state(cell);
  int result = 0;
  for (int k = 0; k < 50; ++k) {
    state.time = 0.008 * k;
    CountedState counted(state);
    controller.update(counted);
    if (k > 0) result += counted.looks;
  }
  return result;
}

TEST(Lookahead, MotionsAndWaitsForTimeDoNotLook) {
  EXPECT_EQ(
      looks("r:wait(0.1) r:move_joints(r.joints, {duration_s = 0.2}) r.gripper:close() local t = cell.time"),
      0);
}
TEST(Lookahead, ConditionsLookInEachPeriod) {
  EXPECT_EQ(looks("r:wait(0.08) r:wait_for(function(c) return c.time < 0 or c.step < 0 end, 100)"), 40);
}
TEST(Lookahead, EachFieldButTheTimeIsALook) {
  for (const char* look :
       {"cell.step", "cell.epoch", "cell.state_hash", "cell.components.P.position", "#cell.components",
        "cell.robots.Robot1.position", "cell.grippers.Gripper1.closed"})
    EXPECT_GE(looks(std::string("r:wait(0.08) local seen = ") + look), 1) << look;
}

}  // namespace
}  // namespace takt::controller

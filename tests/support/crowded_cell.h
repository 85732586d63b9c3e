#pragma once
// A cell with many Parts on tables, of which two are carried about: for tests and measurements of Parts at
// rest.
#include <cmath>
#include <memory>
#include <vector>

#include "server/simulation/step/simulation.h"
#include "tests/support/box_cell.h"

namespace takt::test {

class CrowdedCell {
 public:
  static constexpr int kCarried = 2;
  static constexpr double kPeriod_s = 0.008;

  /// `count` Parts of 40 mm on a grid, 100 to a table; every fifth one stands on another. The first two are
  /// below a gripper each.
  CrowdedCell(int count, bool exact_sleeping) {
    cell_.model().interaction.exact_sleeping = exact_sleeping;
    const int tables = (count + 99) / 100;
    for (int t = 0; t < tables; ++t)
      cell_.ground("T" + std::to_string(t), {1.0, 1.0, 0.05}, at(1.2 * t, 0.0, -0.05));
    for (int i = 0; i < count; ++i) {
      const int place = i % 100;
      const bool on_top = place % 5 == 4;
      const int column = (on_top ? place - 1 : place) % 10;
      const double x = 1.2 * (i / 100) - 0.45 + 0.1 * column;
      const double y = -0.45 + 0.1 * (place / 10);
      cell_.part("P" + std::to_string(i), 0.2, on_top ? 2 : 3, {0.04, 0.04, 0.04},
                 at(x, y, on_top ? 0.04 : 0.0));
    }
    for (int r = 0; r < kCarried; ++r)  // tips of the pads 10 mm above the table
      cell_.gantry_with_gripper("R" + std::to_string(r), "G" + std::to_string(r),
                                at(-0.45 + 0.1 * r, -0.45, 0.07));
    model_ = cell_.build();
  }

  std::shared_ptr<const CellModel> model() const { return model_; }

  /// Commands for the step that begins: grip, lift, swing for ever; from `let_go_s` on, release.
  const std::vector<Command>& commands(const Simulation& simulation, double let_go_s = 1e9) {
    commands_.clear();
    const double t = simulation.time_s();
    const std::uint64_t step = simulation.step_index();
    if (step == 0)
      for (int r = 0; r < kCarried; ++r)
        commands_.push_back(GripperCommand{r, {}, GripperAction::close, 0.0, 0.0});
    if (t >= let_go_s && !let_go_) {
      let_go_ = true;
      for (int r = 0; r < kCarried; ++r)
        commands_.push_back(GripperCommand{r, {}, GripperAction::open, 0.0, 0.0});
    }
    if (step % static_cast<std::uint64_t>(kPeriod_s / simulation.model().step_s + 0.5) != 0 || t < 1.0 ||
        let_go_)
      return commands_;
    for (int r = 0; r < kCarried; ++r) {
      const double s = t + kPeriod_s - 1.0;
      const double ramp = std::min(1.0, s);
      JointCommand move;
      move.robot = r;
      move.period_s = kPeriod_s;
      move.position = {
          0.05 * ramp * std::sin(3.0 * s), 0.04 * ramp * std::sin(2.0 * s + r), 0.2 * ramp, 0.0, 0.0,
          0.3 * ramp * std::sin(s)};
      commands_.push_back(move);
    }
    return commands_;
  }

 private:
  BoxCell cell_;
  std::shared_ptr<const CellModel> model_;
  std::vector<Command> commands_;
  bool let_go_ = false;
};

}  // namespace takt::test

#pragma once
// A cell in which all Parts move all the time: a tray in a gripper, on it open boxes side by side, in every
// box a peg with a head. All of them are concave. For tests and measurements of the collision check.
#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include "server/simulation/step/simulation.h"
#include "tests/support/box_cell.h"
#include "tests/support/hollow_bodies.h"

namespace takt::test {

class MovingCrowd {
 public:
  static constexpr double kPeriod_s = 0.008;

  /// `edge` x `edge` boxes and as many pegs.
  explicit MovingCrowd(int edge, bool exact_sleeping = true) {
    cell_.model().interaction.exact_sleeping = exact_sleeping;
    constexpr double kGap = 1e-4;  // boxes side by side touch: the margin is twice that
    const Vec3 box(0.06, 0.06, 0.05);
    const double pitch = box.x() + kGap;
    const double tray = pitch * edge + 0.1;
    const int tray_id =
        part("tray", 5.0, 9, {tray, tray, 0.02}, at(0.0, 0.0, 0.0),
             {box_mesh({tray, tray, 0.02}), box_mesh({0.03, 0.03, 0.12}, {0.0, 0.5 * tray, 0.02})});
    for (int i = 0; i < edge * edge; ++i) {
      const double x = pitch * (i % edge - 0.5 * (edge - 1));
      const double y = pitch * (i / edge - 0.5 * (edge - 1)) - 0.02;
      const std::string number = std::to_string(i);
      part("box" + number, 0.1, 8, box, at(x, y, 0.02), open_box_by_hand(box, 0.005));
      part("peg" + number, 0.05, 7, {0.03, 0.03, 0.06}, at(x, y, 0.025),
           {box_mesh({0.02, 0.02, 0.05}), box_mesh({0.044, 0.044, 0.01}, {0.0, 0.0, 0.05})});
    }
    cell_.gantry_with_gripper("R", "G", at(0.0, 0.5 * tray, 0.16));
    model_ = cell_.build();
    tray_ = tray_id;
  }

  std::shared_ptr<const CellModel> model() const { return model_; }
  int tray() const { return tray_; }
  int part_count() const { return static_cast<int>(model_->parts.size()); }

  /// Commands for the step that begins: grip at once, then swing and turn for ever.
  const std::vector<Command>& commands(const Simulation& simulation) {
    commands_.clear();
    const std::uint64_t step = simulation.step_index();
    if (step == 0) commands_.push_back(GripperCommand{0, {}, GripperAction::close, 0.0, 0.0});
    if (step % 8 != 0) return commands_;
    const double s = simulation.time_s() + kPeriod_s;
    const double ramp = std::min(1.0, s) * std::min(1.0, s);
    JointCommand move;
    move.robot = 0;
    move.period_s = kPeriod_s;
    move.position = {
        0.1 * ramp * std::sin(3.0 * s), 0.1 * ramp * std::sin(2.0 * s), 0.2 * ramp,
        0.2 * ramp * std::sin(1.3 * s), 0.2 * ramp * std::sin(1.7 * s), 0.5 * ramp * std::sin(s)};
    commands_.push_back(move);
    return commands_;
  }

 private:
  int part(const std::string& name, double mass_kg, int hierarchy, const Vec3& size, const Pose& X_WB,
           const std::vector<TriangleMesh>& pieces) {
    const int id = cell_.part(name, mass_kg, hierarchy, size, X_WB);
    Component& component = cell_.model().components[static_cast<std::size_t>(id)];
    std::vector<ConvexShape> convex;
    for (const TriangleMesh& piece : pieces) convex.push_back(ConvexShape::from_points(piece.vertices));
    component.convex = std::move(convex);
    component.box = component.convex.box();
    return id;
  }

  BoxCell cell_;
  std::shared_ptr<const CellModel> model_;
  std::vector<Command> commands_;
  int tray_ = -1;
};

}  // namespace takt::test

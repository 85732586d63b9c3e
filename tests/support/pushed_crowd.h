#pragma once
// Many Parts in surface contact on tables, of which closed jaws push two: for tests and measurements of Parts that
// sleep at level of detail 3.
#include <algorithm>
#include <memory>
#include <string>
#include <vector>

#include "server/simulation/step/simulation.h"
#include "tests/support/box_cell.h"
#include "tests/support/hollow_bodies.h"

namespace takt::test {

class PushedCrowd {
 public:
  static constexpr int kPushed = 2, kApart = 7;  ///< each seventh is pushed, until there are two
  static constexpr double kStep_s = 0.008, kSpeed_m_per_s = 0.02, kBegin_s = 0.4, kLongest_m = 0.035;
  static constexpr double kBox_m = 0.04, kPitch_m = 0.1, kGap_m = 0.003;

  /// `count` Parts of 40 mm on a grid, 100 to a table.
  explicit PushedCrowd(int count) {
    cell_.step(kStep_s);
    CellModel& model = cell_.model();
    model.contact_solver = {std::string(kAutomaticSolver), solver_default_tolerance(kAutomaticSolver),
                            kStep_s};
    const int tables = (count + 99) / 100;
    for (int t = 0; t < tables; ++t) {
      cell_.ground("T" + std::to_string(t), kTable_m, at(1.2 * t, 0.0, -kTable_m.z()));
      add_surface(box_mesh(kTable_m));
    }
    std::vector<int> by_contact;
    add_surface(box_mesh({kBox_m, kBox_m, kBox_m}));
    const auto box = model.contact.surfaces.back();
    model.contact.surfaces.resize(model.contact.surfaces.size() - 1);
    for (int i = 0; i < count; ++i) {
      by_contact.push_back(cell_.part("P" + std::to_string(i), 0.2, 2, {kBox_m, kBox_m, kBox_m}, place(i)));
      model.contact.surfaces.push_back(box);
    }
    for (int r = 0; r < std::min(kPushed, count); ++r) {
      Pose X = place(kApart * r);
      X.p.y() -= 0.5 * kBox_m + 0.01 + kGap_m;
      X.p.z() = 0.07;
      cell_.gantry_with_gripper("R" + std::to_string(r), "G" + std::to_string(r), X);
      GripperModel& gripper = model.grippers.back();
      gripper.parameters.initial_width_m = 0.0;
      gripper.friction.assign(1, 0.3);
      add_surface(box_mesh({0.02, 0.02, 0.02}, {0.0, 0.0, 0.1}));
      for (const int jaw : gripper.parameters.jaws) {
        add_surface(box_mesh({0.04, 0.01, 0.06}, {0.0, 0.005, -0.06}));
        by_contact.push_back(jaw);
      }
    }
    for (GripperModel& gripper : model.grippers) gripper.friction.assign(model.components.size(), 0.3);
    ProcessDescription parts;
    parts.name = "parts";
    parts.level_of_detail = 3;
    parts.components = by_contact;
    model.description.processes = {parts};
    model.contact.enabled = true;
    const std::size_t n = model.components.size();
    ContactPairs pairs(std::vector<std::int32_t>(n, 0), {ContactPairKind{contact_law(ContactParameters{})}},
                       1);
    for (int a = 0; a < static_cast<int>(n); ++a)
      for (int b = 0; b < static_cast<int>(n); ++b)
        if (a != b && base_first(model.components, a, b) &&
            pair_kind(model.components[static_cast<std::size_t>(a)].type,
                      model.components[static_cast<std::size_t>(b)].type) == PairKind::hold)
          pairs.add(a, b);
    model.contact.pairs = std::move(pairs);
    model_ = cell_.build();
  }

  std::shared_ptr<const CellModel> model() const { return model_; }
  /// Of a Part at the beginning: the middle of its bottom face.
  static Pose place(int i) {
    const int on_table = i % 100;
    return at(1.2 * (i / 100) - 0.45 + kPitch_m * (on_table % 10), -0.45 + kPitch_m * (on_table / 10), 0.0);
  }

  /// Commands for the step that begins: forward, then stand.
  const std::vector<Command>& commands(const Simulation& simulation) {
    commands_.clear();
    const double t = simulation.time_s() + kStep_s - kBegin_s;
    if (t <= 0.0) return commands_;
    for (std::size_t r = 0; r < model_->robots.size(); ++r) {
      JointCommand move;
      move.robot = static_cast<int>(r);
      move.period_s = kStep_s;
      move.position[1] = std::min(kSpeed_m_per_s * t, kLongest_m);
      commands_.push_back(move);
    }
    return commands_;
  }

 private:
  static inline const Vec3 kTable_m{1.1, 1.1, 0.05};
  void add_surface(const TriangleMesh& mesh) {
    cell_.model().contact.surfaces.push_back(
        std::make_shared<const ContactSurface>(mesh, ContactSurfaceOptions{default_element_edge_m(mesh)}));
  }

  BoxCell cell_;
  std::shared_ptr<const CellModel> model_;
  std::vector<Command> commands_;
};

}  // namespace takt::test

#pragma once
// Random cells for property tests: assemblies of boxes on several tables over a floor, and gantries that
// handle them at random, by commands only, as a client would. Everything follows from one seed.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <deque>
#include <memory>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "server/simulation/step/simulation.h"
#include "tests/support/box_cell.h"
#include "tests/support/box_oracle.h"

namespace takt::test {

/// Numbers that do not depend on the standard library's distributions.
class Dice {
 public:
  explicit Dice(unsigned seed) : engine_(seed) {}
  int below(int n) { return static_cast<int>(engine_() % static_cast<unsigned>(n)); }
  double between(double lower, double upper) {
    return lower + (upper - lower) * static_cast<double>(engine_()) / 4294967295.0;
  }
  bool chance(int percent) { return below(100) < percent; }

 private:
  std::mt19937 engine_;
};

struct RandomCellOptions {
  unsigned seed = 1;
  int parts = 30;  ///< as many as fit into whole assemblies, never more
  int grippers = 2;
  int tables = 2;
  int lattice_edge = 3;  ///< cubes along an edge of the largest lattice
};

/// Tables (1 m x 1 m, tops at z = 0, 1.2 m apart along x) over a floor at z = -0.6, and on them assemblies:
/// stacks, branching trees and lattices, faces 0 to 0.1 mm apart, hierarchy rising towards the base.
class RandomCell {
 public:
  static constexpr double kFloor_m = -0.6;
  static constexpr double kBase_m = 1.0;  ///< height of the gantries' zero

  explicit RandomCell(const RandomCellOptions& options) : options_(options), dice_(options.seed) {
    for (int i = 0; i < options.tables; ++i) {
      grounds.push_back(cell_.ground("T" + std::to_string(i), {1.0, 1.0, 0.1}, at(1.2 * i, 0.0, -0.1)));
    }
    grounds.push_back(cell_.ground("floor", {20.0, 20.0, 0.1}, at(0.0, 0.0, kFloor_m - 0.1)));
    for (int i = 0; i < options.grippers; ++i) {
      const std::string number = std::to_string(i);
      palms.push_back(cell_.gantry_with_gripper("R" + number, "G" + number, at(0.0, 0.0, kBase_m)));
    }
    for (KinematicRobotParameters& robot : cell_.model().robots) {
      // Far enough away that no grasp volume begins around a Part.
      robot.q_initial = {1.2 * dice_.between(0.0, options.tables - 1.0), -0.4 + 0.2 * robot.robot, 0.0};
      for (JointModel& joint : robot.arm.joints) joint.max_velocity = 5.0;
      cell_.model().description.robots[static_cast<std::size_t>(robot.robot)].arm = robot.arm;
    }
    std::vector<int> spots(static_cast<std::size_t>(9 * options.tables));
    for (std::size_t i = 0; i < spots.size(); ++i) spots[i] = static_cast<int>(i);
    for (std::size_t i = spots.size(); i > 1; --i) {
      std::swap(spots[i - 1], spots[static_cast<std::size_t>(dice_.below(static_cast<int>(i)))]);
    }
    for (const int spot : spots) add_assembly(spot);
    model_ = cell_.build();
  }

  std::shared_ptr<const CellModel> model() const { return model_; }
  const Vec3& size(int part) const { return sizes_[static_cast<std::size_t>(part)]; }
  Vec3 spot(int i) const { return {1.2 * (i / 9) + 0.3 * (i % 3 - 1), 0.3 * ((i / 3) % 3 - 1), 0.0}; }
  int spot_count() const { return 9 * options_.tables; }

  std::vector<int> grounds, palms, parts;  ///< component ids

  OrientedBox box(const Snapshot& s, int component) const {
    const ComponentSample& c = s.components[static_cast<std::size_t>(component)];
    const Component& shape = model_->components[static_cast<std::size_t>(component)];
    const Mat3 R = c.q_WB.toRotationMatrix();
    return {c.p_WB + R * shape.box.center_B, R, shape.box.half_B};
  }
  /// The space between the jaws of gripper `g`.
  OrientedBox grasp_volume(const Snapshot& s, std::size_t g) const {
    const GripperModel& model = model_->grippers[g];
    const auto sample = [&](int id) -> const ComponentSample& {
      return s.components[static_cast<std::size_t>(id)];
    };
    const ComponentSample& palm = sample(model.parameters.palm);
    const Mat3 R = palm.q_WB.toRotationMatrix();
    const double left = R.col(1).dot(sample(model.parameters.jaws[0]).p_WB - palm.p_WB);
    const double right = R.col(1).dot(sample(model.parameters.jaws[1]).p_WB - palm.p_WB);
    const Vec3 lower(model.face_x_lower_m, right, model.face_z_lower_m);
    const Vec3 upper(model.face_x_upper_m, left, model.face_z_upper_m);
    return {palm.p_WB + R * (0.5 * (lower + upper)), R, 0.5 * (upper - lower)};
  }

 private:
  bool room(int count) const { return static_cast<int>(parts.size()) + count <= options_.parts; }
  double gap() { return dice_.between(0.0, 1e-4); }

  void add_part(const Pose& X_WA, const Vec3& bottom_A, const Vec3& size, int hierarchy) {
    const double mass = dice_.between(0.3, 3.0) * 4000.0 * size.prod();
    const std::string name = "P" + std::to_string(parts.size());
    const int id = cell_.part(name, mass, hierarchy, size, {X_WA.R, X_WA * bottom_A});
    parts.push_back(id);
    sizes_.resize(static_cast<std::size_t>(id) + 1, Vec3::Zero());
    sizes_.back() = size;
  }

  /// A stack from height z on; returns its number of Parts. Half of the boxes are cubes.
  int add_stack(const Pose& X_WA, Vec3 bottom, int count, double widest, int hierarchy) {
    for (int i = 0; i < count; ++i) {
      const double edge = dice_.between(0.5, 1.0) * widest;
      Vec3 size = Vec3::Constant(edge);
      if (dice_.chance(50)) size = {edge, dice_.between(0.6, 1.0) * edge, dice_.between(0.5, 1.5) * edge};
      bottom.z() += gap();
      add_part(X_WA, bottom, size, hierarchy - i);
      bottom.z() += size.z();
    }
    return count;
  }

  void add_assembly(int spot_index) {
    Pose X_WA;
    X_WA.R = rotation_from_rpy({0.0, 0.0, dice_.between(-0.6, 0.6)});
    X_WA.p = spot(spot_index) + Vec3(dice_.between(-0.03, 0.03), dice_.between(-0.03, 0.03), 0.0);
    const int kind = dice_.below(3);
    if (kind == 0) {
      const int count = 1 + dice_.below(6);
      if (room(count)) add_stack(X_WA, {0.0, 0.0, gap()}, count, 0.06, 20);
    } else if (kind == 1) {  // a plate that carries up to four branches, one of them a plate again
      if (!room(18)) return;
      const double top = gap() + 0.02;
      add_part(X_WA, {0.0, 0.0, top - 0.02}, {0.12, 0.12, 0.02}, 20);
      for (int i = 0; i < 4; ++i) {
        const Vec3 bottom((i & 1) ? 0.03 : -0.03, (i & 2) ? 0.03 : -0.03, top);
        if (i == 0) {
          const Vec3 plate = bottom + Vec3(0.0, 0.0, gap());
          add_part(X_WA, plate, {0.05, 0.05, 0.02}, 19);
          for (int k = 0; k < 2; ++k) {
            add_stack(X_WA, plate + Vec3(k == 0 ? 0.0125 : -0.0125, 0.0, 0.02), 1 + dice_.below(2), 0.024,
                      18);
          }
        } else {
          add_stack(X_WA, bottom, dice_.below(5), 0.05, 19);
        }
      }
    } else {
      const int n = 2 + dice_.below(options_.lattice_edge - 1);
      if (!room(n * n * n)) return;
      // Hierarchy by layers, or rising towards one corner, so that sequences also run sideways.
      const bool to_corner = n <= 3 && dice_.chance(50);
      const double edge = dice_.between(0.018, 0.024);
      for (int z = 0; z < n; ++z) {
        for (int y = 0; y < n; ++y) {
          for (int x = 0; x < n; ++x) {
            const Vec3 bottom(edge * x + 2e-5 * x, edge * y + 5e-5 * y, (edge + 8e-5) * z + 1e-5);
            add_part(X_WA, bottom - Vec3(0.5 * n * edge, 0.5 * n * edge, 0.0), Vec3::Constant(edge),
                     20 - z - (to_corner ? x + y : 0));
          }
        }
      }
    }
  }

  RandomCellOptions options_;
  Dice dice_;
  BoxCell cell_;
  std::shared_ptr<const CellModel> model_;
  std::vector<Vec3> sizes_;
};

}  // namespace takt::test

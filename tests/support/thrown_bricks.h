#pragma once
// Bricks of 50 x 35 x 25 mm and 0.1 kg that fly over a floor in rows of their own and hit each other and the floor.
#include <memory>
#include <string>
#include <vector>

#include "tests/performance/box_file.h"
#include "tests/support/contact_scene.h"

namespace takt::test {

class Bricks {
 public:
  struct Brick {
    std::string name;
    int row = 0;
    double x = 0.0, z = 0.0;  ///< m
    Vec3 v = Vec3::Zero();    ///< m/s
    std::string rpy_deg = "[9, 14, 5]";
  };

  Bricks() {
    bench::write_box(directory_ / "brick.obj", {-0.025, -0.0175, -0.0125}, {0.025, 0.0175, 0.0125});
    bench::write_box(directory_ / "floor.obj", {-0.3, -3.0, -0.05}, {0.3, 3.0, 0.0});
  }
  std::shared_ptr<const CellModel> cell(const std::vector<Brick>& bricks, const std::string& solver,
                                        const std::string& contact = "") const {
    std::string parts;
    for (const Brick& b : bricks)
      parts += "  " + b.name + ": {mesh: brick.obj, mass_kg: 0.1, hierarchy: 1, pose: {position_m: [" +
               std::to_string(b.x) + ", " + std::to_string(0.4 * b.row) + ", " + std::to_string(b.z) +
               "], rpy_deg: " + b.rpy_deg + "}, twist: {velocity_m_per_s: [" + std::to_string(b.v.x()) +
               ", " + std::to_string(b.v.y()) + ", " + std::to_string(b.v.z()) + "]}}\n";
    return load_scene(directory_,
                      {"{" + solver + "}", "{defaults: {friction: 0.3}, element_edge_m: 0.01" + contact + "}",
                       parts, "  Floor: {mesh: floor.obj}"});
  }

  // Two that fly towards each other and meet, one that falls on the floor, one that passes above it and falls later.
  static std::vector<Brick> pair() {
    return {{"Left", 0, -0.05, 0.1, {0.8, 0, 0}}, {"Right", 0, 0.051, 0.104, {-0.7, 0, 0}}};
  }
  static std::vector<Brick> falling() { return {{"Falling", 1, 0.0, 0.05, {0, 0, 0}}}; }
  static std::vector<Brick> above() { return {{"Above", 2, 0.03, 0.12, {-0.5, 0, 0}}}; }
  static std::vector<Brick> all() {
    std::vector<Brick> bricks = pair();
    for (const auto& group : {falling(), above()}) bricks.insert(bricks.end(), group.begin(), group.end());
    return bricks;
  }
  /// Two piles of three, which fall on the floor and on each other.
  static std::vector<Brick> piles() {
    std::vector<Brick> bricks;
    for (int row = 0; row < 2; ++row)
      for (int i = 0; i < 3; ++i)
        bricks.push_back({"P" + std::to_string(3 * row + i), row, 0.004 * (row + i), 0.025 + 0.035 * i});
    return bricks;
  }
  /// One pile: an island in which few models need the smallest steps.
  static std::vector<Brick> pile(int count) {
    std::vector<Brick> bricks;
    for (int i = 0; i < count; ++i)
      bricks.push_back({"P" + std::to_string(i), 0, 0.004 * i, 0.025 + 0.035 * i});
    return bricks;
  }

 private:
  TemporaryDirectory directory_;
};

}  // namespace takt::test

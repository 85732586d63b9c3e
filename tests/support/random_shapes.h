#pragma once
// Random poses and convex shapes for tests, repeatable by seed.
#include <cmath>
#include <random>
#include <vector>

#include "plant_models/spatial.h"

namespace takt::test {

class Random {
 public:
  explicit Random(unsigned seed) : engine_(seed) {}
  double uniform(double a, double b) { return std::uniform_real_distribution<double>(a, b)(engine_); }
  double log_uniform(double a, double b) { return std::exp(uniform(std::log(a), std::log(b))); }
  int integer(int a, int b) { return std::uniform_int_distribution<int>(a, b)(engine_); }
  Vec3 direction() {
    std::normal_distribution<double> normal;
    return Vec3(normal(engine_), normal(engine_), normal(engine_)).normalized();
  }
  Mat3 rotation() {
    std::normal_distribution<double> normal;
    return Quat(normal(engine_), normal(engine_), normal(engine_), normal(engine_))
        .normalized()
        .toRotationMatrix();
  }
  /// A box or a few random points, stretched by `stretch` along its own axes, moved off its frame's origin.
  std::vector<Vec3> points(const Vec3& stretch, bool box) {
    std::vector<Vec3> result;
    const Vec3 shift(uniform(-0.5, 0.5), uniform(-0.5, 0.5), uniform(-0.5, 0.5));
    const int count = box ? 8 : integer(4, 8);
    for (int i = 0; i < count; ++i) {
      const Vec3 corner((i & 1) != 0 ? 0.5 : -0.5, (i & 2) != 0 ? 0.5 : -0.5, (i & 4) != 0 ? 0.5 : -0.5);
      const Vec3 p = box ? corner : Vec3(direction() * uniform(0.2, 0.5));
      result.push_back(stretch.cwiseProduct(p + shift));
    }
    return result;
  }

 private:
  std::mt19937_64 engine_;
};

}  // namespace takt::test

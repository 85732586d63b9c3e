// Time of one convex_overlap call. Poses change from call to call, as in a simulation.
#include <benchmark/benchmark.h>

#include <array>
#include <cstddef>
#include <vector>

#include "server/geometry/convex_overlap.h"

namespace takt {
namespace {

std::vector<Vec3> box_corners(const Vec3& half) {
  std::vector<Vec3> corners;
  for (int i = 0; i < 8; ++i)
    corners.emplace_back((i & 1) != 0 ? half.x() : -half.x(), (i & 2) != 0 ? half.y() : -half.y(),
                         (i & 4) != 0 ? half.z() : -half.z());
  return corners;
}

ConvexShape box() {
  return ConvexShape::from_points(box_corners({0.04, 0.04, 0.04}));
}

/// The same box with 2 mm cut off its bottom edges: 12 vertices, no short cut for boxes.
ConvexShape chamfered() {
  std::vector<Vec3> points;
  for (const Vec3& p : box_corners({0.04, 0.04, 0.04})) {
    if (p.z() > 0.0) {
      points.push_back(p);
    } else {
      points.emplace_back(p.x(), p.y(), -0.038);
      points.emplace_back(0.95 * p.x(), 0.95 * p.y(), -0.04);
    }
  }
  return ConvexShape::from_points(points);
}

/// Shape b at `distance` between the faces along x, with poses that vary a little.
void measure(benchmark::State& state, const ConvexShape& a, const ConvexShape& b, double distance) {
  constexpr std::size_t kPoses = 64;
  std::array<Pose, kPoses> poses;
  for (std::size_t i = 0; i < kPoses; ++i) {
    const double x = static_cast<double>(i) / kPoses;
    poses[i].R = rotation_from_rpy({0.01 * x, -0.007 * x, 0.2 * x});
    poses[i].p = Vec3(0.08 + distance, 0.01 * x, -0.015 * x);
  }
  const Pose X_WA{Mat3::Identity(), Vec3::Zero()};
  std::size_t i = 0;
  for (auto _ : state) benchmark::DoNotOptimize(convex_overlap(a, X_WA, b, poses[i++ % kPoses], 1e-4));
}

BENCHMARK_CAPTURE(measure, box_apart_20mm, box(), box(), 0.02);
BENCHMARK_CAPTURE(measure, box_overlap_5mm, box(), box(), -0.005);
BENCHMARK_CAPTURE(measure, box_overlap_40mm, box(), box(), -0.04);
BENCHMARK_CAPTURE(measure, chamfered_apart_20mm, chamfered(), chamfered(), 0.02);
BENCHMARK_CAPTURE(measure, chamfered_overlap_5mm, chamfered(), chamfered(), -0.005);
BENCHMARK_CAPTURE(measure, chamfered_in_box_corner, chamfered(), box(), -0.04);

}  // namespace
}  // namespace takt

BENCHMARK_MAIN();

// bench_growth: how the cost of one evaluation of a contact grows with the number of triangles. Three pairs of which
// the meshes become finer while the shapes stay: a sphere rolling on a plate, a flat peg sliding along the wall of
// its hole, a nut turning on its bolt. For each row: time and memory of making both surfaces with their index,
// processor time of an evaluation in motion, elements that press, and slopes against the triangles of the row
// before, log(cost ratio) / log(triangle ratio): 0 where the cost is independent, 1 where it follows the number.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <numbers>
#include <string>
#include <vector>

#include "config/meshes/generator/screw_meshes.h"
#include "config/meshes/generator/shapes.h"
#include "server/contact/surface/polygonal_contact.h"
#include "tests/performance/processor_time.h"
#include "tests/support/contact_pairs.h"
#include "tests/support/process_resources.h"
#include "tests/support/solid_mesh.h"

namespace takt {
namespace {

using bench::processor_s;

struct GrowthRow {
  std::size_t triangles = 0;
  double load_s = 0.0, evaluation_s = 0.0, elements = 0.0;
};

/// Base and Target, and the pose of the Base in the Target's frame after `travel` steps.
struct MovingPair {
  meshes::Solid base, target;
  std::function<Pose(int)> pose;
};

GrowthRow measure(const MovingPair& pair, const GrowthRow* before) {
  GrowthRow row;
  row.triangles = pair.base.triangles.size() + pair.target.triangles.size();
  const double bytes = test::process_resources().allocated_bytes;
  const double begin_s = processor_s();
  const auto base = test::surface(test::mesh_of(pair.base)),
             target = test::surface(test::mesh_of(pair.target));
  row.load_s = processor_s() - begin_s;
  const double per_triangle =
      (test::process_resources().allocated_bytes - bytes) / static_cast<double>(row.triangles);
  PolygonalContact contact(base, target, test::frictionless_law());
  ContactResult result;
  constexpr int kWarm = 20, kSteps = 200;
  double started_s = 0.0;
  for (int i = 0; i < kSteps; ++i) {
    if (i == kWarm) started_s = processor_s();
    contact.evaluate({pair.pose(i), {}}, result);
    row.elements += static_cast<double>(result.elements) / kSteps;
  }
  row.evaluation_s = (processor_s() - started_s) / (kSteps - kWarm);
  std::printf("%9zu %9.1f %8.1f %7.0f %12.2f %9.0f", row.triangles, 1e3 * row.load_s,
              1e6 * row.load_s / static_cast<double>(row.triangles), per_triangle, 1e6 * row.evaluation_s,
              row.elements);
  if (before != nullptr) {
    const double ratio =
        std::log(static_cast<double>(row.triangles) / static_cast<double>(before->triangles));
    const auto slope = [ratio](double now, double then) { return std::log(now / then) / ratio; };
    std::printf(" %9.2f %9.2f %9.2f", slope(row.load_s, before->load_s),
                slope(row.evaluation_s, before->evaluation_s),
                slope(std::max(row.elements, 1e-9), std::max(before->elements, 1e-9)));
  }
  std::printf("\n");
  std::fflush(stdout);
  return row;
}

void grow(const char* name, const std::vector<double>& sizes, const std::function<MovingPair(double)>& make) {
  std::printf("\n%s\n%9s %9s %8s %7s %12s %9s %9s %9s %9s\n", name, "triangles", "load ms", "us each",
              "B each", "evaluate us", "press", "load", "evaluate", "press");
  GrowthRow before;
  for (const double size : sizes) {
    const GrowthRow row = measure(make(size), before.triangles > 0 ? &before : nullptr);
    before = row;
  }
}

Mat3 turned(double angle, const Vec3& axis) {
  return Eigen::AngleAxisd(angle, axis).toRotationMatrix();
}

}  // namespace
}  // namespace takt

int main(int argc, char** argv) {
  using namespace takt;
  const bool to_a_million = argc > 1 && std::string(argv[1]) == "long";
  if (argc > 1 && !to_a_million) {
    std::fprintf(stderr, "bench_growth: found '%s'; allowed: long (up to a million triangles)\n", argv[1]);
    return 2;
  }
  const auto up_to = [&](std::vector<double> sizes, std::size_t least) {
    if (!to_a_million) sizes.resize(least);
    return sizes;
  };
  grow("a sphere of 25 mm rolls on a plate, 50 um deep, 0.1 mm a step", up_to({3, 4, 5, 6, 7, 8}, 4),
       [](double levels) {
         constexpr double kRadius_m = 0.025;
         return MovingPair{
             meshes::make_icosphere("sphere", kRadius_m, static_cast<int>(levels)),
             meshes::make_revolved("plate", {{0.0, -0.02}, {0.1, -0.02}, {0.1, 0.0}, {0.0, 0.0}}, false, 24),
             [](int i) {
               const double x_m = 1e-4 * i;
               return Pose{turned(x_m / kRadius_m, Vec3::UnitY()), Vec3(x_m, 0.0, kRadius_m - 5e-5)};
             }};
       });
  grow("a peg of 24 flats slides along a flat of its hole, 5 um deep, 10 um a step",
       up_to({4e-3, 2e-3, 1e-3, 5e-4, 2.5e-4, 1.2e-4, 4e-5, 1e-5}, 5), [](double edge) {
         return MovingPair{meshes::make_peg("peg", {0.0099, 0.05, 0.002, 24, edge}),
                           meshes::make_bush("hole", {0.010, 0.03, 0.03, 0.01, 0.001, 24, edge}), [](int i) {
                             return Pose{Mat3::Identity(), Vec3(1.05e-4, 0.0, 0.02 - 1e-5 * i)};
                           }};
       });
  grow("an M16 nut turns on its bolt, on the flanks, 0.4 degrees a step", up_to({4, 2, 1, 0.5, 0.3, 0.2}, 3),
       [](double coarse) {
         meshes::ScrewParameters p = meshes::iso_metric(16);
         p.contact_edge *= coarse;
         p.bolt_columns = 12 * static_cast<int>(std::round(7.0 / coarse));
         p.nut_columns = 12 * static_cast<int>(std::round(8.0 / coarse));
         const double start_m = 3.0 * p.pitch - p.clearance * std::tan(std::numbers::pi / 6.0) - 2e-6;
         return MovingPair{meshes::make_nut(p), meshes::make_bolt(p), [p, start_m](int i) {
                             const double angle = -0.007 * i;
                             return Pose{
                                 turned(angle, Vec3::UnitZ()),
                                 Vec3(0.0, 0.0, start_m + p.pitch * angle / (2.0 * std::numbers::pi))};
                           }};
       });
  return 0;
}

// bench_decomposition: convex decomposition at import, for the meshes of the block scenario and two hollow
// bodies: parts, how much of the volume is lost and gained, seconds without and with cache.
#include <unistd.h>

#include <chrono>
#include <cstdio>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "server/geometry/convex/decomposition_cache.h"
#include "server/geometry/convex/volume_comparison.h"
#include "server/geometry/mesh/import.h"
#include "tests/support/hollow_bodies.h"

namespace {

double seconds() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

}  // namespace

int main() {
  if (!takt::decomposition_available()) {
    std::puts("bench_decomposition: this program was built without V-HACD; there is nothing to measure");
    return 0;
  }
  const std::filesystem::path meshes = std::filesystem::path(TAKT_CONFIG_DIR) / "meshes";
  std::vector<std::pair<std::string, takt::TriangleMesh>> bodies{
      {"B", takt::import_solid(meshes / "B.obj")},
      {"O", takt::import_solid(meshes / "O.obj")},
      {"U shape", takt::test::u_shape()},
      {"open box", takt::test::open_box({0.20, 0.16, 0.10}, 0.012)}};
  const std::filesystem::path directory =
      std::filesystem::temp_directory_path() / ("takt_bench_decomposition_" + std::to_string(::getpid()));
  const takt::DecompositionCache cache(directory);
  std::printf("%s\n%-10s %9s %10s %6s %6s %8s %8s %9s %9s %9s\n", takt::decomposition_version().c_str(),
              "body", "triangles", "resolution", "parts", "corners", "lost", "gained", "cut s", "cached s",
              "compare s");
  for (const auto& [name, mesh] : bodies) {
    for (const int resolution : {100'000, 400'000}) {
      takt::DecompositionParameters parameters;
      parameters.resolution = resolution;
      const double begin = seconds();
      const auto made = takt::decompose_cached(mesh, parameters, cache);
      const double cut = seconds();
      const auto found = takt::decompose_cached(mesh, parameters, cache);
      const double cached = seconds();
      const takt::VolumeComparison volumes = takt::compare_volumes(mesh, made.shapes);
      const double end = seconds();
      std::size_t corners = 0;
      for (const takt::ConvexShape& shape : found.shapes) corners += shape.vertices.size();
      std::printf("%-10s %9zu %10d %6zu %6zu %7.3f%% %7.3f%% %9.3f %9.4f %9.4f\n", name.c_str(),
                  mesh.triangles.size(), resolution, found.shapes.size(), corners, 100.0 * volumes.lost,
                  100.0 * volumes.gained, cut - begin, cached - cut, end - cached);
    }
  }
  std::filesystem::remove_all(directory);
  return 0;
}

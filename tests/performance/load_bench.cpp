// Processor time of loading N Parts of twelve triangles, of one mesh and of N meshes, at levels of detail 1 and 3: the
// cell (scenario and meshes read, shapes made) and the simulation of it. Arguments: the numbers of Parts.
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "server/scenario/scenario_builder.h"
#include "server/simulation/step/simulation.h"
#include "tests/performance/box_file.h"
#include "tests/performance/processor_time.h"

namespace {

namespace fs = std::filesystem;

using takt::bench::processor_s, takt::bench::write_box;

fs::path write_scenario(const fs::path& folder, int count, bool one_mesh, int level) {
  const int side = static_cast<int>(std::ceil(std::sqrt(count)));
  write_box(folder / "plate.obj", {-0.03 * side, -0.03 * side, -0.02}, {0.03 * side, 0.03 * side, 0.0});
  for (int i = 0; i < (one_mesh ? 1 : count); ++i)
    write_box(folder / ("box" + std::to_string(i) + ".obj"), {-0.01, -0.01 - 1e-6 * i, -0.01},
              {0.01, 0.01 + 1e-6 * i, 0.01});
  const fs::path file = folder / "cell.yaml";
  std::ofstream out(file);
  out << "takt_scenario: 1\nname: load\nsolver: {method: rk2, step_s: 0.001, contact: {method: rosenbrock, "
         "tolerance: 1.0e-4, step_s: 0.001}}\nprocesses: {all: {level_of_detail: "
      << level << ", members: all}}\ngrounds:\n  Plate: {mesh: plate.obj}\nparts:\n";
  for (int i = 0; i < count; ++i)
    out << "  P" << i << ": {mesh: box" << (one_mesh ? 0 : i)
        << ".obj, mass_kg: 0.1, hierarchy: 1, pose: {position_m: [" << 0.05 * (i % side - side / 2) << ", "
        << 0.05 * (i / side - side / 2) << ", 0.0101]}}\n";
  return file;
}

}  // namespace

int main(int argc, char** argv) {
  std::vector<int> counts;
  for (int i = 1; i < argc; ++i) counts.push_back(std::atoi(argv[i]));
  if (counts.empty()) counts = {100, 300, 1000, 3000};
  std::string name = (fs::temp_directory_path() / ("takt_load_" + std::string(6, 'X'))).string();
  if (mkdtemp(name.data()) == nullptr) return 1;
  const fs::path folder = name;
  std::printf(
      "Loading N parts of 12 triangles, processor time. Goal: 3000 of one mesh in 1 s.\n"
      "                        cell    simulation      both   us per part   slope\n");
  for (const int level : {1, 3}) {
    for (const bool one_mesh : {true, false}) {
      double before_s = 0.0;
      int before = 0;
      for (const int count : counts) {
        const fs::path file = write_scenario(folder, count, one_mesh, level);
        const double begin_s = processor_s();
        const auto cell = takt::load_cell(file);
        const double loaded_s = processor_s();
        const takt::Simulation simulation(cell);
        const double end_s = processor_s(), all_s = end_s - begin_s;
        std::printf("LoD %d, %-9s %5d %8.3f s %8.3f s %8.3f s %10.1f", level,
                    one_mesh ? "one mesh" : "N meshes", count, loaded_s - begin_s, end_s - loaded_s, all_s,
                    1e6 * all_s / count);
        if (before > 0)
          std::printf("   %6.2f", std::log(all_s / before_s) / std::log(static_cast<double>(count) / before));
        std::printf("\n");
        std::fflush(stdout);
        before = count, before_s = all_s;
      }
    }
  }
  fs::remove_all(folder);
  return 0;
}

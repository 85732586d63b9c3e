// bench_heap [COUNT]... [--solver NAME] [--step SECONDS]: bricks of 50 x 35 x 25 mm fall into a bin, six in a
// layer, hit each other and come to rest as one heap, at level of detail 3. By number of bricks (6, 12, 25 and
// 50 unless given): computing time over simulated time, its growth from row to row as an exponent, the
// solver's work, and how fast the fastest brick still is at the end.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <string>
#include <vector>

#include "server/headless/headless_run.h"
#include "server/scenario/scenario_builder.h"
#include "tests/performance/box_file.h"

namespace takt {
namespace {

namespace fs = std::filesystem;

constexpr double kDuration_s = 2.5;

/// -1 .. 1, the same on every machine.
class Pseudorandom {
 public:
  double next() {
    state_ = state_ * 1664525U + 1013904223U;
    return static_cast<double>(state_) / 2147483648.0 - 1.0;
  }

 private:
  std::uint32_t state_ = 7;
};

fs::path write_heap(int count) {
  const fs::path directory = fs::path(TAKT_SOURCE_DIR) / "build" / "heaps";
  fs::create_directories(directory);
  bench::write_box(directory / "brick.obj", {-0.025, -0.0175, -0.0125}, {0.025, 0.0175, 0.0125});
  bench::write_box(directory / "floor.obj", {-0.14, -0.14, -0.03}, {0.14, 0.14, 0.0});
  bench::write_box(directory / "wall_x.obj", {0.0, -0.14, 0.0}, {0.03, 0.14, 0.8});
  bench::write_box(directory / "wall_y.obj", {-0.14, 0.0, 0.0}, {0.14, 0.03, 0.8});
  const fs::path file = directory / ("heap_" + std::to_string(count) + ".yaml");
  std::ofstream out(file);
  out << "takt_scenario: 1\nname: heap\ndescription: bricks fall into a bin\nduration_s: " << kDuration_s
      << "\nprocesses:\n  cell: {level_of_detail: 3, members: all}\ncontact:\n  defaults: {friction: 0.3}\n"
      << "  element_edge_m: 0.0094\nparts:\n";
  Pseudorandom random;
  for (int i = 0; i < count; ++i) {
    constexpr double kColumns_m[] = {-0.067, 0.0, 0.067}, kMostTurned_deg = 20.0;
    const int place = i % 6, layer = i / 6;
    out << "  P" << i << ": {mesh: brick.obj, mass_kg: 0.1, hierarchy: " << i + 1 << ", pose: {position_m: ["
        << kColumns_m[place % 3] << ", " << (place < 3 ? -0.05 : 0.05) << ", " << 0.035 + 0.055 * layer
        << "], rpy_deg: [";
    for (int axis = 0; axis < 3; ++axis) out << (axis > 0 ? ", " : "") << kMostTurned_deg * random.next();
    out << "]}}\n";
  }
  out << "grounds:\n  Floor: {mesh: floor.obj}\n"
      << "  East: {mesh: wall_x.obj, pose: {position_m: [0.1, 0, 0]}}\n"
      << "  West: {mesh: wall_x.obj, pose: {position_m: [-0.13, 0, 0]}}\n"
      << "  North: {mesh: wall_y.obj, pose: {position_m: [0, 0.1, 0]}}\n"
      << "  South: {mesh: wall_y.obj, pose: {position_m: [0, -0.13, 0]}}\n";
  return file;
}

/// Returns computing time over simulated time.
double measure(int count, const ScenarioOptions& options, double before, int count_before) {
  const Scenario scenario = read_scenario(write_heap(count), options);
  Simulation simulation(build_cell(scenario));
  HeadlessOptions run;
  run.duration_s = kDuration_s;
  const HeadlessResult result = run_headless(simulation, scenario, run);
  const double ratio = result.cpu_s / kDuration_s;
  double fastest_m_per_s = 0.0, outside_m = 0.0;
  for (const ComponentSample& sample : result.final_state.components) {
    if (sample.V_WB.v.isZero()) continue;
    fastest_m_per_s = std::max(fastest_m_per_s, sample.V_WB.v.norm());
    outside_m = std::max(
        {outside_m, std::abs(sample.p_WB.x()) - 0.1, std::abs(sample.p_WB.y()) - 0.1, -sample.p_WB.z()});
  }
  char growth[16] = "";
  if (before > 0.0)
    std::snprintf(growth, sizeof(growth), "%.2f",
                  std::log(ratio / before) / std::log(static_cast<double>(count) / count_before));
  const SolverStatistics& work = result.statistics.solver;
  std::printf(
      "%6d %9.3f %7s %9llu %9llu %9llu %9llu %12.2e%s%s\n", count, ratio, growth,
      static_cast<unsigned long long>(work.steps), static_cast<unsigned long long>(work.rejected_steps),
      static_cast<unsigned long long>(work.evaluations), static_cast<unsigned long long>(work.factorisations),
      fastest_m_per_s, outside_m > 0.0 ? "  OUTSIDE THE BIN" : "", result.fault.c_str());
  std::fflush(stdout);
  return ratio;
}

}  // namespace
}  // namespace takt

int main(int argc, char** argv) {
  takt::ScenarioOptions options;
  std::string step = "0.008";
  std::vector<int> counts;
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    const bool last = i + 1 == argc;
    if (word == "--solver" && !last)
      options.overrides.push_back(std::string("solver.method=") + argv[++i]);
    else if (word == "--step" && !last)
      step = argv[++i];
    else if (const int count = std::atoi(word.c_str()); count > 0 && count <= 84)
      counts.push_back(count);
    else {
      std::fprintf(stderr,
                   "bench_heap: found '%s'; allowed: numbers of bricks from 1 to 84, --solver, --step\n",
                   word.c_str());
      return 2;
    }
  }
  options.overrides.push_back("solver.step_s=" + step);
  if (counts.empty()) counts = {6, 12, 25, 50};
  std::printf("%6s %9s %7s %9s %9s %9s %9s %12s\n", "bricks", "time/time", "growth", "steps", "rejected",
              "evaluated", "factored", "fastest m/s");
  double ratio = 0.0;
  int before = 0;
  for (const int count : counts) {
    ratio = takt::measure(count, options, ratio, before);
    before = count;
  }
  return 0;
}

// Time per step of a cell with N Parts on tables of which two are carried about by grippers, with the
// skipping of what rests and without. Exit code 1 when the two differ in a bit.
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <vector>

#include "tests/support/crowded_cell.h"

namespace {

constexpr double kGoal_us = 10.0;

struct Outcome {
  double median_us = 0.0, worst_us = 0.0;
  std::uint64_t hash = 0;
};

Outcome run(int count, bool skip_resting, int steps) {
  takt::test::CrowdedCell cell(count, skip_resting);
  takt::Simulation simulation(cell.model());
  for (int i = 0; i < 1200; ++i)
    simulation.step(cell.commands(simulation));  // until both Parts hang and swing
  std::vector<double> times;
  Outcome outcome;
  for (int i = 0; i < steps; ++i) {
    const auto& commands = cell.commands(simulation);
    const auto begin = std::chrono::steady_clock::now();
    simulation.step(commands);
    const std::chrono::duration<double, std::micro> spent = std::chrono::steady_clock::now() - begin;
    times.push_back(spent.count());
  }
  outcome.hash = simulation.state_hash();
  std::sort(times.begin(), times.end());
  outcome.median_us = times[times.size() / 2];
  outcome.worst_us = times[times.size() * 99 / 100];
  return outcome;
}

}  // namespace

int main() {
  std::printf("Microseconds per whole step (median, 99 %% of steps), two of N Parts move, goal %.0f us\n",
              kGoal_us);
  std::printf("    N   resting skipped     everything anew     same bits\n");
  bool same = true;
  for (const int count : {10, 50, 200, 1000}) {
    const int steps = count >= 1000 ? 300 : 2000;
    const Outcome fast = run(count, true, steps);
    const Outcome full = run(count, false, steps);
    same = same && fast.hash == full.hash;
    std::printf("%5d   %6.2f  %6.2f %-5s %9.2f  %9.2f     %s\n", count, fast.median_us, fast.worst_us,
                fast.median_us <= kGoal_us ? "met" : "MISSED", full.median_us, full.worst_us,
                fast.hash == full.hash ? "yes" : "NO");
  }
  return same ? 0 : 1;
}

// Time per step of a cell with N Parts on tables, of which grippers carry two, with and without skipping
// Parts at rest; then of cells in which all Parts move, with one thread and with two. Exit code 1 if runs
// that must agree differ in a bit. At last the cost and memory of N Parts that sleep in surface contact, with the slopes of
// their growth. Argument: resting, threads or contact for one of the three alone.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <string>
#include <vector>

#include "server/runtime/loop/worker_pool.h"
#include "tests/performance/pushed_scene.h"
#include "tests/support/crowded_cell.h"
#include "tests/support/moving_crowd.h"
#include "tests/support/process_resources.h"

namespace {

constexpr double kGoal_us = 10.0;

struct Outcome {
  double median_us = 0.0, worst_us = 0.0;
  std::uint64_t hash = 0;
};

Outcome run(int count, bool exact_sleeping, int steps) {
  takt::test::CrowdedCell cell(count, exact_sleeping);
  takt::Simulation simulation(cell.model());
  for (int i = 0; i < 1200; ++i)
    simulation.step(cell.commands(simulation));  // until both Parts are held and swing
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

double median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values[values.size() / 2];
}

double wall_s() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

/// The same cell twice, with one thread and with two, in turns of a few steps, so that both meet the same
/// machine. Returns whether the bits and the counts are the same.
template <typename Cell>
bool compare_threads(const char* name, Cell& cell, int part_count, int blocks) {
  constexpr int kBlock = 100;
  takt::WorkerPool pool(2);
  takt::Simulation one(cell.model()), two(cell.model());
  two.set_executor(&pool);
  std::vector<double> step_us[2], detection_us[2], ratios;
  for (int block = -4; block < blocks; ++block) {
    double spent[2] = {0.0, 0.0};
    takt::Simulation* const runs[2] = {&one, &two};
    for (int turn = 0; turn < 2; ++turn) {
      const int k = (turn + block) & 1;  // alternates the order
      takt::Simulation& simulation = *runs[k];
      simulation.set_stage_clock(&wall_s);
      const double detection = simulation.statistics().mpr_s;
      const double begin = wall_s();
      for (int i = 0; i < kBlock; ++i) simulation.step(cell.commands(simulation));
      spent[k] = 1e6 * (wall_s() - begin) / kBlock;
      if (block < 0) continue;
      step_us[k].push_back(spent[k]);
      detection_us[k].push_back(1e6 * (simulation.statistics().mpr_s - detection) / kBlock);
    }
    if (block >= 0) ratios.push_back(spent[1] / spent[0]);
  }
  const bool same = one.state_hash() == two.state_hash() &&
                    one.statistics().mpr_calls == two.statistics().mpr_calls &&
                    one.statistics().mpr_skipped == two.statistics().mpr_skipped;
  const double calls =
      static_cast<double>(one.statistics().mpr_calls) / static_cast<double>(one.statistics().steps);
  std::printf("%-28s %5d  %8.0f   %9.2f %9.2f   %9.2f %9.2f   %5.2f     %s\n", name, part_count, calls,
              median(step_us[0]), median(step_us[1]), median(detection_us[0]), median(detection_us[1]),
              median(ratios), same ? "yes" : "NO");
  return same;
}

bool compare_skipping() {
  std::printf("Microseconds per whole step (median, 99 %% of steps), two of N Parts move, goal %.0f us\n",
              kGoal_us);
  std::printf("    N   resting skipped     nothing skipped     same bits\n");
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
  return same;
}

bool compare_threads() {
  bool same = true;
  std::printf(
      "\nOne thread and two, in turns, everything moves (boxes and pegs: five and two convex parts each)\n"
      "                                    calls        us per step          of which detection  two/one\n"
      "cell                         parts  per step     1 thread 2 threads    1 thread 2 threads            "
      "same\n");
  for (const int edge : {2, 4, 8, 11, 16}) {
    takt::test::MovingCrowd crowd(edge);
    same = compare_threads("tray of boxes with pegs", crowd, crowd.part_count(), edge > 8 ? 30 : 60) && same;
  }
  takt::test::CrowdedCell resting(200, true);
  same = compare_threads("tables, two Parts move", resting, 200, 40) && same;
  return same;
}

/// Exponent of growth between two sizes.
double slope(double from, double to, int few, int many) {
  return std::log(to / from) / std::log(static_cast<double>(many) / few);
}

/// N Parts on tables in surface contact: the time in which they come to rest, and then computing over simulated time and
/// memory of the simulation, while two of them are pushed among the others, which sleep.
void measure_contact() {
  constexpr double kSimulated_s = 2.0;
  std::printf(
      "\nSurface contact, N Parts on tables, two of them pushed among the others asleep for %.0f s (default "
      "solver)\n"
      "    N   to rest s  slope   computing/simulated  slope   memory MB  slope   near pairs  contacts  of "
      "pairs   Bullet, sleeping\n",
      kSimulated_s);
  double rest_before = 0.0, ratio_before = 0.0, memory_before = 0.0;
  int before = 0;
  for (const int count : {10, 30, 100, 300, 1000, 3000}) {
    const double memory_begin = 1e-6 * takt::test::process_resources().allocated_bytes;
    takt::test::PushedCrowd crowd(count);
    takt::Simulation simulation(crowd.model());
    constexpr double kBegin_s = takt::test::PushedCrowd::kBegin_s;
    const double rest = takt::bench::run_until(kBegin_s, crowd, simulation);
    const double ratio = takt::bench::run_until(kBegin_s + kSimulated_s, crowd, simulation) / kSimulated_s;
    const double memory = 1e-6 * takt::test::process_resources().allocated_bytes - memory_begin;
    const takt::ContactInteraction::Size size = simulation.contact_size();
    const auto growth = [&](double from, double to) {
      return before > 0 ? slope(from, to, before, count) : 0.0;
    };
    const takt::bench::PushedScene beside(count, kSimulated_s);
    const takt::bench::Peer bullet = takt::bench::bullet();
    char peer[64] = "not installed (libbullet-dev)";
    if (bullet.run != nullptr) {
      const takt::bench::PeerEnd end = bullet.run(beside.scene, bullet.settings.front());
      std::snprintf(peer, sizeof(peer), "%.4f (%.3f mm off)", end.cpu_s / kSimulated_s,
                    1e3 * beside.error_m(end.X_WB));
    }
    std::printf("%5d   %9.3f  %5.2f   %19.4f  %5.2f   %9.1f  %5.2f   %10zu  %8zu  %zu   %s\n", count, rest,
                growth(rest_before, rest), ratio, growth(ratio_before, ratio), memory,
                growth(memory_before, memory), size.near_pairs, size.contacts,
                simulation.model().contact.pairs.size(), peer);
    if (!simulation.fault().empty()) std::printf("  %s\n", simulation.fault().c_str());
    before = count, rest_before = rest, ratio_before = ratio, memory_before = memory;
  }
}

}  // namespace

int main(int argc, char** argv) {
  const std::string only = argc > 1 ? argv[1] : "";
  bool same = true;
  if (only.empty() || only == "resting") same = compare_skipping() && same;
  if (only.empty() || only == "threads") same = compare_threads() && same;
  if (only.empty() || only == "contact") measure_contact();
  return same ? 0 : 1;
}

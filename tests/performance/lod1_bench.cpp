// The block scenario at LoD 1: computation ratio, time per step by stage, largest step that holds. Ratios to
// the thesis' figures are printed beside ours; its machine was a desktop with an i7-11700K. Then both block
// scenarios with each kind of convex shapes, one thread and two (argument `threads`: only that). Exit code 1
// when the number of threads changes a bit.
#include <algorithm>
#include <cstdio>
#include <string>
#include <vector>

#include "server/geometry/convex/decomposition_cache.h"
#include "server/headless/headless_run.h"
#include "server/headless/report.h"
#include "server/runtime/loop/worker_pool.h"
#include "server/scenario/scenario_builder.h"

namespace {

struct Outcome {
  takt::HeadlessResult result;
  double error_m = 0.0;
  bool held = true;
};

Outcome run(const std::string& file, const std::vector<std::string>& overrides, bool stage_times = false,
            takt::Executor* executor = nullptr) {
  takt::ScenarioOptions options;
  options.overrides = overrides;
  const takt::Scenario scenario = takt::read_scenario(file, options);
  const auto cell = takt::build_cell(scenario, {takt::user_cache_directory()});
  takt::Simulation simulation(cell);
  simulation.set_executor(executor);
  takt::HeadlessOptions headless;
  headless.duration_s = scenario.duration_s;
  headless.program = scenario.controller_program;
  headless.stage_times = stage_times;
  Outcome outcome;
  outcome.result = takt::run_headless(simulation, scenario, headless);
  outcome.error_m = takt::max_position_error_m(scenario, cell->description, outcome.result.final_state);
  for (const auto& change : outcome.result.changes) outcome.held = outcome.held && change.to >= 0;
  outcome.held = outcome.held && outcome.result.fault.empty();
  return outcome;
}

std::string step(double h) {
  return "solver.step_s=" + std::to_string(h);
}

/// Both scenarios with each kind of convex shapes, with one thread and with two in turns. False when the
/// number of threads changes a bit.
bool compare_shapes_and_threads() {
  struct Shapes {
    const char* name;
    std::vector<std::string> overrides;
    double goal;
  };
  const auto all_as = [](const char* convex) {
    std::vector<std::string> overrides;
    for (const char* component :
         {"parts.P", "parts.C", "parts.O", "parts.B", "grounds.Table1", "grounds.Table2"})
      overrides.push_back(std::string(component) + ".convex=" + convex);
    return overrides;
  };
  const Shapes kinds[] = {{"hulls", all_as("hull"), 0.003},
                          {"by hand, as in the file", {}, 0.006},
                          {"V-HACD", all_as("vhacd"), 0.006}};
  takt::WorkerPool pool(2);
  bool same = true;
  std::printf("\nComputation ratio at 1 ms, median of 7 runs in turns, by convex shapes and threads\n");
  std::printf(
      "  scenario           shapes                    1 thread   2 threads   goal            held  same "
      "bits\n");
  for (const char* name : {"block_assembly", "block_disassembly"}) {
    const std::string file = std::string(TAKT_CONFIG_DIR "/scenarios/") + name + ".yaml";
    for (const Shapes& shapes : kinds) {
      std::vector<double> factors[2];
      std::uint64_t hashes[2] = {};
      bool held = true;
      for (int turn = 0; turn < 14; ++turn) {
        const int two = (turn + turn / 2) & 1;  // alternates the order
        const Outcome outcome = run(file, shapes.overrides, false, two == 1 ? &pool : nullptr);
        factors[two].push_back(outcome.result.cpu_s / outcome.result.final_state.time_s);
        hashes[two] = outcome.result.final_state.state_hash;
        held = held && outcome.held;
      }
      for (auto& list : factors) std::sort(list.begin(), list.end());
      const double one = factors[0][factors[0].size() / 2], both = factors[1][factors[1].size() / 2];
      same = same && hashes[0] == hashes[1];
      std::printf("  %-18s %-24s  %.5f    %.5f     %.3f %-7s   %-4s  %s\n", name, shapes.name, one, both,
                  shapes.goal, one <= shapes.goal ? "met" : "MISSED", held ? "yes" : "no",
                  hashes[0] == hashes[1] ? "yes" : "NO");
    }
  }
  return same;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc > 1 && std::string(argv[1]) == "threads") return compare_shapes_and_threads() ? 0 : 1;
  const std::string file = argc > 1 ? argv[1] : TAKT_CONFIG_DIR "/scenarios/block_assembly.yaml";

  std::printf("Block scenario, LoD 1, one thread, controller program included\n");
  std::printf("  step      computation ratio   us per step   of which program   error mm   thesis\n");
  for (const auto& [h, thesis] :
       {std::pair{0.001, "0.093 (3.9 s), 0.31 mm"}, std::pair{0.005, "0.023 (0.97 s), 0.42 mm"}}) {
    std::vector<Outcome> runs;
    for (int i = 0; i < 5; ++i) runs.push_back(run(file, {step(h)}));
    std::sort(runs.begin(), runs.end(),
              [](const Outcome& a, const Outcome& b) { return a.result.cpu_s < b.result.cpu_s; });
    const Outcome& median = runs[runs.size() / 2];
    const double steps = static_cast<double>(median.result.statistics.steps);
    std::printf("  %5.1f ms  %-17.5f  %-12.3f  %-17.3f  %-9.6f  %s\n", 1e3 * h, median.result.cpu_s / 42.0,
                1e6 * median.result.cpu_s / steps, 1e6 * median.result.controller_s / steps,
                1e3 * median.error_m, thesis);
  }

  const Outcome timed = run(file, {step(0.001)}, true);
  const takt::SimulationStatistics& s = timed.result.statistics;
  const double per_step = 1e6 / static_cast<double>(s.steps);
  std::printf("\nTime per step by stage (us; the clock itself costs about 0.3 us of them)\n");
  std::printf(
      "  motion, poses, boxes %.3f | MPR %.3f | partner search %.4f | integration without forces %.3f | "
      "forces %.3f\n",
      per_step * (s.connections_s - s.mpr_s - s.partner_search_s), per_step * s.mpr_s,
      per_step * s.partner_search_s, per_step * (s.integration_s - s.forces_s), per_step * s.forces_s);
  std::printf("  MPR calls made %llu, skipped because neither side moved %llu; partner searches %llu\n",
              static_cast<unsigned long long>(s.mpr_calls), static_cast<unsigned long long>(s.mpr_skipped),
              static_cast<unsigned long long>(s.partner_searches));

  std::printf(
      "\nLargest step that holds (thesis: 5 ms holds, 6 ms breaks; closed form 2 / sqrt(g / 0.1 mm) = 6.39 "
      "ms)\n");
  for (const bool feed_forward : {true, false}) {
    const char* law = feed_forward ? "feed-forward" : "thesis' law";
    const std::string choice =
        std::string("interaction.weight_feed_forward=") + (feed_forward ? "true" : "false");
    try {
      for (double h = 0.001; h < 0.0105; h += 0.0005) {
        const Outcome outcome = run(file, {step(h), choice});
        std::printf("  %-17s %4.1f ms: %s, error %.4f mm\n", law, 1e3 * h,
                    outcome.held ? "holds" : "connection broken or unstable", 1e3 * outcome.error_m);
        if (!outcome.held || outcome.error_m > 1e-3) break;
      }
    } catch (const takt::ScenarioError& refused) {
      std::printf("  %-17s refused: %s\n", law, refused.what());
    }
  }
  return compare_shapes_and_threads() ? 0 : 1;
}

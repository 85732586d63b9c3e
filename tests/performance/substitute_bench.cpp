// Table 5.2 of the thesis on our block scenario: three interaction algorithms, with the thesis' law and with
// weight feed-forward; largest step that holds, computation time and largest position error at given steps.
//
// A run holds (criteria of thesis 5.1.2) if every state stays finite, every Part always hangs on something,
// every connection that a run at 0.1 ms has closed is closed, and the Parts end within 1 mm of where that run
// leaves them. The error printed is that against the analytic places, marked where it is above 1 mm.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "server/contact/connections.h"
#include "server/headless/headless_run.h"
#include "server/headless/report.h"
#include "server/scenario/scenario_builder.h"

namespace {

constexpr double kReferenceStep_s = 1e-4;
constexpr double kGrid_s = 0.05;  // between comparisons of the connections
constexpr double kBroken_m = 1e-3;

using Keys = std::set<takt::ConnectionKey>;

struct Outcome {
  double error_m = 0.0, cpu_s = 0.0;
  bool carried = true;  // finite, and every Part always on something
  std::vector<Keys> connections;
  std::vector<takt::Vec3> ends;
};

/// One line of settings; `levels` leaves room for the rows of other levels of detail.
struct Setting {
  int level_of_detail = 1;
  std::string algorithm;
  bool feed_forward = false;
  bool reduced = false;
};

Outcome run(const std::string& file, const Setting& setting, const std::vector<std::string>& more, double h) {
  takt::ScenarioOptions options;
  options.overrides = more;
  options.overrides.push_back("solver.step_s=" + std::to_string(h));
  options.overrides.push_back("interaction.algorithm=" + setting.algorithm);
  options.overrides.push_back(std::string("interaction.weight_feed_forward=") +
                              (setting.feed_forward ? "true" : "false"));
  if (setting.reduced) {
    // Stiffness k = m g / error less 59 %, damping d = 2 D sqrt(m k) less 77 %.
    options.overrides.push_back("interaction.allowed_position_error_m=" + std::to_string(1e-4 / 0.41));
    options.overrides.push_back("interaction.damping_ratio=" + std::to_string(0.23 / std::sqrt(0.41)));
  }
  const takt::Scenario scenario = takt::read_scenario(file, options);
  const auto cell = takt::build_cell(scenario);
  takt::Simulation simulation(cell);
  takt::HeadlessOptions headless;
  headless.duration_s = scenario.duration_s;
  headless.program = scenario.controller_program;
  Outcome outcome;
  const takt::HeadlessResult result =
      takt::run_headless(simulation, scenario, headless, [&](const takt::Simulation& s) {
        if (s.time_s() < kGrid_s * static_cast<double>(outcome.connections.size()) - 1e-9) return;
        Keys& keys = outcome.connections.emplace_back();
        for (const takt::PairConnection& pair : s.connections()) keys.insert(pair.key());
      });
  outcome.cpu_s = result.cpu_s;
  outcome.error_m = takt::max_position_error_m(scenario, cell->description, result.final_state);
  outcome.carried = result.fault.empty();
  for (const auto& change : result.changes) outcome.carried = outcome.carried && change.to >= 0;
  for (const takt::ExpectedPose& expected : scenario.expected) {
    const int id = cell->description.find_component(expected.part);
    outcome.ends.push_back(result.final_state.components[static_cast<std::size_t>(id)].p_WB);
  }
  return outcome;
}

bool holds(const Outcome& outcome, const Outcome& reference) {
  if (!outcome.carried) return false;
  for (std::size_t i = 0; i < outcome.ends.size(); ++i)
    if (!((outcome.ends[i] - reference.ends[i]).norm() <= kBroken_m)) return false;
  const auto& expected = reference.connections;
  for (std::size_t i = 1; i + 1 < std::min(expected.size(), outcome.connections.size()); ++i) {
    for (const takt::ConnectionKey& key : expected[i]) {
      // What opens or closes just then may do so a little earlier or later.
      if (expected[i - 1].count(key) == 0 || expected[i + 1].count(key) == 0) continue;
      if (outcome.connections[i].count(key) == 0) return false;
    }
  }
  return true;
}

struct Thesis {
  std::string algorithm;
  bool reduced;
  double h;
  const char* figures;
};
// Table 5.2, LoD 1.
const std::vector<Thesis> kThesis{
    {"partner_search", false, 0.005, "0.97 s, 0.42 mm"},
    {"partner_search", false, 0.001, "4.00 s, 0.31 mm"},
    {"partner_search", false, 0.0007, "4.96 s, 0.30 mm"},
    {"extended_substitute_force", false, 0.005, "contact broken"},
    {"extended_substitute_force", false, 0.0007, "3.98 s, 1.30 mm"},
    {"extended_substitute_force", true, 0.005, "0.76 s, 3.86 mm"},
};
const char* thesis_figures(const Setting& s, double h) {
  for (const Thesis& t : kThesis)
    if (t.algorithm == s.algorithm && t.reduced == s.reduced && t.h == h) return t.figures;
  return "-";
}
const char* thesis_limit(const Setting& s) {
  if (s.reduced) return s.algorithm == "extended_substitute_force" ? "5 ms holds" : "-";
  if (s.algorithm == "partner_search") return "5 ms holds, 6 ms breaks";
  if (s.algorithm == "extended_substitute_force") return "0.7 ms holds, 0.8 ms breaks";
  return "-";
}

/// Holds up to, breaks at (ms), on a grid of 0.05 ms below 1.5 ms and 0.25 ms above.
void search_limit(const std::string& file, const Setting& setting, const std::vector<std::string>& more,
                  const Outcome& reference) {
  int last = 0;
  for (int h_us = 200; h_us <= 12000; h_us += h_us < 1500 ? 50 : 250) {
    const Outcome outcome = run(file, setting, more, 1e-6 * h_us);
    if (!holds(outcome, reference)) {
      std::printf("    largest step  %-32s", last == 0 ? "below 0.2 ms" : "");
      if (last != 0)
        std::printf("\r    largest step  %.2f ms holds, %.2f ms breaks     ", 1e-3 * last, 1e-3 * h_us);
      std::printf("  thesis: %s\n", thesis_limit(setting));
      return;
    }
    last = h_us;
  }
  std::printf("    largest step  %.2f ms and more                    thesis: %s\n", 1e-3 * last,
              thesis_limit(setting));
}

void print_setting(const std::string& file, const Setting& setting, const std::vector<std::string>& more) {
  std::printf("\n  LoD %d  %-26s %-13s k_B %5.0f N/m\n", setting.level_of_detail, setting.algorithm.c_str(),
              setting.feed_forward ? "feed-forward" : "thesis' law", setting.reduced ? 40207.0 : 98066.5);
  const Outcome reference = run(file, setting, more, kReferenceStep_s);
  if (!reference.carried) {
    std::printf("    breaks at 0.1 ms already\n");
    return;
  }
  search_limit(file, setting, more, reference);
  for (const double h : {0.005, 0.001, 0.0007}) {
    std::vector<double> times;
    Outcome outcome;
    for (int i = 0; i < 3; ++i) {
      outcome = run(file, setting, more, h);
      times.push_back(outcome.cpu_s);
    }
    std::sort(times.begin(), times.end());
    if (holds(outcome, reference))
      std::printf("    %4.1f ms       %.3f s, %8.5f mm%s          thesis: %s\n", 1e3 * h, times[1],
                  1e3 * outcome.error_m, outcome.error_m > 1e-3 ? " (1)" : "    ",
                  thesis_figures(setting, h));
    else
      std::printf("    %4.1f ms       contact broken                  thesis: %s\n", 1e3 * h,
                  thesis_figures(setting, h));
    std::fflush(stdout);
  }
}

}  // namespace

int main(int argc, char** argv) {
  std::string file = TAKT_CONFIG_DIR "/scenarios/block_assembly.yaml";
  std::vector<std::string> more;
  for (int i = 1; i < argc; ++i) {
    if (std::string(argv[i]) == "--hulls")
      more = {"parts.O.convex=hull", "parts.B.convex=hull"};
    else
      file = argv[i];
  }
  std::printf(
      "Block scenario, LoD 1, 42 s, solver rk2, one thread, computation time with controller program; "
      "collision "
      "check by %s\nThesis: Table 5.2 (Dymola, i7-11700K). (1): final places off by more than 1 mm.\n",
      more.empty() ? "the scenario's convex parts (--hulls: by plain hulls, as in the thesis)"
                   : "plain hulls");
  for (const bool feed_forward : {false, true})
    for (const char* algorithm : {"partner_search", "extended_substitute_force", "substitute_force"})
      print_setting(file, {1, algorithm, feed_forward, false}, more);
  std::printf("\nStiffness less 59 %%, damping less 77 %%\n");
  for (const bool feed_forward : {false, true})
    for (const char* algorithm : {"partner_search", "extended_substitute_force", "substitute_force"})
      print_setting(file, {1, algorithm, feed_forward, true}, more);
  return 0;
}

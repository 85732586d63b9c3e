// Table 5.2 of the thesis on our block scenario: three interaction algorithms, with the thesis' law and with
// weight feed-forward; largest step that holds, computation time and largest position error at given steps.
//
// A run holds (criteria of thesis 5.1.2) if every state stays finite, every Part always has a holder, every
// connection that a run at 0.1 ms has closed is closed, and the Parts end within 1 mm of their places in that
// run. The printed error is that against the analytic places, marked if it is above 1 mm.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <set>
#include <string>
#include <vector>

#include "server/contact/holding/connections.h"
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
  bool finite = true;
  int dropped = 0;  // number of times that a Part had no holder
  std::vector<Keys> connections;
  std::vector<takt::Vec3> ends;
};

/// Parameters of one block of the table.
struct Setting {
  int level_of_detail = 1;
  std::string algorithm;
  bool feed_forward = false;
  bool reduced = false;
};

std::string text(double value) {
  char buffer[32];
  std::snprintf(buffer, sizeof(buffer), "%.12g", value);
  return buffer;
}

Outcome run(const std::string& file, const Setting& setting, const std::vector<std::string>& more, double h) {
  takt::ScenarioOptions options;
  options.overrides = more;
  options.overrides.push_back("solver.step_s=" + text(h));
  options.overrides.push_back("interaction.algorithm=" + setting.algorithm);
  options.overrides.push_back(std::string("interaction.weight_feed_forward=") +
                              (setting.feed_forward ? "true" : "false"));
  if (setting.reduced) {
    // Stiffness k = m g / error less 59 %, damping d = 2 D sqrt(m k) less 77 %.
    options.overrides.push_back("interaction.allowed_position_error_m=" + text(1e-4 / 0.41));
    options.overrides.push_back("interaction.damping_ratio=" + text(0.23 / std::sqrt(0.41)));
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
  outcome.finite = result.fault.empty();
  for (const auto& change : result.changes) outcome.dropped += change.to < 0 ? 1 : 0;
  for (const takt::ExpectedPose& expected : scenario.expected) {
    const int id = cell->description.find_component(expected.part);
    outcome.ends.push_back(result.final_state.components[static_cast<std::size_t>(id)].p_WB);
  }
  return outcome;
}

bool holds(const Outcome& outcome, const Outcome& reference) {
  if (!outcome.finite || outcome.dropped > 0) return false;
  for (std::size_t i = 0; i < outcome.ends.size(); ++i)
    if (!((outcome.ends[i] - reference.ends[i]).norm() <= kBroken_m)) return false;
  const auto& expected = reference.connections;
  for (std::size_t i = 1; i + 1 < std::min(expected.size(), outcome.connections.size()); ++i) {
    for (const takt::ConnectionKey& key : expected[i]) {
      // A connection that changes at that time may do so a little earlier or later.
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

/// "holds up to, breaks at" in ms, on a grid of 0.05 ms below 1.5 ms and 0.25 ms above.
std::string largest_step(const std::string& file, const Setting& setting,
                         const std::vector<std::string>& more, const Outcome& reference) {
  int last_us = 0;
  for (int h_us = 200; h_us <= 12000; h_us += h_us < 1500 ? 50 : 250) {
    if (holds(run(file, setting, more, 1e-6 * h_us), reference)) {
      last_us = h_us;
    } else {
      return (last_us == 0 ? "none" : text(1e-3 * last_us) + " ms") + " holds, " + text(1e-3 * h_us) +
             " ms breaks";
    }
  }
  return text(1e-3 * last_us) + " ms holds";
}

std::string verdict(const Outcome& outcome, const Outcome& reference) {
  char buffer[96];
  if (!outcome.finite) return "broken: not finite";
  if (outcome.error_m > 1.0) return "broken: Parts lost";
  if (holds(outcome, reference))
    std::snprintf(buffer, sizeof(buffer), "%.3f s, %.5f mm%s", outcome.cpu_s, 1e3 * outcome.error_m,
                  outcome.error_m > kBroken_m ? " (1)" : "");
  else
    std::snprintf(buffer, sizeof(buffer), "broken: dropped %d times, %.2f mm", outcome.dropped,
                  1e3 * outcome.error_m);
  return buffer;
}

void print_setting(const std::string& file, const Setting& setting, const std::vector<std::string>& more) {
  const auto line = [&](const std::string& what, const std::string& ours, const char* thesis) {
    std::printf("%d    %-26s %-13s %-7s %-9s %-36s %s\n", setting.level_of_detail, setting.algorithm.c_str(),
                setting.feed_forward ? "feed-forward" : "thesis' law", setting.reduced ? "40207" : "98066.5",
                what.c_str(), ours.c_str(), thesis);
    std::fflush(stdout);
  };
  const Outcome reference = run(file, setting, more, kReferenceStep_s);
  line("largest", largest_step(file, setting, more, reference), thesis_limit(setting));
  for (const double h : {0.005, 0.001, 0.0007}) {
    std::vector<Outcome> runs;
    for (int i = 0; i < 3; ++i) runs.push_back(run(file, setting, more, h));
    std::sort(runs.begin(), runs.end(), [](const Outcome& a, const Outcome& b) { return a.cpu_s < b.cpu_s; });
    line(text(1e3 * h) + " ms", verdict(runs[1], reference), thesis_figures(setting, h));
  }
}

/// Where and why the figures differ, for the scenario as it is.
constexpr const char* kWhy = R"(
Where and why ours differ from the thesis
- Steps. Partner search holds nearly to the closed form 2 / sqrt(g / 0.1 mm) = 6.39 ms, the extended algorithm to
  the fastest mode of its chains: 0.8 ms (thesis: 0.7), with the plain hulls that the thesis uses (--hulls) 0.6 ms,
  for then P hangs on B as well as on O. Weight does not enter stability; feed-forward moves the limit by a notch.
- Errors, thesis' law. Every connection that closes sags m g / k again: 0.1 mm per regrasp, seven for P, hence
  0.70 mm with partner search at every step size. The thesis has 0.31 to 0.42 mm with grips and blocks of its own,
  which are not published in full. Chains add up as (3.24) and (3.25) say: 1.43 mm (thesis: 1.30), with hulls 1.16;
  with stiffness less 59 % 1 / 0.41 times as much, 3.48 mm (thesis: 3.86).
- Errors, feed-forward. No spring carries weight, whichever component holds a Part: partner search and the extended algorithm
  end below 1e-5 mm.
- Soft springs at 5 ms. These constants are under-damped (ratio 0.36). When the arm starts with the whole assembly,
  Parts swing by more than the contact margin of 0.2 mm and lose touch for some steps. The sag of the thesis' law
  presses them into their seats, so there it happens at 5 ms, with feed-forward at 2.5 ms; with hulls, which
  overlap deeply, no touch is lost and both hold to 4.5 ms (thesis: 5).
- The plain algorithm, which Table 5.2 leaves out, connects a Part with what it is put on while the gripper still
  holds it, 0.2 mm early, and the two share it. With feed-forward it stays there, at the edge of touch, where
  connections open and close for ever; the sag of the thesis' law ends that. With hulls O would be connected with
  B far above its seat, and the assembly is torn apart.
- Time. Nothing is in between here and pairs that have not moved are skipped: 20 to 35 times less. The partner
  search is not slower than the extended algorithm, as it is in the thesis: it is asked only when a contact changes.
- The thesis' flowchart (Fig. 3.11) asks each side of a pair by itself; ours connects only where both sides count
  each other, so that forces balance (server/contact/holding/connection_rules.h).)";

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
  std::printf("Block scenario, 42 s, rk2, one thread, controller program included; collision check by %s\n",
              more.empty() ? "the scenario's convex parts (--hulls: plain hulls)" : "plain hulls");
  std::printf(
      "Thesis: Table 5.2. (1): an end place off by more than 1 mm. 40207 N/m: damping less 77 %% too.\n");
  std::printf("%-4s %-26s %-13s %-7s %-9s %-36s %s\n", "LoD", "algorithm", "law", "k_B N/m", "step", "takt",
              "thesis");
  for (const bool reduced : {false, true})
    for (const bool feed_forward : {false, true})
      for (const char* algorithm : {"partner_search", "extended_substitute_force", "substitute_force"})
        print_setting(file, {1, algorithm, feed_forward, reduced}, more);
  if (more.empty()) std::puts(kWhy);
  return 0;
}

#include "tests/performance/contact_scenes_bench.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <map>
#include <random>
#include <vector>

#include "server/headless/headless_run.h"
#include "server/scenario/scenario_builder.h"

namespace takt::bench {
namespace {

namespace fs = std::filesystem;

struct Solver {
  const char* name;
  std::vector<std::string> overrides;
};

const std::vector<Solver>& solvers() {
  static const std::vector<Solver> list{
      {"of the file", {}},
      {"implicit 1 ms", {"solver.method=implicit", "solver.step_s=0.001"}},
      {"cvode 1e-6", {"solver.method=cvode", "solver.tolerance=1e-6"}},
  };
  return list;
}

/// If one evaluation takes most of a step, only methods with few evaluations are practical.
const std::vector<Solver>& solvers_of_large() {
  static const std::vector<Solver> list{
      {"of the file", {}},
      {"implicit 1 ms", {"solver.method=implicit", "solver.step_s=0.001"}},
      {"implicit 2 ms", {"solver.method=implicit", "solver.step_s=0.002"}},
  };
  return list;
}

/// Computation ratios that the scenes should reach with the solver of the file.
double goal(const std::string& scene) {
  static const std::map<std::string, double> goals{
      {"stack_of_ten", 0.003},    {"grasp_and_lift", 0.01},  {"peg_in_hole_100um", 0.01},
      {"peg_in_hole_10um", 0.01}, {"peg_in_hole_1um", 0.01}, {"peg_in_hole_100um, 100 000 triangles", 0.05}};
  const auto found = goals.find(scene);
  return found == goals.end() ? 0.0 : found->second;
}

struct Outcome {
  HeadlessResult result;
  double end_error_m = 0.0;
  double ratio_at_rest = 0.0;  ///< computation ratio of the last half
};

Outcome run(const Scenario& scenario, const std::shared_ptr<const CellModel>& cell, bool stage_times) {
  Simulation simulation(cell);
  HeadlessOptions options;
  options.duration_s = scenario.duration_s;
  options.program = scenario.controller_program;
  if (stage_times) simulation.set_stage_clock(processor_s);
  double half_s = 0.0, half_cpu_s = 0.0;
  Outcome outcome;
  outcome.result = run_headless(simulation, scenario, options, [&](const Simulation& s) {
    if (half_s == 0.0 && s.time_s() >= 0.5 * scenario.duration_s)
      half_s = s.time_s(), half_cpu_s = processor_s();
  });
  if (scenario.duration_s > half_s)
    outcome.ratio_at_rest = (processor_s() - half_cpu_s) / (scenario.duration_s - half_s);
  for (const ExpectedPose& expected : scenario.expected) {
    const auto id = static_cast<std::size_t>(cell->description.find_component(expected.part));
    outcome.end_error_m = std::max(
        outcome.end_error_m, pose_error(outcome.result.final_state.components[id], expected.X_WB).position_m);
  }
  return outcome;
}

void print_goal(double factor, double wanted) {
  if (wanted > 0.0) std::printf("  %.3f %s", wanted, factor <= wanted ? "reached" : "missed");
  std::printf("\n");
}

void measure(const std::string& title, const fs::path& file, const std::vector<std::string>& changes,
             const std::vector<Solver>& by, bool with_bullet) {
  std::string name = title;
  for (const Solver& solver : by) {
    ScenarioOptions options;
    options.overrides = changes;
    options.overrides.insert(options.overrides.end(), solver.overrides.begin(), solver.overrides.end());
    const Scenario scenario = read_scenario(file, options);
    const auto cell = build_cell(scenario);
    const Outcome timed = run(scenario, cell, false);
    const Outcome staged = run(scenario, cell, true);
    const ContactCallCounts& calls = staged.result.contact_counts;
    const auto evaluations = static_cast<double>(staged.result.statistics.derivative_evaluations);
    const auto made = static_cast<double>(std::max<std::uint64_t>(calls.made, 1));
    const double per_call = static_cast<double>(calls.elements) / made;
    // Forces are timed where the right-hand side is evaluated; calls for K and D are not among them.
    const auto jacobians = static_cast<double>(staged.result.statistics.solver.jacobians);
    const double elements = static_cast<double>(calls.elements) * evaluations / (evaluations + jacobians);
    const double factor = timed.result.cpu_s / scenario.duration_s;
    std::printf("%-38s %-14s %9.1f %10.2f %8.1f %9.4f %9.4f %10.4f", name.c_str(), solver.name, per_call,
                1e6 * staged.result.statistics.forces_s / evaluations,
                elements > 0.0 ? 1e9 * staged.result.statistics.forces_s / elements : 0.0, factor,
                timed.ratio_at_rest, 1e3 * timed.end_error_m);
    if (!timed.result.fault.empty()) std::printf("  %s", timed.result.fault.c_str());
    const bool at_rest = title == "stack_of_ten";
    const bool judged = solver.overrides.empty() || &by == &solvers_of_large();
    print_goal(at_rest ? timed.ratio_at_rest : factor, judged ? goal(title) : 0.0);
    std::fflush(stdout);
    name.clear();
  }
  if (!with_bullet) return;
  const Scenario scenario = read_scenario(file);
  const PeerRun peer = run_bullet(scenario, 0.004);
  if (peer.done)
    std::printf("%-38s %-14s %9s %10s %8s %9.4f %9s %10.4f\n", "", "Bullet 4 ms", "", "", "",
                peer.cpu_s / scenario.duration_s, "", 1e3 * peer.end_error_m);
  else
    std::printf("%-38s %-14s %s\n", "", "Bullet", peer.why.c_str());
}

std::vector<fs::path> files() {
  std::vector<fs::path> list;
  for (const auto& entry : fs::directory_iterator(fs::path(TAKT_CONFIG_DIR) / "scenarios" / "contact"))
    if (!entry.path().stem().string().starts_with("nut_"))
      list.push_back(entry.path());  // bench_screw runs them
  std::sort(list.begin(), list.end());
  return list;
}

}  // namespace

void contact_scenes(bool large) {
  std::printf("\n%-38s %-14s %9s %10s %8s %9s %9s %10s  %s\n", "scene", "solver", "elem/call", "us/eval",
              "ns/elem", "factor", "2nd half", "error mm", "goal (stack: second half)");
  for (const fs::path& file : files()) measure(file.stem().string(), file, {}, solvers(), true);
  if (!large) return;
  const fs::path meshes = fs::path(TAKT_SOURCE_DIR) / "build" / "large";
  const fs::path scenes = fs::path(TAKT_CONFIG_DIR) / "scenarios" / "contact";
  const auto both = [&](const char* scene, const char* part, const char* ground, const char* part_mesh,
                        const char* ground_mesh) {
    measure(std::string(scene) + ", 100 000 triangles", scenes / (std::string(scene) + ".yaml"),
            {std::string("parts.") + part + ".mesh=" + (meshes / part_mesh).string(),
             std::string("grounds.") + ground + ".mesh=" + (meshes / ground_mesh).string()},
            solvers_of_large(), false);
  };
  both("peg_in_hole_100um", "Peg", "Hole", "peg_100um_100k.obj", "hole_100k.obj");
  both("bolt_in_socket", "Bolt", "Socket", "bolt_100k.obj", "socket_100k.obj");
}

int contact_poses(int count) {
  std::uint64_t asked = 0, touching = 0, bad = 0;
  std::mt19937_64 random(20);
  const auto vector = [&random](double size) {
    std::uniform_real_distribution<double> uniform(-size, size);
    const double x = uniform(random), y = uniform(random), z = uniform(random);
    return Vec3(x, y, z);
  };
  struct Asked {
    PolygonalContact contact;
    Pose start;
  };
  std::vector<Asked> pairs;
  for (const fs::path& file : files()) {
    const auto cell = build_cell(read_scenario(file));
    std::vector<Pose> X_WB(cell->components.size());
    for (const GroundModel& ground : cell->grounds)
      X_WB[static_cast<std::size_t>(ground.component)] = ground.X_WB;
    for (const RigidBodyParameters& part : cell->parts)
      X_WB[static_cast<std::size_t>(part.body)] = part.X_WB_initial;
    for (const ContactPairModel& pair : cell->contact.pairs) {
      const auto b = static_cast<std::size_t>(pair.base), t = static_cast<std::size_t>(pair.target);
      pairs.push_back({PolygonalContact(cell->contact.surfaces[b], cell->contact.surfaces[t], pair.law,
                                        cell->contact.field(pair.target, pair.depth)),
                       X_WB[t].inverse() * X_WB[b]});
    }
  }
  ContactResult result;
  ContactJacobian jacobian;
  for (auto& [contact, start] : pairs) {
    // A walk about where the scene begins: mostly within the lists, at times far away.
    RelativeMotion m{start, {}};
    for (std::uint64_t i = 0; i < static_cast<std::uint64_t>(count) / pairs.size() + 1; ++i) {
      if (i % 200 == 0) m.X_TB = start;
      const double size = std::pow(10.0, std::uniform_real_distribution<double>(-9.0, -3.5)(random));
      m.X_TB.p += vector(size);
      const Vec3 turn = vector(10.0 * size);
      m.X_TB.R = Eigen::AngleAxisd(turn.norm(), turn.normalized()) * m.X_TB.R;
      m.V_TB_T = {vector(1.0), vector(10.0)};
      contact.evaluate(m, i % 2 == 0 ? Linearisation::secant : Linearisation::tangent, result, jacobian);
      if (i % 10 == 0) contact.accept(m);
      ++asked;
      if (result.elements > 0) ++touching;
      const bool finite = result.F_B_T.f.allFinite() && result.F_B_T.t.allFinite() &&
                          result.p_TC.allFinite() && jacobian.K.allFinite() && jacobian.D.allFinite();
      if (!finite) ++bad;
    }
  }
  std::printf("%llu random poses of %zu pairs, %llu touching: %llu answers are not finite\n",
              static_cast<unsigned long long>(asked), pairs.size(), static_cast<unsigned long long>(touching),
              static_cast<unsigned long long>(bad));
  return bad == 0 ? 0 : 1;
}

}  // namespace takt::bench

// bench_peers [PARTS]: takt with its default solver beside engines of rigid bodies, in one run. By row: computing
// time over simulated time and the error at the end. A setting of a peer is as accurate if its error is within the
// row's bound: takt's own, and at least what the row states. The ratio is takt over the cheapest such setting of all
// peers; the goal is 0.7. Bullet's settings are step, iterations, and whether friction has both directions (x 2).
// PARTS: the largest number of Parts on tables, 1000 unless given. Then run bench_dynamics and bench_collision for
// arms and collision queries (./dev bench peers does).
//
// Errors are those of closed forms. Bodies at rest and in a hole: the distance from where rigid bodies stand, of which
// takt's elastic layer takes the weight over its stiffness. Pushed Parts: they stand in front of what pushed them.
// Sliding Parts: half the acceleration times the time squared. A grip: the block is as high as the carriage.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <limits>
#include <string>
#include <vector>

#include "server/headless/headless_run.h"
#include "server/scenario/scenario_builder.h"
#include "tests/performance/box_file.h"
#include "tests/performance/peers.h"
#include "tests/performance/pushed_scene.h"

namespace takt::bench {
namespace {

namespace fs = std::filesystem;

constexpr double kRough_m = 1e-3;  ///< a second bound that is printed
constexpr double kGoal = 0.7, kGravity = 9.80665, kNone = std::numeric_limits<double>::infinity();
constexpr int kTurns = 3;

struct Measured {
  double ratio = 0.0;  ///< computing time over simulated time
  double error_m = 0.0;
  std::string fault{};
};

using ErrorOf = std::function<double(const std::vector<Pose>&)>;

double farthest(const PeerScene& scene, const std::vector<Pose>& end) {
  double worst = 0.0;
  for (std::size_t i = 0; i < end.size(); ++i)
    if (scene.bodies[i].mass_kg > 0.0) worst = std::max(worst, (end[i].p - scene.bodies[i].X_WB.p).norm());
  return worst;
}

/// The scene as a scenario of takt: a mesh for each body.
Scenario scenario_of(const PeerScene& scene, const std::string& name) {
  const fs::path directory = fs::path(TAKT_SOURCE_DIR) / "build" / "peers" / name;
  fs::create_directories(directory);
  std::ofstream out(directory / "scene.yaml");
  const Vec3& g = scene.gravity_m_per_s2;
  out.precision(17);
  out << "takt_scenario: 1\nname: " << name
      << "\ndescription: boxes\nduration_s: " << scene.begin_s + scene.duration_s
      << "\nworld: {gravity_m_per_s2: [" << g.x() << ", " << g.y() << ", " << g.z()
      << "]}\nsolver: {step_s: 0.008}\n"
      << "processes:\n  cell: {level_of_detail: 3, members: all}\ncontact:\n  defaults: {friction: "
      << scene.friction << "}\n";
  if (!scene.sleeping) out << "sleeping: {method: never}\n";
  for (const bool part : {true, false}) {
    out << (part ? "parts:\n" : "grounds:\n");
    for (std::size_t i = 0; i < scene.bodies.size(); ++i) {
      const PeerBody& body = scene.bodies[i];
      if ((body.mass_kg > 0.0) != part) continue;
      const std::string mesh = "box" + std::to_string(i) + ".obj";
      write_box(directory / mesh, -0.5 * body.size_m, 0.5 * body.size_m);
      const Vec3& p = body.X_WB.p;
      out << "  B" << i << ": {mesh: " << mesh;
      if (part) out << ", mass_kg: " << body.mass_kg << ", hierarchy: " << scene.bodies.size() - i;
      out << ", pose: {position_m: [" << p.x() << ", " << p.y() << ", " << p.z() << "]}}\n";
    }
  }
  out.close();
  return read_scenario(directory / "scene.yaml");
}

Measured run_takt(const PeerScene& scene, const std::string& name, const ErrorOf& error) {
  const Scenario scenario = scenario_of(scene, name);
  const auto cell = build_cell(scenario);
  Measured best{kNone};
  for (int turn = 0; turn < kTurns; ++turn) {
    Simulation simulation(cell);
    double begin = processor_s();
    bool begun = scene.begin_s == 0.0;
    while (simulation.time_s() < scene.begin_s + scene.duration_s - 1e-9) {
      if (!begun && simulation.time_s() > scene.begin_s - 1e-9) begun = true, begin = processor_s();
      if (!simulation.step({})) break;
    }
    best.ratio = std::min(best.ratio, (processor_s() - begin) / scene.duration_s);
    const Snapshot state = simulation.make_snapshot();
    std::vector<Pose> end;
    for (std::size_t i = 0; i < scene.bodies.size(); ++i) {
      const auto id = static_cast<std::size_t>(cell->description.find_component("B" + std::to_string(i)));
      const ComponentSample& sample = state.components[id];
      end.push_back({sample.q_WB.toRotationMatrix(), sample.p_WB});
    }
    best.error_m = error(end);
    best.fault = simulation.fault();
  }
  return best;
}

/// Prints the peers and, at last, the ratio to the best of them.
void compare(const char* title, const Measured& takt, const PeerScene& scene, double least_bound_m,
             const ErrorOf& error) {
  const double bound_m = std::max(takt.error_m, least_bound_m);
  std::printf("%-34s %-22s %9.5f %12.4f  %s\n", title, "takt, default solver", takt.ratio, 1e3 * takt.error_m,
              takt.fault.c_str());
  double best = kNone, rough = kNone;
  for (const Peer& peer : {bullet(), ode()}) {
    if (peer.run == nullptr) {
      std::printf("%-34s %-22s not installed (%s)\n", "", peer.name, peer.package);
      continue;
    }
    for (const PeerSetting& setting : peer.settings) {
      Measured run{kNone};
      for (int turn = 0; turn < kTurns; ++turn) {
        const PeerEnd end = peer.run(scene, setting);
        run.ratio = std::min(run.ratio, end.cpu_s / scene.duration_s);
        run.error_m = error(end.X_WB);
        if (run.ratio > 2.0 * best) break;
      }
      const bool accurate = run.error_m <= bound_m;
      char name[64];
      std::snprintf(name, sizeof(name), "%s %g ms, %s%s", peer.name, 1e3 * setting.step_s,
                    setting.iterations > 0 ? std::to_string(setting.iterations).c_str() : "exact",
                    setting.both_directions ? " x 2" : "");
      std::printf("%-34s %-22s %9.5f %12.4f  %s\n", "", name, run.ratio, 1e3 * run.error_m,
                  accurate ? "" : "less accurate");
      if (accurate) best = std::min(best, run.ratio);
      if (run.error_m <= kRough_m) rough = std::min(rough, run.ratio);
    }
  }
  if (best == kNone)
    std::printf("%-34s no peer is within %.4f mm", "", 1e3 * bound_m);
  else
    std::printf("%-34s ratio %.2f of the best within %.4f mm (goal %.1f, %s)", "", takt.ratio / best,
                1e3 * bound_m, kGoal, takt.ratio <= kGoal * best ? "reached" : "missed");
  if (rough < kNone) std::printf("; %.2f of the best within %g mm", takt.ratio / rough, 1e3 * kRough_m);
  std::printf("\n\n");
  std::fflush(stdout);
}

/// Ten slabs on one another; the lowest is pressed in by 4.3 um, the highest is 24 um lower (stack_of_ten.yaml).
void stack() {
  PeerScene scene;
  scene.duration_s = 10.0;
  scene.bodies.push_back(box({0.2, 0.2, 0.02}, {0.0, 0.0, -0.01}, 0.0));
  for (int i = 0; i < 10; ++i)
    scene.bodies.push_back(box({0.06, 0.06, 0.02}, {0.0, 0.0, 0.01 + 0.02 * i}, 0.2));
  const ErrorOf error = [&](const std::vector<Pose>& end) { return farthest(scene, end); };
  compare("ten slabs at rest, none sleeps", run_takt(scene, "stack", error), scene, 1e-6, error);
}

/// A square peg that is 5 mm in its hole, with a clearance of 0.1 mm on each side, falls to the floor.
void peg() {
  constexpr double kHole_m = 0.0202, kWall_m = 0.02, kDepth_m = 0.03;
  PeerScene scene;
  scene.friction = 0.1;
  scene.duration_s = 1.5;
  scene.bodies.push_back(box({0.02, 0.02, 0.06}, {0.00005, 0.0, kDepth_m - 0.005 + 0.03}, 0.12));
  scene.bodies.push_back(box({0.1, 0.1, 0.02}, {0.0, 0.0, -0.01}, 0.0));
  const double beside_m = 0.5 * (kHole_m + kWall_m), length_m = kHole_m + 2.0 * kWall_m;
  for (const double side : {-1.0, 1.0}) {
    scene.bodies.push_back(box({kWall_m, length_m, kDepth_m}, {side * beside_m, 0.0, 0.5 * kDepth_m}, 0.0));
    scene.bodies.push_back(box({kHole_m, kWall_m, kDepth_m}, {0.0, side * beside_m, 0.5 * kDepth_m}, 0.0));
  }
  const ErrorOf error = [](const std::vector<Pose>& end) {
    const Vec3& p = end.front().p;
    const double clearance_m = 0.5 * (kHole_m - 0.02);
    return std::max({std::abs(p.z() - 0.03), std::abs(p.x()) - clearance_m, std::abs(p.y()) - clearance_m});
  };
  compare("peg into a blind hole", run_takt(scene, "peg", error), scene, 1e-5, error);
}

/// N boxes of 40 mm slide down a plane of 20 degrees.
void sliding(int count) {
  constexpr double kSlope = 20.0 / 180.0 * 3.14159265358979;
  PeerScene scene;
  scene.gravity_m_per_s2 = {kGravity * std::sin(kSlope), 0.0, -kGravity * std::cos(kSlope)};
  const double far_m = 0.5 * kGravity * (std::sin(kSlope) - scene.friction * std::cos(kSlope));
  scene.bodies.push_back(box({1.8, 1.2, 0.05}, {0.3, 0.0, -0.025}, 0.0));
  for (int i = 0; i < count; ++i)
    scene.bodies.push_back(
        box({0.04, 0.04, 0.04}, {-0.5 + 0.08 * (i % 10), -0.45 + 0.1 * (i / 10), 0.02}, 0.2));
  const ErrorOf error = [&](const std::vector<Pose>& end) {
    double worst = 0.0;
    for (std::size_t i = 1; i < end.size(); ++i)
      worst = std::max(worst, std::abs(end[i].p.x() - scene.bodies[i].X_WB.p.x() - far_m));
    return worst;
  };
  const std::string name = std::to_string(count) + " parts slide";
  compare(name.c_str(), run_takt(scene, "sliding_" + std::to_string(count), error), scene, 1e-3, error);
}

/// N Parts on tables, two of them pushed 32 mm, the others asleep (tests/support/pushed_crowd.h).
void pushed(int count) {
  using test::PushedCrowd;
  constexpr double kTimed_s = 2.0;
  const PushedScene peers(count, kTimed_s);
  Measured takt{kNone};
  for (int turn = 0; turn < kTurns; ++turn) {
    PushedCrowd crowd(count);
    Simulation simulation(crowd.model());
    run_until(PushedCrowd::kBegin_s, crowd, simulation);
    takt.ratio =
        std::min(takt.ratio, run_until(PushedCrowd::kBegin_s + kTimed_s, crowd, simulation) / kTimed_s);
    takt.fault = simulation.fault();
    std::vector<Pose> end(peers.scene.bodies.size());
    const Snapshot state = simulation.make_snapshot();
    for (int i = 0; i < count; ++i) {
      const int id = crowd.model()->description.find_component("P" + std::to_string(i));
      end[peers.first + static_cast<std::size_t>(i)].p = state.components[static_cast<std::size_t>(id)].p_WB;
    }
    takt.error_m = peers.error_m(end);
  }
  const std::string name = std::to_string(count) + " parts, two pushed, sleeping";
  compare(name.c_str(), takt, peers.scene, 2e-4,
          [&peers](const std::vector<Pose>& end) { return peers.error_m(end); });
}

/// A block is gripped, lifted by 150 mm and held. takt simulates the arm and the drives that carry the gripper too
/// (grasp_and_lift.yaml); the peers have a carriage that moves by itself and jaws on it.
void grasp() {
  ScenarioOptions options;
  options.overrides = {"solver.method=" + std::string(kAutomaticSolver), "sleeping.method=never"};
  const Scenario scenario =
      read_scenario(fs::path(TAKT_CONFIG_DIR) / "scenarios" / "contact" / "grasp_and_lift.yaml", options);
  const auto cell = build_cell(scenario);
  Measured takt{kNone};
  for (int turn = 0; turn < kTurns; ++turn) {
    Simulation simulation(cell);
    HeadlessOptions run;
    run.duration_s = scenario.duration_s;
    run.program = scenario.controller_program;
    const HeadlessResult result = run_headless(simulation, scenario, run);
    takt.ratio = std::min(takt.ratio, result.cpu_s / scenario.duration_s);
    takt.fault = result.fault;
    const ExpectedPose& expected = scenario.expected.front();
    const auto id = static_cast<std::size_t>(cell->description.find_component(expected.part));
    takt.error_m = pose_error(result.final_state.components[id], expected.X_WB).position_m;
  }
  constexpr double kLift_m = 0.15, kJaw_m = 0.01, kForce_N = 150.0;
  PeerScene scene;
  scene.friction = 0.9;
  scene.duration_s = scenario.duration_s;
  scene.bodies.push_back(box({0.4, 0.4, 0.05}, {0.0, 0.0, -0.025}, 0.0));
  scene.bodies.push_back(box({0.06, 0.06, 0.06}, {0.0, 0.0, 0.03}, 0.3));
  PeerBody& carriage = scene.bodies.emplace_back(box({0.2, 0.06, 0.02}, {0.0, 0.0, 0.12}, 0.0));
  carriage.v_W = [](double t) { return Vec3(0.0, 0.0, t > 4.2 && t < 5.8 ? kLift_m / 1.6 : 0.0); };
  for (const double side : {-1.0, 1.0}) {
    PeerBody& jaw = scene.bodies.emplace_back(
        box({kJaw_m, 0.03, 0.06}, {side * (0.03 + 0.5 * kJaw_m + 1e-4), 0.0, 0.06}, 0.3));
    jaw.slides_on = 2;
    jaw.axis_W = Vec3(-side, 0.0, 0.0);
    jaw.force_N = kForce_N;
  }
  const ErrorOf error = [](const std::vector<Pose>& end) {
    return std::abs(end[1].p.z() - end[2].p.z() + 0.12 - 0.03);
  };
  compare("block gripped, lifted, held", takt, scene, 1e-5, error);
}

}  // namespace
}  // namespace takt::bench

int main(int argc, char** argv) {
  using namespace takt::bench;
  const int most = argc > 1 ? std::atoi(argv[1]) : 1000;
  if (most < 1) {
    std::fprintf(stderr, "bench_peers: found '%s'; allowed: the largest number of parts, at least 1\n",
                 argv[1]);
    return 2;
  }
  std::printf("%-34s %-22s %9s %12s\n", "scene", "engine", "time/time", "error mm");
  stack();
  grasp();
  peg();
  for (const int count : {10, 100, 1000, 3000})
    if (count <= most) pushed(count);
  for (const int count : {10, 100})
    if (count <= most) sliding(count);
  std::printf("MuJoCo and Simbody are not among the peers of this bench.\n");
  return 0;
}

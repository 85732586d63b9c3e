// bench_screw order | [alone] [M8|M10|M12|M16|M20]...: nuts on their bolts at level of detail 3, beside the closed form
// of the rigid screw. A nut that lies on the flanks of its bolt, 3 pitches above the head, turns by its weight with
//   phi'' = g L / (I / m + h L),  h = lead / 2 pi,  L = r tan(lambda - atan(mu / cos 30 deg)),
//   tan lambda = h / r,  r = d / 2 - 0.3248 pitch,
// and does not turn if tan lambda <= mu / cos 30 deg. After 0.5 s: angle, travel against lead x angle, largest
// penetration, computing time over simulated time. Bullet on the same meshes (GImpact) where it is installed, unless
// `alone`.
//
// `order`: the error of the solvers that hold patches for steps and tolerances that get smaller, after 0.1 s without
// friction, beside `cvode` with a tolerance of 1e-8, which searches at each evaluation.
#include <array>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <numbers>
#include <string>
#include <vector>

#include "config/meshes/generator/screw_meshes.h"
#include "config/meshes/generator/write_meshes.h"
#include "server/headless/headless_run.h"
#include "server/scenario/scenario_builder.h"
#include "tests/performance/contact_scenes_bench.h"
#include "tests/support/solid_mesh.h"

namespace takt {
namespace {

namespace fs = std::filesystem;

constexpr double kPi = std::numbers::pi;
constexpr double kDuration_s = 0.5, kDensity_kg_per_m3 = 8000.0;

struct Screw {
  double lead_m, radius_m;
  double tan_lead() const { return lead_m / (2.0 * kPi * radius_m); }
  double limit() const { return tan_lead() * std::cos(kPi / 6.0); }
  /// Angle (rad) of a nut with this moment of inertia per mass (m^2) after the duration.
  double angle(double inertia_m2, double friction, double g) const {
    const double h = lead_m / (2.0 * kPi);
    const double lever =
        radius_m * std::tan(std::atan(tan_lead()) - std::atan(friction / std::cos(kPi / 6.0)));
    return lever > 0.0 ? 0.5 * kDuration_s * kDuration_s * g * lever / (inertia_m2 + h * lever) : 0.0;
  }
};

/// nut_runs_down.yaml with other values.
struct NutScene {
  Scenario scenario;
  std::shared_ptr<const CellModel> cell;
  std::size_t nut = 0;

  explicit NutScene(std::vector<std::string> overrides) {
    ScenarioOptions options;
    options.overrides = std::move(overrides);
    scenario =
        read_scenario(fs::path(TAKT_CONFIG_DIR) / "scenarios" / "contact" / "nut_runs_down.yaml", options);
    cell = build_cell(scenario);
    nut = static_cast<std::size_t>(cell->description.find_component("Nut"));
  }
};

double angle_about_axis(const ComponentSample& nut) {
  const Mat3 R = nut.q_WB.toRotationMatrix();
  return std::atan2(R(1, 0), R(0, 0));
}

void measure(int size, const std::string& friction_name, double share_of_limit, double friction, bool alone,
             const std::string& law = "regularised") {
  const meshes::ScrewParameters p = meshes::iso_metric(size);
  const Screw screw{p.pitch, 0.5 * p.diameter - 0.3248 * p.pitch};
  if (share_of_limit > 0.0) friction = share_of_limit * screw.limit();
  const fs::path directory = fs::path(TAKT_SOURCE_DIR) / "build" / "screws" / ("M" + std::to_string(size));
  fs::create_directories(directory);
  const meshes::Solid bolt = meshes::make_bolt(p), nut = meshes::make_nut(p);
  meshes::write_solids(directory, "bolt", "Made by bench_screw.", {bolt});
  meshes::write_solids(directory, "nut", "Made by bench_screw.", {nut});
  const double start_m = 3.0 * p.pitch - p.clearance * std::tan(kPi / 6.0);
  const NutScene scene({"parts.Nut.mesh=" + (directory / "nut.obj").string(),
                        "grounds.Bolt.mesh=" + (directory / "bolt.obj").string(),
                        "parts.Nut.mass_kg=" +
                            std::to_string(kDensity_kg_per_m3 * volume_properties(test::mesh_of(nut)).volume),
                        "parts.Nut.pose.position_m=[0,0," + std::to_string(start_m) + "]",
                        "contact.defaults.friction=" + std::to_string(friction),
                        "contact.defaults.friction_law=" + law});
  const Scenario& scenario = scene.scenario;
  const auto& cell = scene.cell;
  Simulation simulation(cell);
  HeadlessOptions run;
  run.duration_s = kDuration_s;
  const std::size_t id = scene.nut;
  bench::Turned turned;
  double deepest_m = 0.0;
  Snapshot snapshot = simulation.make_snapshot();
  // A snapshot evaluates the contacts at the end of a step, and the next step begins with the result: its time
  // is a part of the simulation's.
  const HeadlessResult result = run_headless(simulation, scenario, run, [&](const Simulation& s) {
    s.read_snapshot(snapshot);
    turned.note(angle_about_axis(snapshot.components[id]));
    for (const ContactSample& sample : snapshot.contacts.pressing())
      deepest_m = std::max(deepest_m, sample.result.largest_penetration_m);
  });
  const double inertia_m2 = cell->parts[0].I_BBcm_B(2, 2) / cell->parts[0].mass_kg;
  const double expected = -screw.angle(inertia_m2, friction, -scenario.gravity_m_per_s2.z());
  const double travel_m = result.final_state.components[id].p_WB.z() - start_m;
  const double beside_m = travel_m - p.pitch * turned.rad() / (2.0 * kPi);
  char error[32] = "";
  if (expected != 0.0)
    std::snprintf(error, sizeof(error), "%+.1f %%", 100.0 * (turned.rad() / expected - 1.0));
  std::printf("M%-3d %6zu %6zu  %-11s %9.2f %9.2f %8s %9.2f %9.2f %9.2f", size, nut.triangles.size(),
              bolt.triangles.size(), friction_name.c_str(), turned.rad() * 180.0 / kPi,
              expected * 180.0 / kPi, error, 1e6 * beside_m, 1e6 * deepest_m, result.cpu_s / kDuration_s);
  const bench::PeerRun peer = alone ? bench::PeerRun{} : bench::run_bullet(scenario, 0.001);
  if (peer.done)
    std::printf("  %9.2f %9.2f", peer.turned_rad * 180.0 / kPi, peer.cpu_s / kDuration_s);
  else if (!alone)
    std::printf("  Bullet %s", peer.why.c_str());
  std::printf("%s%s\n", result.fault.empty() ? "" : "  ", result.fault.c_str());
  std::fflush(stdout);
}

/// Angle (rad) of the M16 nut after 0.1 s.
double turned(const std::vector<std::string>& solver, double& ratio) {
  constexpr double kShort_s = 0.1;
  const NutScene scene(solver);
  Simulation simulation(scene.cell);
  HeadlessOptions run;
  run.duration_s = kShort_s;
  const HeadlessResult result = run_headless(simulation, scene.scenario, run);
  ratio = result.cpu_s / kShort_s;
  return angle_about_axis(result.final_state.components[scene.nut]);
}

void measure_order() {
  constexpr double kDegrees = 180.0 / kPi;
  double ratio = 0.0;
  const double reference = turned({"solver.method=cvode", "solver.tolerance=1e-8"}, ratio);
  std::printf("%-12s %-10s %12s %12s %10s\n%-12s %-10s %12.5f %12s %10.2f\n", "solver", "step, tol.",
              "turned deg", "error deg", "time/time", "cvode", "1e-8", reference * kDegrees, "", ratio);
  const auto print = [&](const char* method, const char* key, const char* value) {
    const double angle =
        turned({std::string("solver.method=") + method, std::string(key) + "=" + value}, ratio);
    std::printf("%-12s %-10s %12.5f %12.5f %10.2f\n", method, value, angle * kDegrees,
                (angle - reference) * kDegrees, ratio);
    std::fflush(stdout);
  };
  for (const char* step : {"0.002", "0.001", "0.0005", "0.00025", "0.000125"})
    print("implicit", "solver.step_s", step);
  for (const char* tolerance : {"1e-3", "1e-4", "1e-5", "1e-6"})
    print("rosenbrock", "solver.tolerance", tolerance);
}

}  // namespace
}  // namespace takt

int main(int argc, char** argv) {
  std::vector<int> sizes;
  bool alone = false, order = false;
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    alone = alone || word == "alone";
    order = order || word == "order";
    if (word == "alone" || word == "order") continue;
    try {
      sizes.push_back(word.size() > 1 && word[0] == 'M' ? std::stoi(word.substr(1)) : 0);
      takt::meshes::iso_metric(sizes.back());
    } catch (const std::exception&) {
      std::fprintf(stderr, "bench_screw: found '%s'; allowed: order, alone, M8, M10, M12, M16, M20\n",
                   word.c_str());
      return 2;
    }
  }
  if (order) {
    takt::measure_order();
    return 0;
  }
  if (sizes.empty()) sizes = {8, 12, 16, 20};
  std::printf(
      "%-4s %6s %6s  %-11s %9s %9s %8s %9s %9s %9s  %9s %9s\n%-4s %6s %6s  %-11s %9s %9s %8s %9s %9s %9s  "
      "%9s %9s\n",
      "size", "nut", "bolt", "friction", "turned", "closed f.", "error", "travel -", "deepest", "time/time",
      "Bullet", "Bullet", "", "faces", "faces", "", "deg", "deg", "", "lead um", "um", "", "deg",
      "time/time");
  try {
    for (const int size : sizes) {
      for (const double friction : {0.0, 0.01, 0.02}) {
        char name[16];
        std::snprintf(name, sizeof(name), "%.2f", friction);
        takt::measure(size, name, 0.0, friction, alone);
      }
      takt::measure(size, "0.9 limit", 0.9, 0.0, alone);
      takt::measure(size, "1.1, stick", 1.1, 0.0, alone, "stick");
    }
  } catch (const std::exception& error) {
    std::fprintf(stderr, "bench_screw: %s\n", error.what());
    return 2;
  }
  return 0;
}

// bench_steps: accuracy and cost of the solvers for real time. First their errors in surface contact against
// references (cvode at 1e-9, closed forms), with the largest work of a communication step, counted; then the
// processor time of every communication step of a scenario, as for a paced cell: median, 99th percentile,
// worst, and the cause of the worst. Each solver runs several times and the smallest time of a step counts:
// the simulation is deterministic, the machine is not.
#include <time.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <numeric>
#include <string>
#include <vector>

#include "server/headless/in_process_controller.h"
#include "server/scenario/scenario_builder.h"
#include "server/simulation/solver/implicit_integrator.h"
#include "tests/support/solver_figures.h"

namespace {

using namespace takt;

struct Setting {
  const char* method;
  const char* tolerance;  ///< empty: none
};

struct Options {
  std::string scenario = TAKT_CONFIG_DIR "/scenarios/block_assembly.yaml", step = "0.001";
  int level_of_detail = 3, rounds = 3, worst = 5;
};

struct Step {
  double cpu_s = 1e9;
  std::uint64_t rebuilds = 0, calls = 0, steps = 0, evaluations = 0, jacobians = 0;
};

double seconds() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

using Places = std::vector<Vec3>;

Places places(const Scenario& scenario, const Simulation& simulation) {
  Snapshot snapshot = simulation.make_snapshot();
  simulation.read_snapshot(snapshot);
  Places result;
  for (const ScenarioPart& part : scenario.parts)
    result.push_back(
        snapshot.components[static_cast<std::size_t>(simulation.description().find_component(part.name))]
            .p_WB);
  return result;
}

/// Empty if the run did not reach its end.
std::vector<Step> run(const Setting& setting, const Options& options, Places& ends,
                      test::LargestWork& largest) {
  ScenarioOptions wanted;
  wanted.level_of_detail = options.level_of_detail;
  wanted.overrides = {std::string("solver.method=") + setting.method, "solver.step_s=" + options.step};
  if (*setting.tolerance != '\0')
    wanted.overrides.push_back(std::string("solver.tolerance=") + setting.tolerance);
  const Scenario scenario = read_scenario(options.scenario, wanted);
  const auto cell = build_cell(scenario);
  const auto count = static_cast<std::size_t>(scenario.duration_s / cell->description.step_s + 0.5);
  std::vector<Step> steps(count);
  for (int round = 0; round < options.rounds; ++round) {
    Simulation simulation(cell);
    InProcessController controller(scenario.controller_program.string(), simulation);
    ContactCallCounts calls = simulation.contact_counts();
    SolverStatistics work = simulation.statistics().solver;
    for (Step& step : steps) {
      const auto commands = controller.commands(simulation);
      const double begin = seconds();
      if (!simulation.step(commands)) {
        std::printf("  %s\n", simulation.fault().c_str());
        return {};
      }
      step.cpu_s = std::min(step.cpu_s, seconds() - begin);
      const ContactCallCounts now = simulation.contact_counts();
      const SolverStatistics done = simulation.statistics().solver;
      largest.note(work, done);
      step.rebuilds = now.rebuilds - calls.rebuilds;
      step.calls = now.made - calls.made;
      step.steps = done.steps - work.steps;
      step.evaluations = done.evaluations - work.evaluations;
      step.jacobians = done.jacobians - work.jacobians;
      calls = now;
      work = done;
    }
    ends = places(scenario, simulation);
  }
  return steps;
}

void report(const Setting& setting, const Options& options, const Places& exact) {
  Places ends;
  test::LargestWork largest;
  const std::vector<Step> steps = run(setting, options, ends, largest);
  if (steps.empty()) return;
  std::vector<std::size_t> order(steps.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(),
            [&](std::size_t a, std::size_t b) { return steps[a].cpu_s > steps[b].cpu_s; });
  const auto at = [&](double share) {
    return 1e6 * steps[order[static_cast<std::size_t>(share * static_cast<double>(order.size() - 1))]].cpu_s;
  };
  double total_s = 0.0;
  for (const Step& step : steps) total_s += step.cpu_s;
  double off_m = 0.0;
  for (std::size_t i = 0; i < exact.size(); ++i) off_m = std::max(off_m, (ends[i] - exact[i]).norm());
  std::printf("%-10s %-6s %9.1f %9.1f %9.1f %9.1f %9.1f %9.4f %9.4f %5llu %6llu %6llu\n", setting.method,
              setting.tolerance, 1e6 * total_s / static_cast<double>(steps.size()), at(0.5), at(0.01),
              at(0.001), at(0.0), total_s / (std::stod(options.step) * static_cast<double>(steps.size())),
              1e3 * off_m, static_cast<unsigned long long>(largest.attempts),
              static_cast<unsigned long long>(largest.evaluations),
              static_cast<unsigned long long>(largest.forced_steps));
  for (std::size_t i = 0; i < static_cast<std::size_t>(options.worst) && i < order.size(); ++i) {
    const Step& step = steps[order[i]];
    std::printf(
        "  %9.1f us at %7.3f s: %llu solver steps, %llu evaluations, %llu Jacobians, %llu contact calls, "
        "%llu lists made\n",
        1e6 * step.cpu_s, std::stod(options.step) * static_cast<double>(order[i]),
        static_cast<unsigned long long>(step.steps), static_cast<unsigned long long>(step.evaluations),
        static_cast<unsigned long long>(step.jacobians), static_cast<unsigned long long>(step.calls),
        static_cast<unsigned long long>(step.rebuilds));
  }
  std::fflush(stdout);
}

void figures(double step_s) {
  const test::SolverSetting settings[] = {
      {"cvode", 1e-9, step_s}, {"implicit", 0.0, step_s}, {"rosenbrock", 1e-4, step_s}};
  std::printf(
      "Scenes of config/scenarios/contact, step %g s: value (most attempts / evaluations per step, forced "
      "steps)\n%-36s",
      step_s, "");
  for (const test::SolverSetting& setting : settings)
    std::printf(" %-30s", (setting.method + (setting.method == "cvode" ? " 1e-9" : "")).c_str());
  std::printf("\n");
  const auto row = [&](const std::string& name, const auto& figure) {
    std::printf("%-36s", name.c_str());
    for (const test::SolverSetting& setting : settings) {
      const test::SolverFigure found = figure(setting);
      char text[64];
      std::snprintf(text, sizeof text, "%.5f (%llu / %llu, %llu)", found.value,
                    static_cast<unsigned long long>(found.work.attempts),
                    static_cast<unsigned long long>(found.work.evaluations),
                    static_cast<unsigned long long>(found.work.forced_steps));
      std::printf(" %-30s", text);
    }
    std::printf("\n");
    std::fflush(stdout);
  };
  for (const double damping : {0.0, 1e3, 1e4, 1e5, 2.5e5, 1e6}) {
    char name[48];
    std::snprintf(name, sizeof name, "restitution, %g N s/m^3", damping);
    row(name, [damping](const test::SolverSetting& s) { return test::restitution(s, damping); });
  }
  row("slab stops after, m (0.16995)", test::stopping_distance);
  for (const char* law : {"regularised", "stick"})
    row(std::string("1 deg above friction angle, m, ") + law,
        [law](const test::SolverSetting& s) { return test::way_above_friction_angle(s, law); });
  std::printf("implicit: at most %d attempts and %d evaluations per communication step\n\n",
              ImplicitIntegrator::kMaxAttempts, 4 * ImplicitIntegrator::kMaxAttempts);
}

}  // namespace

int main(int argc, char** argv) {
  Options options;
  std::string only;
  CLI::App app("Processor time of each communication step");
  app.add_option("scenario", options.scenario, "Scenario file")->capture_default_str();
  app.add_option("--lod", options.level_of_detail, "Level of detail")->capture_default_str();
  app.add_option("--step", options.step, "Communication step (s)")->capture_default_str();
  app.add_option("--rounds", options.rounds, "Runs; the least time of a step counts")->capture_default_str();
  app.add_option("--worst", options.worst, "Longest steps to list")->capture_default_str();
  app.add_option("--only", only, "One solver alone");
  CLI11_PARSE(app, argc, argv);
  Places exact;
  if (options.level_of_detail == 3) {
    figures(std::stod(options.step));
    Options once = options;
    once.rounds = 1;
    test::LargestWork work;
    run({"cvode", "1e-9"}, once, exact, work);
  }
  std::printf("%s at LoD %d, step %s s; goals: p99 500 us, worst 2000 us\n", options.scenario.c_str(),
              options.level_of_detail, options.step.c_str());
  std::printf("%-10s %-6s %9s %9s %9s %9s %9s %9s %9s %5s %6s %6s\n", "solver", "tol", "mean us", "median",
              "p99", "p99.9", "worst", "factor", "off mm", "most", "evals", "forced");
  for (const Setting& setting : {Setting{"implicit", ""}, Setting{"rosenbrock", "1e-4"}})
    if (only.empty() || only == setting.method) report(setting, options, exact);
  return 0;
}

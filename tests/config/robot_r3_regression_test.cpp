// The reference motion of the r3 robot from its scenario file, with stick-slip events located by solvers with
// error control, against a second implementation (scalar drive equations, mechanics by Orocos KDL, classical
// Runge-Kutta at 1e-5 s): the acceptance levels of the published facts, over the whole motion.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <sstream>

#include "idl/common/lockstep.h"
#include "server/headless/csv_writer.h"
#include "server/headless/headless_run.h"
#include "server/headless/report.h"
#include "server/headless/verification_plan.h"
#include "server/scenario/scenario_builder.h"
#include "server/simulation/step/simulation.h"
#include "tests/support/child_process.h"
#include "tests/support/r3_oracle.h"
#include "tests/support/temporary_directory.h"

namespace takt {
namespace {

constexpr double kPeriod = 4e-4;  // of the rows that are compared

struct Row {
  std::array<double, 6> q{}, qd{}, current{}, deflection{};
  std::array<int, 6> mode{};
};
struct ModeChange {
  double time_s;
  std::array<int, 6> mode;
};
struct Motion {
  std::vector<Row> rows;
  /// Of each axis: the modes in order, without times.
  std::array<std::vector<int>, 6> sequence() const {
    std::array<std::vector<int>, 6> result;
    for (std::size_t j = 0; j < 6; ++j) {
      for (const Row& row : rows)
        if (result[j].empty() || result[j].back() != row.mode[j]) result[j].push_back(row.mode[j]);
    }
    return result;
  }
  /// True if a mode changes within 1 ms of this row.
  bool near_a_switch(std::size_t row) const {
    const std::size_t reach = 3;
    const std::size_t from = row > reach ? row - reach : 0, to = std::min(rows.size() - 1, row + reach);
    for (std::size_t i = from; i < to; ++i)
      if (rows[i].mode != rows[i + 1].mode) return true;
    return false;
  }
};

const Motion& second_implementation() {
  static const Motion motion = [] {
    Motion result;
    r3::Oracle oracle;
    constexpr int kStepsPerRow = 40;
    for (int row = 0; row <= 4640; ++row) {
      Row& r = result.rows.emplace_back();
      for (std::size_t j = 0; j < 6; ++j) {
        const auto& axis = oracle.state[j];
        r.q[j] = axis.q, r.qd[j] = axis.qd, r.current[j] = axis.i, r.deflection[j] = axis.psi;
        r.mode[j] = oracle.mode[j];
      }
      if (row == 0) oracle.switch_modes();
      for (int i = 0; i < kStepsPerRow; ++i) oracle.step(kPeriod / kStepsPerRow);
    }
    return result;
  }();
  return motion;
}

std::string r3_scenario(const std::string& name) {
  return std::string(TAKT_CONFIG_DIR) + "/scenarios/" + name + ".yaml";
}

struct R3Run {
  Motion motion;
  HeadlessResult result;
};

R3Run run_r3(const std::vector<std::string>& overrides) {
  ScenarioOptions options;
  options.overrides = overrides;
  const Scenario scenario = read_scenario(r3_scenario("robot_r3"), options);
  const auto cell = build_cell(scenario);
  Simulation simulation(cell);
  HeadlessOptions headless;
  headless.duration_s = scenario.duration_s;
  R3Run run;
  Snapshot snapshot = simulation.make_snapshot();
  run.result = run_headless(simulation, scenario, headless, [&](const Simulation& now) {
    const auto row = run.motion.rows.size();
    if (now.step_index() != period_boundary_step(row, kPeriod, scenario.step_s)) return;
    now.read_snapshot(snapshot);
    const RobotSample& robot = snapshot.robots[0];
    Row& r = run.motion.rows.emplace_back();
    for (std::size_t j = 0; j < 6; ++j) {
      r.q[j] = robot.position[j], r.qd[j] = robot.velocity[j];
      r.current[j] = robot.drives[j].motor_current_A;
      r.deflection[j] = robot.drives[j].gear_deflection_rad;
      r.mode[j] = static_cast<int>(robot.drives[j].friction_mode);
    }
  });
  return run;
}

struct Limits {
  double position_rad, velocity_rad_per_s, current_A, current_near_switch_A, deflection_rad;
};
constexpr Limits kAcceptance{1e-5, 5e-3, 0.1, 0.2, 1e-3};

void expect_within(const Motion& motion, const Limits& limits) {
  const Motion& other = second_implementation();
  ASSERT_EQ(motion.rows.size(), other.rows.size());
  for (std::size_t i = 0; i < motion.rows.size(); ++i) {
    const Row &a = motion.rows[i], &b = other.rows[i];
    const double current = other.near_a_switch(i) ? limits.current_near_switch_A : limits.current_A;
    for (std::size_t j = 0; j < 6; ++j) {
      const auto where = [&] {
        return "axis " + std::to_string(j + 1) + " at " + std::to_string(static_cast<double>(i) * kPeriod);
      };
      ASSERT_NEAR(a.q[j], b.q[j], limits.position_rad) << where();
      ASSERT_NEAR(a.qd[j], b.qd[j], limits.velocity_rad_per_s) << where();
      ASSERT_NEAR(a.current[j], b.current[j], current) << where();
      ASSERT_NEAR(a.deflection[j], b.deflection[j], limits.deflection_rad) << where();
    }
  }
  const auto modes = motion.sequence(), other_modes = other.sequence();
  for (std::size_t j = 0; j < 6; ++j) {
    EXPECT_EQ(modes[j], other_modes[j]) << "friction modes of axis " << j + 1;
    EXPECT_GE(modes[j].size(), 3U) << "axis " << j + 1 << " breaks away and comes to rest";
  }
}

class RobotR3 : public testing::TestWithParam<std::string> {};

TEST_P(RobotR3, TheWholeMotionKeepsThePublishedFiguresWithLocatedEvents) {
  const R3Run r = run_r3({"solver.method=" + GetParam(), "solver.tolerance=1e-8"});
  ASSERT_EQ(r.result.fault, "");
  expect_within(r.motion, {1e-6, 5e-4, 0.03, 0.03, 1e-4});  // a tenth of the tolerance
  const SolverStatistics& work = r.result.statistics.solver;
  std::size_t switches = 0;
  for (const auto& modes : r.motion.sequence()) switches += modes.size() - 1;
  EXPECT_GE(work.mode_switches, 20U);
  EXPECT_LE(work.mode_switches, 2 * switches);
  // Only mode switches and corners of the reference restart it.
  EXPECT_LE(work.restarts, work.mode_switches + 4);
}
INSTANTIATE_TEST_SUITE_P(Solvers, RobotR3, testing::Values("cvode", "esdirk", "ida"),
                         [](const auto& test) { return test.param; });

TEST(RobotR3FixedSteps, TheImplicitMethodAtATenthOfAMillisecondKeepsThePublishedFigures) {
  const R3Run r = run_r3({"solver.method=implicit", "solver.step_s=0.0001"});
  ASSERT_EQ(r.result.fault, "");
  expect_within(r.motion, kAcceptance);
}

TEST(RobotR3FixedSteps, ClassicalRungeKuttaAtTenMicrosecondsKeepsThePublishedFigures) {
  const R3Run r = run_r3({"solver.method=rk4", "solver.step_s=0.00001"});
  ASSERT_EQ(r.result.fault, "");
  // The same method at the same steps: the difference is rounding, and its effect at a switch.
  expect_within(r.motion, {1e-9, 1e-7, 1e-5, 1e-5, 1e-8});
}

TEST(RobotR3Verification, ThePlanHasTheReferenceOfTheSecondImplementation) {
  const VerificationPlan plan =
      read_verification_plan(std::string(TAKT_CONFIG_DIR) + "/verification/takt.yaml");
  const auto scene = std::find_if(plan.scenes.begin(), plan.scenes.end(),
                                  [](const VerificationScene& one) { return one.name == "robot r3"; });
  ASSERT_NE(scene, plan.scenes.end());
  EXPECT_EQ(scene->quantity, "robots.r3.position.j3");
  const Motion& other = second_implementation();
  const auto row = static_cast<std::size_t>(std::llround(*scene->duration_s / kPeriod));
  EXPECT_NEAR(*scene->reference.value, other.rows.at(row).q[2], 1e-9);
}

TEST(RobotR3Tolerance, ASmallerToleranceComesCloser) {
  const R3Run reference = run_r3({"solver.tolerance=1e-11"});
  double previous = 1.0;
  for (const char* tolerance : {"1e-4", "1e-6", "1e-8"}) {
    const R3Run r = run_r3({std::string("solver.tolerance=") + tolerance});
    ASSERT_EQ(r.result.fault, "");
    double error = 0.0;
    for (std::size_t i = 0; i < r.motion.rows.size(); ++i) {
      for (std::size_t j = 0; j < 6; ++j)
        error = std::max(error, std::abs(r.motion.rows[i].q[j] - reference.motion.rows[i].q[j]));
    }
    EXPECT_LT(error, 0.5 * previous) << tolerance;
    previous = error;
  }
  EXPECT_LT(previous, 2e-8);  // a located switch that takes effect only at the end of a step costs more
}

TEST(RobotR3Scenario, TheRobotStartsInThePublishedState) {
  const Simulation simulation(load_cell(r3_scenario("robot_r3")));
  const Snapshot snapshot = simulation.make_snapshot();
  const RobotSample& robot = snapshot.robots[0];
  ASSERT_EQ(robot.level_of_detail, 2);
  // psi (rad), i (A), vC (V; the motor has -5 vC), digits as published.
  const double psi[] = {0.0, 0.274150862, 0.073678181, 0.0, 0.0, 0.0};
  const double current[] = {0.0, -1.888091334, -3.678834772, -0.600424393, -0.724279315, 0.0};
  const double voltage[] = {0.0, 94.40456670, 183.94173862, 30.02121966, 36.21396577, 0.0};
  for (std::size_t j = 0; j < 6; ++j) {
    SCOPED_TRACE(j + 1);
    const DriveSample& drive = robot.drives[j];
    EXPECT_NEAR(drive.gear_deflection_rad, psi[j], 0.51e-9);
    EXPECT_NEAR(drive.motor_current_A, current[j], 0.51e-9);
    EXPECT_NEAR(-drive.motor_voltage_V / 5.0, voltage[j], 0.51e-8);
    EXPECT_EQ(drive.friction_mode, FrictionMode::stuck);
    EXPECT_NEAR(drive.friction_torque_N_m, 0.0, 1e-10);
    EXPECT_EQ(robot.velocity[j], 0.0);
    EXPECT_NEAR(robot.position[j], r3::kAxes[j].start_deg * M_PI / 180.0, 1e-15);
  }
}

// Link 1 has a physically impossible tensor (only the rotation about its axis counts): reported to the user
// of the robot.
TEST(RobotR3Scenario, DoubtfulInertiasAreReportedByTheProgramAndInTheReport) {
  const auto cell = load_cell(r3_scenario("robot_r3"));
  ASSERT_EQ(cell->import_notes.size(), 1U);
  const ImportNote& note = cell->import_notes[0];
  EXPECT_EQ(note.component, "r3");
  EXPECT_FALSE(note.shapes);
  for (const char* words : {"r3.urdf: line ", "link 'link_1'", "principal moments", "used as it is"})
    EXPECT_NE(note.sentence.find(words), std::string::npos) << note.sentence;

  const test::TemporaryDirectory directory;
  const std::filesystem::path file = directory / "report.json";
  test::ChildProcess run({std::string(TAKT_BIN_DIR) + "/takt-run", "run", r3_scenario("robot_r3"),
                          "--duration", "0.004", "--report", file.string()});
  EXPECT_EQ(run.wait(), 0) << run.text;
  EXPECT_NE(run.text.find("takt-run: note: " + note.sentence), std::string::npos) << run.text;
  const auto report = nlohmann::json::parse(std::ifstream(file));
  ASSERT_EQ(report["import_notes"].size(), 1U);
  EXPECT_EQ(report["import_notes"][0], (nlohmann::json{{"robot", "r3"}, {"sentence", note.sentence}}));
}

TEST(RobotR3Scenario, RobotsWithPossibleInertiasGetNoNote) {
  for (const char* name : {"block_assembly", "block_assembly_kr16"})
    EXPECT_TRUE(load_cell(r3_scenario(name))->import_notes.empty()) << name;
}

// The equations of one axis as scalars, in the relative form of the published facts.
struct SingleAxis {
  static constexpr double n = 210, c = 8, d = 0.01, Rv0 = 0.5, Rv1 = 0.1 / 130, w = 5500, D = 0.6, R = 250,
                          J = 0.0013, k = 1.1616, load = 19.5, kp = 5, ks = 0.5, Ts = 0.05;
  std::array<double, 7> y{};  ///< q, qd, x, vC, i, psi, om_s
  int mode = 0;
  double friction = 0.0;

  static void reference(double t, double& q, double& qd) {
    constexpr double v = 3.0, a = 10.0, way = 2.0 * M_PI / 3.0, Ta = v / a, Tv = way / v, Te = Tv + Ta;
    if (t < Ta) {
      q = 0.5 * a * t * t, qd = a * t;
    } else if (t < Tv) {
      q = v * (t - 0.5 * Ta), qd = v;
    } else if (t < Te) {
      q = way - 0.5 * a * (Te - t) * (Te - t), qd = a * (Te - t);
    } else {
      q = way, qd = 0.0;
    }
  }
  std::array<double, 7> derivatives(double t, const std::array<double, 7>& s) {
    const auto [q, qd, x, vC, i, psi, om_s] = s;
    double q_ref, qd_ref;
    reference(t, q_ref, qd_ref);
    const double om = mode == 0 ? 0.0 : n * qd - om_s, phi = n * q - psi;
    const double u = n * qd_ref + kp * (n * q_ref - phi) - om;
    const double spring = c * psi + d * (n * qd - om);
    friction = mode == 0 ? k * i + spring : mode * (Rv0 + Rv1 * std::abs(om));
    const double qdd = -n * spring / load;
    return {qd,
            qdd,
            u / Ts,
            (i - ks * (x + u)) * w / (0.04 * D),
            (-5.0 * vC - R * i - k * om) * 2.0 * D * w / R,
            n * qd - om,
            n * qdd - (k * i + spring - friction) / J};
  }
  void step(double t, double h) {
    const auto plus = [this](const std::array<double, 7>& rate, double by) {
      std::array<double, 7> sum = y;
      for (std::size_t j = 0; j < 7; ++j) sum[j] += by * rate[j];
      return sum;
    };
    const auto k1 = derivatives(t, y), k2 = derivatives(t + 0.5 * h, plus(k1, 0.5 * h));
    const auto k3 = derivatives(t + 0.5 * h, plus(k2, 0.5 * h)), k4 = derivatives(t + h, plus(k3, h));
    for (std::size_t j = 0; j < 7; ++j) y[j] += h / 6.0 * (k1[j] + 2.0 * k2[j] + 2.0 * k3[j] + k4[j]);
    switch_mode(t + h);
  }
  void switch_mode(double t) {
    if (mode != 0 && mode * (n * y[1] - y[6]) <= 0.0) mode = 0, y[6] = n * y[1];
    if (mode != 0) return;
    derivatives(t, y);
    if (std::abs(friction) > Rv0) mode = friction > 0.0 ? 1 : -1;
  }
};

TEST(RobotR3SingleAxis, TheWholeMotionOfASingleAxisKeepsThePublishedFigures) {
  const auto cell = load_cell(r3_scenario("robot_r3_single_axis"));
  Simulation simulation(cell);
  SingleAxis axis;
  axis.switch_mode(0.0);
  Snapshot snapshot = simulation.make_snapshot();
  EXPECT_EQ(snapshot.robots[0].drives[0].motor_current_A, 0.0);
  std::vector<int> modes, other_modes;
  constexpr int kStepsPerRow = 80;
  for (int row = 1; row <= 3745; ++row) {
    ASSERT_TRUE(simulation.step({})) << simulation.fault();
    for (int i = 0; i < kStepsPerRow; ++i)
      axis.step((row - 1) * kPeriod + i * kPeriod / kStepsPerRow, kPeriod / kStepsPerRow);
    simulation.read_snapshot(snapshot);
    const RobotSample& robot = snapshot.robots[0];
    ASSERT_NEAR(robot.position[0], axis.y[0], 1e-6) << snapshot.time_s;
    ASSERT_NEAR(robot.velocity[0], axis.y[1], 5e-4) << snapshot.time_s;
    ASSERT_NEAR(robot.drives[0].motor_current_A, axis.y[4], 0.03) << snapshot.time_s;
    ASSERT_NEAR(robot.drives[0].gear_deflection_rad, axis.y[5], 1e-4) << snapshot.time_s;
    const int mode = static_cast<int>(robot.drives[0].friction_mode);
    if (modes.empty() || modes.back() != mode) modes.push_back(mode);
    if (other_modes.empty() || other_modes.back() != axis.mode) other_modes.push_back(axis.mode);
  }
  EXPECT_EQ(modes, other_modes);
  EXPECT_GE(modes.size(), 2U);
  EXPECT_NEAR(snapshot.robots[0].position[0], 2.0 * M_PI / 3.0, 0.002);
}

TEST(RobotR3Csv, RowsAreTheInstants) {
  const test::TemporaryDirectory directory;
  const auto file = directory.path() / "r3.csv";
  const Scenario scenario = read_scenario(r3_scenario("robot_r3"));
  Simulation simulation(build_cell(scenario));
  CsvWriter csv(file, simulation, scenario.csv_period_s);
  csv.record(simulation);
  for (int i = 0; i < 10; ++i) {
    ASSERT_TRUE(simulation.step({}));
    csv.record(simulation);
  }
  csv.close();
  std::ifstream in(file);
  const auto cells = [](const std::string& line) {
    std::vector<std::string> all;
    std::stringstream stream(line);
    for (std::string cell; std::getline(stream, cell, ',');) all.push_back(cell);
    return all;
  };
  std::string line;
  std::getline(in, line);
  const std::vector<std::string> names = cells(line);
  std::vector<std::string> last;
  int rows = 0;
  for (; std::getline(in, line); ++rows) {
    last = cells(line);
    ASSERT_EQ(last.size(), names.size());
  }
  EXPECT_EQ(rows, 11);
  const auto value = [&](const std::string& name) {
    const auto found = std::find(names.begin(), names.end(), name);
    return found == names.end() ? std::nan("")
                                : std::stod(last[static_cast<std::size_t>(found - names.begin())]);
  };
  EXPECT_EQ(names[0], "time");
  EXPECT_EQ(value("time"), simulation.time_s());
  const RobotSample robot = simulation.make_snapshot().robots[0];
  for (std::size_t j = 0; j < 6; ++j) {
    const std::string joint = ".j" + std::to_string(j + 1);
    EXPECT_EQ(value("robots.r3.position" + joint), robot.position[j]);
    EXPECT_EQ(value("robots.r3.velocity" + joint), robot.velocity[j]);
    EXPECT_EQ(value("robots.r3.motor_current" + joint), robot.drives[j].motor_current_A);
    EXPECT_EQ(value("robots.r3.gear_deflection" + joint), robot.drives[j].gear_deflection_rad);
    EXPECT_EQ(value("robots.r3.friction_mode" + joint), static_cast<double>(robot.drives[j].friction_mode));
    EXPECT_EQ(value("robots.r3.effort" + joint), robot.effort[j]);
  }
  for (int i = 0; i < 3; ++i) {
    const std::string axis(1, "xyz"[i]);
    EXPECT_EQ(value("robots.r3.flange_force." + axis), robot.flange_load_W.f[i]);
    EXPECT_EQ(value("robots.r3.flange_torque." + axis), robot.flange_load_W.t[i]);
  }
  EXPECT_EQ(value("power.consumers.r3.mechanical_energy"), robot.power.mechanical_energy_J);
}

}  // namespace
}  // namespace takt

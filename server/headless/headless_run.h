#pragma once
// One scenario from start to end in one process: simulation, controller program, records for report and CSV.
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "server/headless/assertions.h"
#include "server/headless/run_metrics.h"
#include "server/messages/status_messages.h"
#include "server/scenario/scenario.h"
#include "server/simulation/step/simulation.h"

namespace takt {

struct HeadlessOptions {
  double duration_s = 0.0;        ///< > 0
  std::filesystem::path program;  ///< controller program; empty: without
  bool stage_times = false;       ///< measure the stages of a step (costs some of them)
  bool contact_extremes = false;  ///< evaluates all contacts after every step (costs an evaluation)
  bool run_metrics = false;       ///< gather HeadlessResult::run_metrics, with contact_extremes in it
};

struct ReportedInstant {
  ScenarioReportTime instant;
  Snapshot snapshot;
};

/// When friction between a gripper and a Part was used most: needed over present force.
struct GripExtreme {
  int gripper = -1;
  GripLoad load;
  double time_s = 0.0;
  double use() const { return load.needed_N / load.force_N; }
};

/// What a run took so far.
struct RunTimes {
  double wall_s = 0.0;
  double cpu_s = 0.0;  ///< of the process
  double real_time_factor(double time_s) const { return wall_s > 0.0 ? time_s / wall_s : 0.0; }
  double computation_ratio(double time_s) const { return time_s > 0.0 ? cpu_s / time_s : 0.0; }
};

/// Begins at its construction.
class RunTimer {
 public:
  RunTimes now() const;

 private:
  static RunTimes read();
  RunTimes began_ = read();
};

inline constexpr std::size_t kMostWarnings = 1000;

/// Its times are those of simulation and program; cpu_s is without gathering_s.
struct HeadlessResult : RunTimes {
  Snapshot final_state;
  SimulationStatistics statistics;
  std::vector<ConnectionChange> changes;
  std::vector<CollisionEvent> collisions;  ///< empty without collision checking
  std::vector<WeakGrip> weak_grips;
  std::vector<AlternatingForce> alternating_forces;
  std::vector<DeviceMessage> device_messages;
  std::vector<takt_msgs::msg::Event>
      warnings;  ///< events of severity warning and error, the first kMostWarnings
  std::size_t further_warnings = 0;
  std::vector<GripExtreme> grips;  ///< of each gripper and Part that it gripped at levels of detail 1 and 2
  std::vector<ReportedInstant> report_at;
  bool surface_contact = false;  ///< some process was at level of detail 3 at the end
  ContactCallCounts contact_counts;
  std::vector<ContactExtreme> contact_extremes;  ///< of each pair that ever pressed, in the order of pairs
  std::vector<AssertionResult> assertions;       ///< verdicts on the scenario's assertions, in their order
  std::optional<RunMetrics> run_metrics;         ///< if requested
  double gathering_s = 0.0;                      ///< processor time of gathering `run_metrics`
  double controller_s = 0.0;                     ///< wall time within the controller program
  std::string fault;                             ///< why the run ended early, or empty
};

/// Called with the initial state and after every step.
using StepObserver = std::function<void(const Simulation&)>;
/// Called ahead of every step; may block to pace the run.
using StepPacer = std::function<void(double time_s)>;

/// Throws ScenarioError for an assertion about an object that the cell lacks. Does not throw during the run:
/// a failing program or a diverging state ends the run with `fault` set.
HeadlessResult run_headless(Simulation& simulation, const Scenario& scenario, const HeadlessOptions& options,
                            const StepObserver& observer = {}, const StepPacer& pacer = {});

/// Distance between a component's place and the expected one (m), and the angle between the orientations
/// (rad).
struct PoseError {
  double position_m = 0.0;
  double angle_rad = 0.0;
};
PoseError pose_error(const ComponentSample& sample, const Pose& expected);

}  // namespace takt

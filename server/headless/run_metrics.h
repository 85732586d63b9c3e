#pragma once
// Metrics of a run: durations and energy of its steps, the largest loads with their times, and curves of
// power, torques, forces and devices. Gathered during the run.
#include <algorithm>
#include <deque>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "client_lib/controller/controller.h"
#include "server/simulation/step/simulation.h"

namespace takt {

struct Peak {
  double value = 0.0, time_s = 0.0;
  /// Keeps the larger value.
  void note(double candidate, double at_s) {
    if (candidate > value) *this = {candidate, at_s};
  }
};

/// Of one joint: largest absolute values (rad/s or m/s; N m or N), and its range of positions (rad or m).
struct JointExtremes {
  Peak speed, torque;
  double lowest = 0.0, highest = 0.0;
};

struct RobotExtremes {
  std::vector<JointExtremes> joints;
  Peak flange_force_N, flange_torque_N_m;  ///< from level of detail 2 on
  bool dynamic = false;                    ///< was above level of detail 1 at some time
};

/// Largest pressure of two components by surface contact, with its time. Contacts at the start settle from
/// touching to pressing: their first 0.1 s do not count, here and in HoldingExtreme.
struct ContactExtreme {
  double time_s = 0.0;
  ContactSample sample;
  Peak torque_N_m;  ///< on the base, about the centre of pressure
  void note(const ContactSample& candidate, double at_s) {
    torque_N_m.note(candidate.F_base_W.t.norm(), at_s);
    if (sample.result.normal_force_N < candidate.result.normal_force_N) time_s = at_s, sample = candidate;
  }
};

/// Largest force with which a component held a Part by substitute force or contact.
struct HoldingExtreme {
  int part = -1, holder = -1;
  Peak force_N, torque_N_m;
};

struct ConsumerMetrics {
  std::string name;
  double energy_J = 0.0;
  Peak power_W;
};

/// A step of the program, with the energy of each consumer during it (in their order).
struct StepMetrics {
  controller::ProgramStep step;
  std::vector<double> energy_J;
  bool goes_on = false;  ///< at the end of the run, which is taken as its end
};

/// The group of the curves of normal forces by surface contact.
inline constexpr const char* kContactForces = "Contact forces";

struct Curve {
  std::string group, name, unit;
  std::vector<std::pair<double, double>> points;  ///< time (s), value
};

struct RunMetrics {
  std::vector<RobotExtremes> robots;
  std::vector<ContactExtreme> contacts;  ///< of each pair that ever pressed, in the order of pairs
  std::vector<HoldingExtreme> holding;
  std::vector<ConsumerMetrics> consumers;
  std::vector<StepMetrics> steps;
  std::vector<Curve> curves;
};

/// A program that the end of the run interrupts.
inline bool interrupted(const RunMetrics& metrics) {
  return std::ranges::any_of(metrics.steps, &StepMetrics::goes_on);
}

/// End of the program's last step. None without steps, and of a program that is interrupted.
inline std::optional<double> cycle_time_s(const RunMetrics& metrics) {
  if (metrics.steps.empty() || interrupted(metrics)) return std::nullopt;
  double end_s = 0.0;
  for (const StepMetrics& step : metrics.steps) end_s = std::max(end_s, step.step.end_s);
  return end_s;
}

class RunMetricsRecorder {
 public:
  /// Curves have a point every `period_s`, of long runs fewer. Robots above level of detail 1 and contacts
  /// are evaluated after every step, purely kinematic motion with the curves.
  RunMetricsRecorder(const Simulation& simulation, double period_s);
  /// Call it with the initial state and after every step.
  void note(const Simulation& simulation);
  /// At the end, which also ends an unfinished step.
  RunMetrics finish(const Simulation& simulation, const std::deque<controller::ProgramStep>& steps);

 private:
  void note_extremes();
  void note_curves();
  void halve_curves();
  double energy_at(std::size_t consumer, double time_s) const;
  /// The pair has touched for a short time after the start of the run. `from_start`: pairs in contact at the
  /// beginning.
  bool settles(std::set<std::pair<int, int>>& from_start, std::pair<int, int> pair) const;

  const CellDescription& cell_;
  Snapshot snapshot_;
  std::vector<ContactPeak> contact_peaks_;
  double period_s_;
  std::uint64_t next_ = 0;
  bool every_step_ = false;
  RunMetrics numbers_;
  std::set<std::pair<int, int>> pressed_from_start_, held_from_start_;
  std::map<std::pair<int, int>, ContactExtreme> contacts_;
  std::map<std::pair<int, int>, HoldingExtreme> holding_;
  std::vector<double> times_s_;
  std::vector<std::vector<double>> energies_J_;  ///< of each consumer
  std::map<std::string, std::size_t> curves_;    ///< by group and name
};

}  // namespace takt

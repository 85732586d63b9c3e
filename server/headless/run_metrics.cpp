#include "server/headless/run_metrics.h"

#include <algorithm>
#include <cmath>

#include "idl/common/lockstep.h"
#include "server/headless/device_report.h"

namespace takt {

namespace {

constexpr std::size_t kMaxPoints = 20000;  // of a curve; beyond it every second one is dropped

const char* unit_of_speed(const JointModel& joint) {
  return joint.type == JointType::revolute ? "rad/s" : "m/s";
}
const char* unit_of_torque(const JointModel& joint) {
  return joint.type == JointType::revolute ? "N m" : "N";
}

}  // namespace

RunMetricsRecorder::RunMetricsRecorder(const Simulation& simulation, double period_s)
    : cell_(simulation.description()), snapshot_(simulation.make_snapshot()), period_s_(period_s) {
  for (std::size_t r = 0; r < cell_.robots.size(); ++r) {
    RobotExtremes& robot = numbers_.robots.emplace_back();
    for (std::size_t j = 0; j < cell_.robots[r].arm.joints.size(); ++j) {
      const double q = snapshot_.robots[r].position[j];
      robot.joints.push_back({{}, {}, q, q});
    }
  }
  for (const ConsumedEnergy& one : consumed_energies(cell_, snapshot_))
    numbers_.consumers.push_back({std::string(one.consumer), 0.0, {}});
  energies_J_.resize(numbers_.consumers.size());
  const auto dynamic = [](const RobotSample& robot) { return robot.level_of_detail > 1; };
  every_step_ =
      snapshot_.contacts.acting || std::any_of(snapshot_.robots.begin(), snapshot_.robots.end(), dynamic);
}

void RunMetricsRecorder::note(const Simulation& simulation) {
  const double step_s = cell_.step_s;
  const bool due = simulation.step_index() == period_boundary_step(next_, period_s_, step_s);
  if (!due && !every_step_) return;
  simulation.read_loads(snapshot_);
  simulation.read_contact_peaks(contact_peaks_);
  note_extremes();
  if (!due) return;
  while (period_boundary_step(next_, period_s_, step_s) <= simulation.step_index()) ++next_;
  note_curves();
  if (times_s_.size() >= kMaxPoints) halve_curves();
}

bool RunMetricsRecorder::settles(std::set<std::pair<int, int>>& from_start, std::pair<int, int> pair) const {
  constexpr double kSettling_s = 0.1;
  if (!snapshot_.contacts.acting || snapshot_.time_s >= kSettling_s) return false;
  if (snapshot_.step <= 1) from_start.insert(pair);
  return from_start.count(pair) != 0;
}

void RunMetricsRecorder::note_extremes() {
  const double t = snapshot_.time_s;
  for (std::size_t r = 0; r < numbers_.robots.size(); ++r) {
    const RobotSample& sample = snapshot_.robots[r];
    RobotExtremes& robot = numbers_.robots[r];
    const bool dynamic = sample.level_of_detail > 1;
    robot.dynamic = robot.dynamic || dynamic;
    for (std::size_t j = 0; j < robot.joints.size(); ++j) {
      JointExtremes& joint = robot.joints[j];
      joint.speed.note(std::abs(sample.velocity[j]), t);
      joint.lowest = std::min(joint.lowest, sample.position[j]);
      joint.highest = std::max(joint.highest, sample.position[j]);
      if (dynamic) joint.torque.note(std::abs(sample.effort[j]), t);
    }
    if (!dynamic) continue;
    robot.flange_force_N.note(sample.flange_load_W.f.norm(), t);
    robot.flange_torque_N_m.note(sample.flange_load_W.t.norm(), t);
  }
  for (const ContactPeak& peak : contact_peaks_) {
    const std::pair<int, int> pair(peak.sample.base, peak.sample.target);
    if (!settles(pressed_from_start_, pair)) contacts_[pair].note(peak.sample, peak.time_s);
  }
  for (std::size_t c = 0; c < snapshot_.components.size(); ++c) {
    const ComponentSample& sample = snapshot_.components[c];
    if (sample.partner < 0) continue;
    if (settles(held_from_start_, {static_cast<int>(c), sample.partner})) continue;
    HoldingExtreme& most = holding_[{static_cast<int>(c), sample.partner}];
    most.force_N.note(sample.F_Bo_W.f.norm(), t);
    most.torque_N_m.note(sample.F_Bo_W.t.norm(), t);
  }
  const std::vector<ConsumedEnergy> energies = consumed_energies(cell_, snapshot_);
  for (std::size_t i = 0; i < std::min(energies.size(), numbers_.consumers.size()); ++i) {
    numbers_.consumers[i].power_W.note(energies[i].power_W, t);
    numbers_.consumers[i].energy_J = energies[i].energy_J;
  }
}

void RunMetricsRecorder::note_curves() {
  const double t = snapshot_.time_s;
  const auto add = [&](const std::string& group, const std::string& name, const std::string& unit,
                       double value) {
    const auto [place, is_new] = curves_.try_emplace(group + '\n' + name, numbers_.curves.size());
    if (is_new) numbers_.curves.push_back({group, name, unit, {}});
    numbers_.curves[place->second].points.emplace_back(t, value);
  };
  times_s_.push_back(t);
  const std::vector<ConsumedEnergy> energies = consumed_energies(cell_, snapshot_);
  for (std::size_t i = 0; i < energies_J_.size(); ++i) {
    // The energy of a robot that changed to level of detail 1 stays constant.
    energies_J_[i].push_back(i < energies.size()      ? energies[i].energy_J
                             : energies_J_[i].empty() ? 0.0
                                                      : energies_J_[i].back());
    if (i < energies.size()) add("Power", std::string(energies[i].consumer), "W", energies[i].power_W);
  }
  for (std::size_t r = 0; r < cell_.robots.size(); ++r) {
    const RobotSample& sample = snapshot_.robots[r];
    const RobotDescription& robot = cell_.robots[r];
    const bool dynamic = sample.level_of_detail > 1;
    for (std::size_t j = 0; j < robot.arm.joints.size(); ++j) {
      const JointModel& joint = robot.arm.joints[j];
      if (dynamic)
        add("Torques of " + robot.name, joint.name, unit_of_torque(joint), sample.effort[j]);
      else
        add("Joint speeds of " + robot.name, joint.name, unit_of_speed(joint), sample.velocity[j]);
    }
  }
  for (const ContactSample& sample : snapshot_.contacts.pressing()) {
    const std::string name = cell_.components[static_cast<std::size_t>(sample.base)].name + " - " +
                             cell_.components[static_cast<std::size_t>(sample.target)].name;
    const std::size_t known = numbers_.curves.size();
    add(kContactForces, name, "N", sample.result.normal_force_N);
    if (numbers_.curves.size() == known || times_s_.size() < 2) continue;
    auto& points = numbers_.curves.back().points;
    points.insert(points.begin(), {times_s_[times_s_.size() - 2], 0.0});
  }
  for (Curve& curve : numbers_.curves)  // earlier pairs without pressure at this time
    if (curve.group == kContactForces && curve.points.back().first < t) curve.points.emplace_back(t, 0.0);
  for (std::size_t d = 0; d < cell_.devices.size(); ++d)
    for (std::size_t s = 0; s < cell_.devices[d].signals.size(); ++s) {
      const SignalDescription& signal = cell_.devices[d].signals[s];
      if (signal.name == "power" || signal.name == "energy") continue;  // listed as consumers
      add("Devices: " + signal.name, cell_.devices[d].name, signal.unit, snapshot_.devices[d].signals[s]);
    }
}

void RunMetricsRecorder::halve_curves() {
  const auto halve = [](auto& values) {
    for (std::size_t i = 0; 2 * i < values.size(); ++i) values[i] = values[2 * i];
    values.resize((values.size() + 1) / 2);
  };
  halve(times_s_);
  for (auto& energies : energies_J_) halve(energies);
  for (Curve& curve : numbers_.curves) halve(curve.points);
  // Aligns the next point with the new grid.
  next_ = (next_ + 1) / 2;
  period_s_ *= 2.0;
}

double RunMetricsRecorder::energy_at(std::size_t consumer, double time_s) const {
  const std::vector<double>& energy = energies_J_[consumer];
  if (energy.empty()) return 0.0;
  const auto after = std::upper_bound(times_s_.begin(), times_s_.end(), time_s);
  if (after == times_s_.begin()) return energy.front();
  const auto i = static_cast<std::size_t>(after - times_s_.begin()) - 1;
  const bool last = after == times_s_.end();
  const double end_s = last ? snapshot_.time_s : *after;
  const double end_J = last ? numbers_.consumers[consumer].energy_J : energy[i + 1];
  if (!(end_s > times_s_[i])) return end_J;
  return energy[i] + (end_J - energy[i]) * std::min(1.0, (time_s - times_s_[i]) / (end_s - times_s_[i]));
}

RunMetrics RunMetricsRecorder::finish(const Simulation& simulation,
                                      const std::deque<controller::ProgramStep>& steps) {
  simulation.read_loads(snapshot_);
  simulation.read_contact_peaks(contact_peaks_);
  note_extremes();
  for (const auto& [pair, most] : contacts_) numbers_.contacts.push_back(most);
  for (const auto& [pair, most] : holding_) {
    numbers_.holding.push_back(most);
    numbers_.holding.back().part = pair.first;
    numbers_.holding.back().holder = pair.second;
  }
  // A routine with named steps is reported by these, any other one by its calls.
  std::vector<char> names(cell_.robots.size(), 0);
  for (const controller::ProgramStep& step : steps)
    if (step.named) names[static_cast<std::size_t>(step.robot)] = 1;
  for (const controller::ProgramStep& step : steps) {
    if (!step.named && names[static_cast<std::size_t>(step.robot)] != 0) continue;
    StepMetrics& entry = numbers_.steps.emplace_back();
    entry.step = step;
    entry.goes_on = step.end_s < 0.0;
    if (entry.goes_on) entry.step.end_s = snapshot_.time_s;
    for (std::size_t i = 0; i < energies_J_.size(); ++i)
      entry.energy_J.push_back(energy_at(i, entry.step.end_s) - energy_at(i, step.begin_s));
  }
  return std::move(numbers_);
}

}  // namespace takt

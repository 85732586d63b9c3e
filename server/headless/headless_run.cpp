#include "server/headless/headless_run.h"

#include <time.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <iterator>
#include <map>
#include <utility>

#include "server/headless/assertions.h"
#include "server/headless/in_process_controller.h"

namespace takt {

namespace {
double wall_seconds() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}
double cpu_seconds(clockid_t clock) {
  timespec t{};
  clock_gettime(clock, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}
}  // namespace

RunTimes RunTimer::read() {
  return {wall_seconds(), cpu_seconds(CLOCK_PROCESS_CPUTIME_ID)};
}

RunTimes RunTimer::now() const {
  const RunTimes times = read();
  return {times.wall_s - began_.wall_s, times.cpu_s - began_.cpu_s};
}

namespace {
void note_grips(const Simulation& simulation, std::vector<GripExtreme>& grips) {
  for (std::size_t g = 0; g < simulation.model().grippers.size(); ++g) {
    const GripLoad& load = simulation.grip_load(g);
    if (load.part < 0 || !(load.force_N > 0.0)) continue;
    const GripExtreme now{static_cast<int>(g), load, simulation.time_s() - simulation.description().step_s};
    const auto known = std::find_if(grips.begin(), grips.end(), [&](const GripExtreme& most) {
      return most.gripper == now.gripper && most.load.part == load.part;
    });
    if (known == grips.end())
      grips.push_back(now);
    else if (now.use() > known->use())
      *known = now;
  }
}
}  // namespace

HeadlessResult run_headless(Simulation& simulation, const Scenario& scenario, const HeadlessOptions& options,
                            const StepObserver& observer, const StepPacer& pacer) {
  HeadlessResult result;
  const double h = simulation.description().step_s;
  const auto steps = static_cast<std::uint64_t>(std::llround(options.duration_s / h));
  std::vector<std::uint64_t> report_steps;
  for (const ScenarioReportTime& instant : scenario.report_at) {
    report_steps.push_back(static_cast<std::uint64_t>(std::llround(instant.time_s / h)));
  }
  const auto record_instants = [&] {
    for (std::size_t i = 0; i < report_steps.size(); ++i) {
      if (report_steps[i] == simulation.step_index()) {
        result.report_at.push_back({scenario.report_at[i], simulation.make_snapshot()});
      }
    }
  };
  std::vector<ContactPeak> peaks;
  std::map<std::pair<int, int>, ContactExtreme> extremes;
  std::optional<RunMetricsRecorder> recorder;
  if (options.run_metrics) recorder.emplace(simulation, scenario.csv_period_s);
  const auto gather = [&] {
    if (!recorder) return;
    const double begin = cpu_seconds(CLOCK_THREAD_CPUTIME_ID);
    recorder->note(simulation);
    result.gathering_s += cpu_seconds(CLOCK_THREAD_CPUTIME_ID) - begin;
  };
  const std::function<void(const EventRecord&)> note_warning = [&](const EventRecord& event) {
    if (info_of(event).severity < Severity::warning) return;
    if (result.warnings.size() < kMostWarnings)
      result.warnings.push_back(to_message(event, simulation.description()));
    else
      ++result.further_warnings;
  };
  if (options.stage_times) simulation.set_stage_clock(&wall_seconds);

  std::optional<AssertionChecker> demands;
  if (!scenario.assertions.empty()) demands.emplace(scenario, simulation);

  simulation.watch_contact_peaks(recorder || options.contact_extremes ||
                                 (demands && demands->watches_contacts()));
  const RunTimer timer;
  std::optional<InProcessController> controller;
  try {
    if (!options.program.empty()) {
      controller.emplace(options.program.string(), simulation, scenario.program_parameters);
      if (recorder) controller->keep_steps();
    }
    gather();
    if (observer) observer(simulation);
    if (demands) demands->note(simulation);
    record_instants();
    for (std::uint64_t i = 0; i < steps; ++i) {
      if (pacer) pacer(simulation.time_s());
      std::span<const Command> commands;
      if (controller) {
        const double begin = wall_seconds();
        commands = controller->commands(simulation);
        result.controller_s += wall_seconds() - begin;
      }
      if (!simulation.step(commands)) {
        result.fault = simulation.fault();
        note_warning(fault_record(simulation));
        break;
      }
      for (const ConnectionChange& change : simulation.events().connection_changes)
        result.changes.push_back(change);
      for (const CollisionEvent& event : simulation.events().collision_events)
        result.collisions.push_back(event);
      for (const WeakGrip& grip : simulation.events().weak_grips) result.weak_grips.push_back(grip);
      for (const AlternatingForce& force : simulation.events().alternating_forces)
        result.alternating_forces.push_back(force);
      for (const DeviceMessage& notice : simulation.events().device_messages)
        result.device_messages.push_back(notice);
      report_step(simulation, note_warning);
      note_grips(simulation, result.grips);
      if (options.contact_extremes && !recorder) {
        simulation.read_contact_peaks(peaks);
        for (const ContactPeak& peak : peaks)
          extremes[{peak.sample.base, peak.sample.target}].note(peak.sample, peak.time_s);
      }
      gather();
      if (observer) observer(simulation);
      if (demands) demands->note(simulation);
      record_instants();
    }
  } catch (const std::exception& error) {
    result.fault = error.what();
  }
  static_cast<RunTimes&>(result) = timer.now();
  result.cpu_s -= result.gathering_s;
  if (recorder) {
    result.run_metrics = recorder->finish(
        simulation, controller ? controller->steps() : std::deque<controller::ProgramStep>{});
  }
  if (demands) result.assertions = demands->finish(simulation, result.fault);
  result.final_state = simulation.make_snapshot();
  // A run that is cut short leaves Parts on their way.
  if (result.fault.empty() && simulation.time_s() >= scenario.duration_s - 0.5 * h)
    std::ranges::move(judge_expected(scenario, simulation.description(), result.final_state),
                      std::back_inserter(result.assertions));
  result.statistics = simulation.statistics();
  result.surface_contact = result.final_state.contacts.acting;
  result.contact_counts = simulation.contact_counts();
  if (result.run_metrics) result.contact_extremes = result.run_metrics->contacts;
  for (const auto& [pair, most] : extremes) result.contact_extremes.push_back(most);
  return result;
}

PoseError pose_error(const ComponentSample& sample, const Pose& expected) {
  return {(sample.p_WB - expected.p).norm(), sample.q_WB.angularDistance(Quat(expected.R))};
}

}  // namespace takt

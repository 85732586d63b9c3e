#include "server/headless/report.h"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "client_lib/recording/message_json.h"
#include "idl/common/eigen_messages.h"
#include "server/headless/html_report.h"
#include "server/headless/instant_json.h"
#include "server/headless/picture.h"
#include "server/headless/run_metrics_report.h"
#include "server/headless/run_summary.h"
#include "server/simulation/model/state_hash.h"

namespace takt {

namespace {

using Json = nlohmann::ordered_json;

Json name_or_null(const CellDescription& cell, int component) {
  return component < 0 ? Json(nullptr) : Json(cell.components[static_cast<std::size_t>(component)].name);
}

/// Adds what the wire does not say of components: their types, and how far Parts are from where they should be.
void add_expectations(Json& components, const Scenario& scenario, const CellDescription& cell,
                      const Snapshot& state) {
  for (std::size_t i = 0; i < state.components.size(); ++i) {
    Json& item = components[cell.components[i].name];
    item["type"] = to_string(cell.components[i].type);
    const ExpectedPose* expected = expected_pose(scenario, cell.components[i].name);
    if (expected == nullptr) continue;
    const PoseError error = pose_error(state.components[i], expected->X_WB);
    item["expected_position"] = recording::message_json(to_vector(expected->X_WB.p), {});
    item["expected_orientation"] = recording::message_json(to_quaternion(expected->X_WB.quaternion()), {});
    item["position_error"] = error.position_m;
    item["orientation_error"] = error.angle_rad;
  }
}

Json imports_json(const RunInfo& info) {
  Json all = Json::array();
  for (const ConvexImport& import : info.convex_imports) {
    all.push_back({{"component", import.component},
                   {"method", import.method},
                   {"hulls", import.hulls},
                   {"solid_volume", import.solid_volume_m3},
                   {"union_volume", import.union_volume_m3},
                   {"lost", import.lost},
                   {"gained", import.gained},
                   {"duration", import.seconds},
                   {"from_cache", import.from_cache}});
  }
  return all;
}

Json notes_json(const CellDescription& cell, const RunInfo& info) {
  Json all = Json::array();
  for (const ImportNote& note : info.import_notes) {
    const bool robot = std::any_of(cell.robots.begin(), cell.robots.end(),
                                   [&](const RobotDescription& r) { return r.name == note.component; });
    all.push_back({{robot ? "robot" : "component", note.component}, {"sentence", note.sentence}});
    if (!note.shapes) continue;
    all.back()["hulls"] = note.shapes->hulls;
    all.back()["volume_error"] = note.shapes->volume_error;
  }
  return all;
}

Json collisions_json(const CellDescription& cell, const HeadlessResult& result) {
  Json all = Json::array();
  for (const CollisionEvent& event : result.collisions) {
    all.push_back({{"kind", to_string(event.kind)},
                   {"time", event.time_s},
                   {"step", event.step},
                   {"pair",
                    {cell.checked_bodies[static_cast<std::size_t>(event.a)],
                     cell.checked_bodies[static_cast<std::size_t>(event.b)]}},
                   {"limit", event.limit_m},
                   {"distance", event.distance_m},
                   {"depth", std::max(0.0, -event.distance_m)},
                   {"position", recording::message_json(to_vector(event.p_W), {})},
                   {"duration", event.duration_s}});
  }
  return all;
}

Json grips_json(const CellDescription& cell, const HeadlessResult& result) {
  Json all = Json::array();
  for (const GripExtreme& most : result.grips)
    all.push_back({{"gripper", cell.grippers[static_cast<std::size_t>(most.gripper)].name},
                   {"part", cell.components[static_cast<std::size_t>(most.load.part)].name},
                   {"time", most.time_s},
                   {"needed_force", most.load.needed_N},
                   {"force", most.load.force_N},
                   {"margin", most.load.needed_N > 0.0 ? Json(1.0 / most.use()) : Json(nullptr)}});
  return all;
}

Json device_messages_json(const CellDescription& cell, const HeadlessResult& result) {
  Json all = Json::array();
  for (const DeviceMessage& notice : result.device_messages)
    all.push_back({{"device", cell.devices[static_cast<std::size_t>(notice.device)].name},
                   {"time", notice.time_s},
                   {"sentence", notice.sentence}});
  return all;
}

Json alternating_forces_json(const CellDescription& cell, const HeadlessResult& result) {
  Json all = Json::array();
  for (const AlternatingForce& force : result.alternating_forces)
    all.push_back(
        {{"part", cell.components[static_cast<std::size_t>(force.part)].name},
         {"other", force.other < 0 ? Json(nullptr)
                                   : Json(cell.components[static_cast<std::size_t>(force.other)].name)},
         {"time", force.time_s},
         {"change", force.change_N}});
  return all;
}

Json statistics_json(const SimulationStatistics& s) {
  return {{"steps", s.steps},
          {"derivative_evaluations", s.derivative_evaluations},
          {"broad_phase_tests", s.broad_phase_tests},
          {"mpr_calls", s.mpr_calls},
          {"mpr_skipped", s.mpr_skipped},
          {"partner_searches", s.partner_searches},
          {"clearance_pairs", s.clearance_pairs},
          {"clearance_distances", s.clearance_distances}};
}

// Work of the solver within the steps of the simulation.
Json solver_json(const SolverStatistics& s) {
  return {{"steps", s.steps},
          {"rejected_steps", s.rejected_steps},
          {"evaluations", s.evaluations},
          {"jacobians", s.jacobians},
          {"factorisations", s.factorisations},
          {"newton_iterations", s.newton_iterations},
          {"newton_failures", s.newton_failures},
          {"forced_steps", s.forced_steps},
          {"restarts", s.restarts},
          {"mode_switches", s.mode_switches},
          {"smallest_step", s.smallest_step_s},
          {"largest_step", s.largest_step_s}};
}

/// Of each pair the largest normal force with its time, and the calls of the contact algorithm (Table 5.4).
void add_contact_extremes(Json& contacts, const InstantJson& instants, const HeadlessResult& result) {
  Json& largest = contacts["largest"] = Json::array();
  for (const ContactExtreme& extreme : result.contact_extremes) {
    Json& item = largest.emplace_back(instants.of(extreme.sample));
    item["time"] = extreme.time_s;
    item["largest_torque"] = extreme.torque_N_m.value;
    item["largest_torque_time"] = extreme.torque_N_m.time_s;
  }
  contacts["calls"] = {{"made", result.contact_counts.made},
                       {"skipped", result.contact_counts.skipped},
                       {"boxes_apart", result.contact_counts.boxes_apart},
                       {"rebuilds", result.contact_counts.rebuilds},
                       {"elements", result.contact_counts.elements}};
}

Json report_document(const Scenario& scenario, const CellDescription& cell, const RunInfo& info,
                     const HeadlessResult& result) {
  const double simulated_s = result.final_state.time_s;
  InstantJson instants(cell);
  Json report;
  report["scenario"] = scenario.name;
  report["level_of_detail"] = info.level_of_detail;
  report["pace"] = to_string(info.pace);
  report["wall_time"] = result.wall_s;
  report["cpu_time"] = result.cpu_s;
  report["controller_time"] = result.controller_s;
  if (result.run_metrics) report["gathering_time"] = result.gathering_s;
  report["real_time_factor"] = result.real_time_factor(simulated_s);
  report["computation_ratio"] = result.computation_ratio(simulated_s);
  report["verdict"] = verdict(result);
  report["fault"] = result.fault.empty() ? Json(nullptr) : Json(result.fault);
  if (!scenario.expected.empty()) {
    report["max_position_error"] = max_position_error_m(scenario, cell, result.final_state);
    report["tolerance"] = scenario.expected_tolerance_m;
  }
  report["convex_imports"] = imports_json(info);
  report["import_notes"] = notes_json(cell, info);
  report.update(Json(instants.of(result.final_state)));
  add_expectations(report["components"], scenario, cell, result.final_state);
  if (result.surface_contact) add_contact_extremes(report["contacts"], instants, result);
  if (result.run_metrics) {
    report["summary"] = run_summary_json(scenario, cell, result);
    report["run_metrics"] = run_metrics_json(cell, result);
  }
  if (!result.assertions.empty()) report["assertions"] = assertions_json(result.assertions);
  Json changes = Json::array();
  for (const ConnectionChange& change : result.changes) {
    changes.push_back({{"time", change.time_s},
                       {"step", change.step},
                       {"part", cell.components[static_cast<std::size_t>(change.part)].name},
                       {"from", name_or_null(cell, change.from)},
                       {"to", name_or_null(cell, change.to)}});
  }
  report["connection_changes"] = changes;
  report["warnings"] = warnings_json(result);
  report["further_warnings"] = result.further_warnings;
  report["collisions"] = collisions_json(cell, result);
  report["grips"] = grips_json(cell, result);
  report["alternating_forces"] = alternating_forces_json(cell, result);
  if (!result.device_messages.empty()) report["device_messages"] = device_messages_json(cell, result);
  Json instants_reported = Json::array();
  for (const ReportedInstant& reported : result.report_at) {
    Json& item = instants_reported.emplace_back();
    item["name"] = reported.instant.name;
    item.update(Json(instants.of(reported.snapshot)));
  }
  report["report_at"] = std::move(instants_reported);
  report["solver"] = statistics_json(result.statistics);
  report["solver"]["method"] = info.solver;
  report["solver"]["step_size"] = cell.step_s;
  if (solver_has_error_control(info.solver)) report["solver"]["tolerance"] = scenario.initial_tolerance();
  report["solver"]["work"] = solver_json(result.statistics.solver);
  return report;
}

}  // namespace

const ExpectedPose* expected_pose(const Scenario& scenario, const std::string& part) {
  for (const ExpectedPose& expected : scenario.expected) {
    if (expected.part == part) return &expected;
  }
  return nullptr;
}

double max_position_error_m(const Scenario& scenario, const CellDescription& cell, const Snapshot& state) {
  double largest = 0.0;
  for (const ExpectedPose& expected : scenario.expected) {
    const auto id = static_cast<std::size_t>(cell.find_component(expected.part));
    largest = std::max(largest, pose_error(state.components[id], expected.X_WB).position_m);
  }
  return largest;
}

std::string_view verdict(const HeadlessResult& result) {
  if (!result.fault.empty()) return "fault";
  for (const AssertionResult& demand : result.assertions)
    if (demand.verdict == AssertionResult::Verdict::failed) return "failed";
  return "passed";
}

std::string report_json(const Scenario& scenario, const CellDescription& cell, const RunInfo& info,
                        const HeadlessResult& result) {
  return report_document(scenario, cell, info, result).dump(2);
}

void write_html(std::ostream& out, const Scenario& scenario, const CellDescription& cell, const RunInfo& info,
                const HeadlessResult& result) {
  write_html_report(out, report_document(scenario, cell, info, result), result.run_metrics->curves,
                    picture_bytes(cell, RobotShapes(scenario, cell, info.packages), result.final_state));
}

}  // namespace takt

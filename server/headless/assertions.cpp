#include "server/headless/assertions.h"

#include <algorithm>
#include <cmath>
#include <iomanip>
#include <nlohmann/json.hpp>
#include <numbers>

#include "idl/common/glob.h"
#include "idl/common/text.h"
#include "idl/common/xml.h"
#include "server/headless/device_report.h"
#include "server/headless/headless_run.h"
#include "server/headless/svg_plot.h"
#include "server/scenario/scenario_reader.h"

namespace takt {

namespace {

using Kind = ScenarioAssertion::Kind;
using Verdict = AssertionResult::Verdict;

const char* name_of(Kind kind) {
  switch (kind) {
    case Kind::contact_force:
      return "contact_force";
    case Kind::pose:
      return "pose";
    case Kind::held_by:
      return "held_by";
    case Kind::energy:
      return "energy";
    case Kind::signal:
      return "signal";
    case Kind::grip_margin:
      return "grip_margin";
    case Kind::no_collision:
      break;
  }
  return "no_collision";
}

std::string interval(const ScenarioAssertion& assertion, const std::string& unit) {
  const bool above = std::isfinite(assertion.lower), below = std::isfinite(assertion.upper);
  std::string text;
  if (above) text += "at least " + number_text(assertion.lower, 6) + unit;
  if (above && below) text += " and ";
  if (below) text += "at most " + number_text(assertion.upper, 6) + unit;
  return text;
}

/// Of mm or degrees, without the digits of rounding errors: below 1 nm, 1e-6 deg.
std::string rounded_text(double value) {
  return number_text(1e-6 * std::round(1e6 * value), 6);
}

std::string unit_of(const CellDescription& cell, const std::string& device, const std::string& signal) {
  for (const SignalDescription& one :
       cell.devices[static_cast<std::size_t>(cell.find_device(device))].signals)
    if (one.name == signal) return one.unit;
  return "";
}

}  // namespace

const char* to_string(Verdict verdict) {
  return verdict == Verdict::passed ? "passed" : verdict == Verdict::failed ? "failed" : "skipped";
}

AssertionChecker::AssertionChecker(const Scenario& scenario, const Simulation& simulation)
    : scenario_(scenario),
      cell_(simulation.description()),
      judged_(scenario.assertions.size(), 0),
      largest_N_(scenario.assertions.size(), 0.0),
      largest_time_s_(scenario.assertions.size(), 0.0),
      grips_(scenario.assertions.size()),
      snapshot_(simulation.make_snapshot()) {
  for (const ScenarioAssertion& assertion : scenario.assertions) {
    results_.push_back({assertion.name, name_of(assertion.kind), Verdict::skipped, "", 0.0});
    watches_contacts_ = watches_contacts_ || assertion.kind == Kind::contact_force;
    if (assertion.kind == Kind::contact_force) {
      for (const std::string& pattern : assertion.pair)
        if (std::none_of(cell_.components.begin(), cell_.components.end(),
                         [&](const ComponentDescription& c) { return glob_match(pattern, c.name); }))
          throw ScenarioError(scenario.file.string() + ": " + assertion.place + ".pair: found '" + pattern +
                              "', which fits no component");
    }
    if (assertion.kind != Kind::signal || signal_value(cell_, snapshot_, assertion.subject, assertion.signal))
      continue;
    const auto device = static_cast<std::size_t>(cell_.find_device(assertion.subject));
    throw ScenarioError(scenario.file.string() + ": " + assertion.place + ".signal: found '" +
                        assertion.signal + "'; allowed: " + list_names(cell_.devices[device].signals));
  }
}

void AssertionChecker::note(const Simulation& simulation) {
  if (watches_contacts_) note_contacts(simulation);
  if (!simulation.events().collision_events.empty()) note_collisions(simulation);
  note_grips(simulation);
  bool read = false;
  for (std::size_t i = 0; i < scenario_.assertions.size(); ++i) {
    const ScenarioAssertion& assertion = scenario_.assertions[i];
    if (judged_[i] != 0 || assertion.time_s < 0.0 ||
        simulation.time_s() < assertion.time_s - 0.5 * cell_.step_s)
      continue;
    if (!read) simulation.read_snapshot(snapshot_);
    read = true;
    judge(i, simulation);
  }
}

void AssertionChecker::note_contacts(const Simulation& simulation) {
  simulation.read_contact_peaks(contacts_);
  const ContactCallCounts counts = simulation.contact_counts();
  saw_contacts_ = saw_contacts_ || counts.made + counts.skipped + counts.boxes_apart > 0;
  for (const auto& [time_s, sample] : contacts_) {
    const std::string& base = cell_.components[static_cast<std::size_t>(sample.base)].name;
    const std::string& target = cell_.components[static_cast<std::size_t>(sample.target)].name;
    for (std::size_t i = 0; i < scenario_.assertions.size(); ++i) {
      const ScenarioAssertion& assertion = scenario_.assertions[i];
      if (assertion.kind != Kind::contact_force || judged_[i] != 0 ||
          !glob_match(assertion.pair, base, target))
        continue;
      if (sample.result.normal_force_N <= largest_N_[i]) continue;
      largest_N_[i] = sample.result.normal_force_N;
      largest_time_s_[i] = time_s;
    }
  }
}

void AssertionChecker::note_collisions(const Simulation& simulation) {
  for (const CollisionEvent& event : simulation.events().collision_events) {
    if (event.kind != CollisionEvent::Kind::collision) continue;
    for (std::size_t i = 0; i < scenario_.assertions.size(); ++i) {
      if (scenario_.assertions[i].kind != Kind::no_collision || judged_[i] != 0) continue;
      judged_[i] = 1;
      results_[i].verdict = Verdict::failed;
      results_[i].time_s = event.time_s;
      results_[i].sentence = cell_.checked_bodies[static_cast<std::size_t>(event.a)] + " and " +
                             cell_.checked_bodies[static_cast<std::size_t>(event.b)] + " overlap by " +
                             number_text(-1e3 * event.distance_m, 6) + " mm";
    }
  }
}

void AssertionChecker::note_grips(const Simulation& simulation) {
  for (std::size_t i = 0; i < scenario_.assertions.size(); ++i) {
    const ScenarioAssertion& assertion = scenario_.assertions[i];
    if (assertion.kind != Kind::grip_margin || judged_[i] != 0) continue;
    for (std::size_t g = 0; g < cell_.grippers.size(); ++g) {
      const GripLoad& load = simulation.grip_load(g);
      if (cell_.grippers[g].name != assertion.subject || load.part < 0 || !(load.needed_N > 0.0)) continue;
      const double margin = load.force_N / load.needed_N;
      if (grips_[i] && margin >= *grips_[i]) continue;
      grips_[i] = margin;
      largest_time_s_[i] = simulation.time_s();
    }
  }
}

void AssertionChecker::judge_number(std::size_t i, double value, const char* what, const std::string& unit) {
  const ScenarioAssertion& assertion = scenario_.assertions[i];
  const std::string after = unit.empty() ? "" : " " + unit;
  results_[i].verdict =
      value >= assertion.lower && value <= assertion.upper ? Verdict::passed : Verdict::failed;
  results_[i].value = value;
  if (std::isfinite(assertion.lower)) results_[i].lower = assertion.lower;
  if (std::isfinite(assertion.upper)) results_[i].upper = assertion.upper;
  results_[i].sentence =
      std::string(what) + " is " + number_text(value, 6) + after + "; allowed: " + interval(assertion, after);
  results_[i].unit = unit;
}

void AssertionChecker::judge_pose(std::size_t i) {
  const ScenarioAssertion& assertion = scenario_.assertions[i];
  const PoseError error =
      pose_error(snapshot_.components[static_cast<std::size_t>(cell_.find_component(assertion.subject))],
                 assertion.X_WB);
  const bool angle_counts = std::isfinite(assertion.tolerance_rad);
  constexpr double kDegree = std::numbers::pi / 180.0;
  results_[i].verdict =
      error.position_m <= assertion.tolerance_m && error.angle_rad <= assertion.tolerance_rad
          ? Verdict::passed
          : Verdict::failed;
  results_[i].value = error.position_m;
  results_[i].upper = assertion.tolerance_m;
  results_[i].unit = "m";
  results_[i].sentence =
      assertion.subject + " is " + rounded_text(1e3 * error.position_m) + " mm and " +
      rounded_text(error.angle_rad / kDegree) +
      " deg away; allowed: " + number_text(1e3 * assertion.tolerance_m, 6) + " mm" +
      (angle_counts ? " and " + number_text(assertion.tolerance_rad / kDegree, 6) + " deg" : "");
}

void AssertionChecker::judge_holder(std::size_t i) {
  const ScenarioAssertion& assertion = scenario_.assertions[i];
  const int partner =
      snapshot_.components[static_cast<std::size_t>(cell_.find_component(assertion.subject))].partner;
  const std::string found =
      partner < 0 ? "nothing" : cell_.components[static_cast<std::size_t>(partner)].name;
  const std::string wanted = assertion.holder.empty() ? "nothing" : assertion.holder;
  results_[i].verdict = found == wanted ? Verdict::passed : Verdict::failed;
  results_[i].sentence = assertion.subject + " is held by " + found + "; demanded: " + wanted;
}

void AssertionChecker::judge(std::size_t i, const Simulation& simulation) {
  const ScenarioAssertion& assertion = scenario_.assertions[i];
  AssertionResult& result = results_[i];
  judged_[i] = 1;
  result.time_s = simulation.time_s();
  switch (assertion.kind) {
    case Kind::contact_force:
      if (!saw_contacts_) {
        result.sentence = "no surface contact acts at this level of detail";
        return;
      }
      judge_number(i, largest_N_[i], "the largest normal force", "N");
      result.time_s = largest_time_s_[i];
      return;
    case Kind::pose:
      return judge_pose(i);
    case Kind::held_by:
      return judge_holder(i);
    case Kind::energy:
      result.sentence = assertion.subject + " draws energy from level of detail 2 on";
      for (const ConsumedEnergy& one : consumed_energies(cell_, snapshot_))
        if (one.consumer == assertion.subject) judge_number(i, one.energy_J, "the energy", "J");
      return;
    case Kind::signal:
      return judge_number(i, *signal_value(cell_, snapshot_, assertion.subject, assertion.signal),
                          assertion.signal.c_str(), unit_of(cell_, assertion.subject, assertion.signal));
    case Kind::grip_margin:
      if (!grips_[i]) {
        result.sentence =
            assertion.subject + " gripped nothing that friction carries at this level of detail";
        return;
      }
      judge_number(i, *grips_[i], "the least force over what friction needs", "");
      result.time_s = largest_time_s_[i];
      return;
    case Kind::no_collision:
      result.verdict = Verdict::passed;
      result.sentence = "nothing overlaps";
      return;
  }
}

std::vector<AssertionResult> AssertionChecker::finish(const Simulation& simulation,
                                                      const std::string& fault) {
  simulation.read_snapshot(snapshot_);
  for (std::size_t i = 0; i < results_.size(); ++i) {
    if (judged_[i] != 0) continue;
    const double due_s = scenario_.assertions[i].time_s;
    if (fault.empty() && due_s < 0.0) {
      judge(i, simulation);
      continue;
    }
    results_[i].verdict = Verdict::failed;
    results_[i].time_s = simulation.time_s();
    results_[i].sentence = "the run ended at " + number_text(simulation.time_s(), 6) + " s" +
                           (due_s < 0.0 ? ", before its end" : ", before " + number_text(due_s, 6) + " s");
  }
  return results_;
}

std::vector<AssertionResult> judge_expected(const Scenario& scenario, const CellDescription& cell,
                                            const Snapshot& end) {
  std::vector<AssertionResult> results;
  const double most_m = scenario.expected_tolerance_m;
  for (const ExpectedPose& expected : scenario.expected) {
    const auto part = static_cast<std::size_t>(cell.find_component(expected.part));
    const double error_m = pose_error(end.components[part], expected.X_WB).position_m;
    AssertionResult& one = results.emplace_back();
    one.name = "expected " + expected.part;
    one.kind = "expected";
    one.verdict = error_m <= most_m ? Verdict::passed : Verdict::failed;
    one.value = error_m;
    one.upper = most_m;
    one.unit = "m";
    one.time_s = end.time_s;
    one.sentence = expected.part + " is " + rounded_text(1e3 * error_m) +
                   " mm away from its expected place; allowed: " + number_text(1e3 * most_m, 6) + " mm";
  }
  return results;
}

nlohmann::ordered_json assertions_json(const std::vector<AssertionResult>& results) {
  nlohmann::ordered_json all = nlohmann::ordered_json::object();
  for (const AssertionResult& result : results) {
    nlohmann::ordered_json& item = all[result.name];
    item = {{"check", result.kind},
            {"verdict", to_string(result.verdict)},
            {"time", result.time_s},
            {"sentence", result.sentence}};
    if (result.value) item["value"] = *result.value;
    if (result.lower) item["at_least"] = *result.lower;
    if (result.upper) item["at_most"] = *result.upper;
  }
  return all;
}

void print_assertions(std::ostream& out, const std::vector<AssertionResult>& results) {
  for (const AssertionResult& result : results)
    out << std::left << std::setw(8) << to_string(result.verdict) << std::right << result.name << ": "
        << result.sentence << " (" << number_text(result.time_s, 6) << " s)\n";
}

void write_junit(std::ostream& out, const std::string& scenario, double seconds, const std::string& fault,
                 const std::vector<AssertionResult>& results) {
  const auto count = [&](Verdict verdict) {
    return std::count_if(results.begin(), results.end(),
                         [verdict](const AssertionResult& r) { return r.verdict == verdict; });
  };
  const std::string suite = xml_escaped(scenario);
  out << "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<testsuites>\n  <testsuite name=\"" << suite
      << "\" tests=\"" << results.size() + 1 << "\" failures=\"" << count(Verdict::failed) << "\" errors=\""
      << (fault.empty() ? 0 : 1) << "\" skipped=\"" << count(Verdict::skipped) << "\" time=\"" << seconds
      << "\">\n    <testcase classname=\"" << suite << "\" name=\"run\" time=\"" << seconds << "\"";
  if (fault.empty())
    out << "/>\n";
  else
    out << ">\n      <error message=\"" << xml_escaped(fault) << "\"/>\n    </testcase>\n";
  for (const AssertionResult& result : results) {
    out << "    <testcase classname=\"" << suite << "\" name=\"" << xml_escaped(result.name)
        << "\" time=\"0\">\n";
    if (result.verdict == Verdict::failed)
      out << "      <failure type=\"" << result.kind << "\" message=\"" << xml_escaped(result.sentence)
          << "\"/>\n";
    else if (result.verdict == Verdict::skipped)
      out << "      <skipped message=\"" << xml_escaped(result.sentence) << "\"/>\n";
    else
      out << "      <system-out>" << xml_escaped(result.sentence) << "</system-out>\n";
    out << "    </testcase>\n";
  }
  out << "  </testsuite>\n</testsuites>\n";
}

}  // namespace takt

#pragma once
// Checks the section `assertions` of a scenario during a run.
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <ostream>
#include <string>
#include <vector>

#include "server/scenario/scenario.h"
#include "server/simulation/step/simulation.h"

namespace takt {

struct AssertionResult {
  enum class Verdict {
    passed,
    failed,
    skipped,  ///< no data for a verdict, e.g. contact forces below level of detail 3
  };
  std::string name, kind;
  Verdict verdict = Verdict::skipped;
  std::string sentence;  ///< the value found and the values allowed
  double time_s = 0.0;   ///< of the finding
  /// For a verdict on a number (SI units): the number and the limits; absent otherwise.
  std::optional<double> value{}, lower{}, upper{};
  std::string unit{};  ///< of these; empty: a pure number
};
const char* to_string(AssertionResult::Verdict verdict);

class AssertionChecker {
 public:
  /// All arguments must outlive it. Throws ScenarioError for a signal that the device lacks, or names that
  /// fit no object.
  AssertionChecker(const Scenario& scenario, const Simulation& simulation);
  /// Some assertion needs Simulation::watch_contact_peaks().
  bool watches_contacts() const { return watches_contacts_; }
  /// Call it with the initial state and after every step.
  void note(const Simulation& simulation);
  /// At the end; `fault`: the reason if the run ended early, or empty. Assertions whose time was not reached
  /// have failed.
  std::vector<AssertionResult> finish(const Simulation& simulation, const std::string& fault);

 private:
  void judge(std::size_t i, const Simulation& simulation);
  void judge_pose(std::size_t i);
  void judge_holder(std::size_t i);
  void judge_number(std::size_t i, double value, const char* what, const std::string& unit);
  void note_contacts(const Simulation& simulation);
  void note_collisions(const Simulation& simulation);
  void note_grips(const Simulation& simulation);

  const Scenario& scenario_;
  const CellDescription& cell_;
  std::vector<AssertionResult> results_;
  std::vector<char> judged_;
  std::vector<double> largest_N_, largest_time_s_;  ///< of contact_force; the time of grip_margin too
  std::vector<std::optional<double>> grips_;        ///< least of grip_margin
  bool watches_contacts_ = false, saw_contacts_ = false;
  Snapshot snapshot_;
  std::vector<ContactPeak> contacts_;
};

/// The section `expected`: a verdict for each Part, at the end of a run that has reached the scenario's duration.
std::vector<AssertionResult> judge_expected(const Scenario& scenario, const CellDescription& cell,
                                            const Snapshot& end);

/// By name: verdict, sentence, time.
nlohmann::ordered_json assertions_json(const std::vector<AssertionResult>& results);
void print_assertions(std::ostream& out, const std::vector<AssertionResult>& results);
/// JUnit XML, as continuous integration reads it: one test case each, and one for the run itself.
void write_junit(std::ostream& out, const std::string& scenario, double seconds, const std::string& fault,
                 const std::vector<AssertionResult>& results);

}  // namespace takt

#pragma once
// Two reports of the same process side by side: which differences count, and whether the cheaper run says
// enough ("LoD 1 is enough here").
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <ostream>
#include <string>
#include <vector>

namespace takt {

/// What two runs may differ by before it counts.
struct ComparisonLimits {
  double time_s = 0.05;      ///< of steps, the cycle, and changes of who holds a Part
  double position_m = 1e-3;  ///< of Parts at the end
  double angle_rad = 0.02;   ///< the same
  double energy = 0.05;      ///< of each consumer, as a share of the larger one
  double torque = 0.10;      ///< of joints, as a share of the joint's limit (without one: of the larger one)
  double force = 0.20;       ///< between components, as a share of the larger one
  double use = 0.90;         ///< share of a limit that only one of the runs knows of and may use up
  double least_force_N = 5.0;  ///< contact forces below are not looked at
};
/// "NAME=VALUE", names as above. Throws ScenarioError.
void set_limit(ComparisonLimits& limits, const std::string& text);

struct Difference {
  std::string of, unit;
  std::optional<double> a, b;  ///< absent: that run does not tell
  double difference = 0.0;     ///< in the unit of `limit`
  double limit = 0.0;
  bool share = false;  ///< difference and limit are shares, not in `unit`
  bool counts() const { return difference > limit; }
};

struct Comparison {
  std::vector<Difference> differences;      ///< those that use most of their limits first
  std::vector<std::string> contradictions;  ///< faults, verdicts, and who holds what: differ at all
  std::string verdict;                      ///< a sentence
  bool enough = false;                      ///< nothing counts
};

/// Of two JSON reports with a section "process". Throws ScenarioError where they are not of one scenario.
Comparison compare_reports(const nlohmann::ordered_json& a, const nlohmann::ordered_json& b,
                           const ComparisonLimits& limits);

void print_comparison(std::ostream& out, const nlohmann::ordered_json& a, const nlohmann::ordered_json& b,
                      const Comparison& comparison, const ComparisonLimits& limits);
/// The same of two files, printed; written too where `json` is not empty. Returns whether nothing counts.
/// Throws ScenarioError for a file that is no report, std::runtime_error where writing fails.
bool compare_files(std::ostream& out, const std::string& a, const std::string& b, const std::string& json,
                   const ComparisonLimits& limits);
nlohmann::ordered_json comparison_json(const Comparison& comparison, const ComparisonLimits& limits);

}  // namespace takt

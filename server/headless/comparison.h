#pragma once
// Compares two reports of the same process: the differences that count, and whether the cheaper run is
// sufficient ("LoD 1 is enough here").
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <ostream>
#include <string>
#include <vector>

namespace takt {

/// Differences of two runs up to these limits do not count.
struct ComparisonLimits {
  double time_s = 0.05;      ///< of steps, the cycle, and changes of a Part's holder
  double position_m = 1e-3;  ///< of Parts at the end
  double angle_rad = 0.02;   ///< the same
  double energy = 0.05;      ///< of each consumer, as a share of the larger one
  double torque = 0.10;      ///< of joints, as a share of the joint's limit (without one: of the larger one)
  double force = 0.20;       ///< between components, as a share of the larger one
  double use = 0.90;         ///< permitted share of a limit that only one of the runs can evaluate
  double least_force_N = 5.0;  ///< smaller contact forces are ignored
};
/// "NAME=VALUE", names as above. Throws ScenarioError.
void set_limit(ComparisonLimits& limits, const std::string& text);

struct Difference {
  std::string of, unit;
  std::optional<double> a, b;  ///< absent: unknown in that run
  double difference = 0.0;     ///< in the unit of `limit`
  double limit = 0.0;
  bool share = false;  ///< difference and limit are shares, not in `unit`
  bool counts() const { return difference > limit; }
};

struct Comparison {
  std::vector<Difference> differences;      ///< those with the largest share of their limits first
  std::vector<std::string> contradictions;  ///< differences of faults, verdicts and holders
  std::string verdict;                      ///< a sentence
  bool enough = false;                      ///< no difference counts
};

/// Of two JSON reports with a section "run_metrics". Throws ScenarioError where they are not of one scenario.
Comparison compare_reports(const nlohmann::ordered_json& a, const nlohmann::ordered_json& b,
                           const ComparisonLimits& limits);

void print_comparison(std::ostream& out, const nlohmann::ordered_json& a, const nlohmann::ordered_json& b,
                      const Comparison& comparison, const ComparisonLimits& limits);
/// The same for two files, printed, and written if `json` is not empty. Returns whether no difference counts.
/// Throws ScenarioError for a file that is no report, std::runtime_error for a failed write.
bool compare_files(std::ostream& out, const std::string& a, const std::string& b, const std::string& json,
                   const ComparisonLimits& limits);
nlohmann::ordered_json comparison_json(const Comparison& comparison, const ComparisonLimits& limits);

}  // namespace takt

#pragma once
// The plan of a verification and validation report (YAML, docs/verification.md): scenes, each a scenario with a quantity, a
// reference, resolutions, uncertain inputs and the limit of its verdict.
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "server/fields/fields.h"
#include "server/fields/scenario_error.h"

namespace takt {

/// What a result is compared with: a value that is stated, computed or measured, or an upper bound.
struct VerificationReference {
  std::optional<double> value;
  std::string formula, formula_place;  ///< closed form of `value` (closed_form.h)
  bool bound = false;                  ///< `value` is an upper bound
  std::filesystem::path measurement;  ///< CSV with the columns value and standard_uncertainty; empty: `value`
  bool exact = false;                 ///< `value` solves the equations of the model: errors have an order
  double standard_uncertainty = 0.0;  ///< of `value`; with a measurement computed from its rows
  std::string source;
  std::string differences;  ///< of the model from that of the source, with the reason
  int rows = 0;             ///< of the measurement
};

/// Runs from coarse to fine. Each level is a list of KEY=VALUE, as one mesh may be that of several components.
struct VerificationResolution {
  std::string name;
  std::string key;  ///< where one key is refined; its values are the levels
  std::vector<std::vector<std::string>> levels;
  std::vector<double> sizes;  ///< of the levels; numbers are their own sizes
  std::optional<double> formal_order;
};

struct VerificationInput {
  std::string name, key;
  double value = 0.0, standard_uncertainty = 0.0;
};

struct VerificationScene {
  std::string name, description;
  std::filesystem::path scenario;
  std::optional<int> level_of_detail;
  std::optional<double> duration_s;
  std::vector<std::string> settings;  ///< "KEY=VALUE"
  std::string quantity, unit;         ///< dotted path in the report of a run
  std::string quantity_place;         ///< of the key, for errors
  VerificationReference reference;
  std::vector<VerificationResolution> resolutions;  ///< empty: a single run
  std::vector<VerificationInput> inputs;
  double coverage_factor = 2.0;
  std::optional<double> tolerance;
};

void describe(Fields& f, VerificationReference& r);
void describe(Fields& f, VerificationResolution& r);
void describe(Fields& f, VerificationInput& i);
void describe(Fields& f, VerificationScene& s);

struct VerificationPlan {
  std::filesystem::path file;
  std::string name, description;
  std::string preparation;  ///< command that makes files which the plan needs and does not bring, or empty
  std::vector<VerificationScene> scenes;
};

/// Throws ScenarioError with file, line, column, key, the value found and the values allowed; the same for the tables of
/// measurements.
VerificationPlan read_verification_plan(const std::filesystem::path& file);

/// Mean of the rows. Its standard uncertainty is the root of the squares of the mean stated uncertainty, which is taken as
/// common to all rows, and of the standard deviation of the mean. Throws ScenarioError with file, line and column.
VerificationReference read_measurement(const std::filesystem::path& file);

}  // namespace takt

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

/// What a result is compared with: a stated value, or the mean of measurements in a table.
struct VerificationReference {
  std::optional<double> value;
  std::filesystem::path measurement;  ///< CSV with the columns value and standard_uncertainty; empty: `value`
  bool exact = false;                 ///< `value` solves the equations of the model: errors have an order
  double standard_uncertainty = 0.0;  ///< of `value`; with a measurement computed from its rows
  std::string source;
  int rows = 0;  ///< of the measurement
};

/// The key that is refined, with its values. Texts, as mesh files are values too.
struct VerificationResolution {
  std::string key;
  std::vector<std::string> values;
  std::vector<double> sizes;  ///< of the values; numbers are their own sizes
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
  VerificationResolution resolution;
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
  std::vector<VerificationScene> scenes;
};

/// Throws ScenarioError with file, line, column, key, the value found and the values allowed; the same for the tables of
/// measurements.
VerificationPlan read_verification_plan(const std::filesystem::path& file);

/// Mean of the rows. Its standard uncertainty is the root of the squares of the mean stated uncertainty, which is taken as
/// common to all rows, and of the standard deviation of the mean. Throws ScenarioError with file, line and column.
VerificationReference read_measurement(const std::filesystem::path& file);

}  // namespace takt

#pragma once
// Verification and validation of the scenes of a plan in the terms of ASME V&V 10 and 20: code verification (order of the
// errors against an exact value) and solution verification (grid convergence index) of each refinement, uncertainty of
// inputs, comparison error.
#include <functional>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "server/headless/grid_convergence.h"
#include "server/headless/verification_plan.h"
#include "server/scenario/scenario_builder.h"

namespace takt {

enum class VerificationVerdict { good, bad, not_demanded };

/// A file on which the results depend, with the digest of its bytes.
struct VerifiedFile {
  std::string role, file, digest;
};

struct VerifiedRun {
  std::string setting;  ///< of the refined keys
  GridPoint point;
  std::optional<double> error_order;  ///< with the next coarser run, against an exact value
};

/// A refinement; all others are at their finest.
struct VerifiedResolution {
  VerificationResolution plan;
  std::vector<VerifiedRun> runs;  ///< the finest first
  GridConvergence convergence;
  double u_num = 0.0;
  VerificationVerdict code = VerificationVerdict::not_demanded, solution = VerificationVerdict::bad;
  std::string code_sentence, solution_sentence;
  bool good() const { return code != VerificationVerdict::bad && solution == VerificationVerdict::good; }
};

struct VerifiedInput {
  VerificationInput input;
  double below = 0.0, above = 0.0;  ///< results at the value less and plus the standard uncertainty
  double uncertainty() const;
};

struct VerifiedScene {
  VerificationScene plan;
  std::vector<VerifiedResolution> resolutions;
  std::vector<VerifiedInput> inputs;
  double result = 0.0;  ///< of the finest run
  double error = 0.0;   ///< E: result less reference
  double u_num = 0.0, u_input = 0.0, u_reference = 0.0, u_val = 0.0;
  std::optional<double>
      good_from;  ///< results from here to `good_to` are good; no lower end beside an upper bound
  double good_to = 0.0;
  VerificationVerdict comparison = VerificationVerdict::bad;
  std::string comparison_sentence;
  std::vector<std::string> notes;  ///< of the imports
  std::string fault;               ///< of the first run that ended early or could not be loaded, or empty
  bool run = true;                 ///< false: a scenario could not be loaded, which `fault` states
  std::string model_hash;
  std::vector<VerifiedFile> files;
  bool good() const;
};

struct Verification {
  VerificationPlan plan;
  std::string version;
  std::vector<VerifiedScene> scenes;
  bool good() const;
};

struct VerificationOptions {
  std::string version;                                              ///< of the program
  std::vector<std::string> scenes;                                  ///< names of those to run; empty: all
  ImportOptions import;                                             ///< of all scenarios
  std::function<std::string(const std::filesystem::path&)> digest;  ///< of a file
  std::function<void(const std::string&)> progress = [](const std::string&) {};  ///< called before each run
};

/// The number at a dotted path of a report; names of objects may have dots, elements of lists are named by their number
/// or their member `name`. Throws ScenarioError, which begins with `place`, where there is no number.
double number_at(const nlohmann::ordered_json& report, const std::string& path, const std::string& place);

/// Runs the scenes. Throws ScenarioError for unknown names and for quantities that are wrong; a scenario that cannot be
/// loaded and a run that ends early are the fault of their scene.
Verification verify(const VerificationPlan& plan, const VerificationOptions& options);

}  // namespace takt

#pragma once
// Verification and validation of the scenes of a plan in the terms of ASME V&V 10 and 20: code verification (order of the
// errors against an exact value), solution verification (grid convergence index), uncertainty of inputs, comparison error.
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
  std::string setting;  ///< value of the refined key
  GridPoint point;
  std::optional<double> error_order;  ///< with the next coarser run, against an exact value
};

struct VerifiedInput {
  VerificationInput input;
  double below = 0.0, above = 0.0;  ///< results at the value less and plus the standard uncertainty
  double uncertainty() const;
};

struct VerifiedScene {
  VerificationScene plan;
  std::vector<VerifiedRun> runs;  ///< the finest first
  GridConvergence convergence;
  std::vector<VerifiedInput> inputs;
  double error = 0.0;  ///< E: finest result less reference
  double u_num = 0.0, u_input = 0.0, u_reference = 0.0, u_val = 0.0;
  double limit = 0.0;  ///< of |E|
  VerificationVerdict code = VerificationVerdict::not_demanded, solution = VerificationVerdict::bad,
                      comparison = VerificationVerdict::bad;
  std::string code_sentence, solution_sentence, comparison_sentence;
  std::string fault;  ///< of the first run that ended early, or empty
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
  std::string version;                                                           ///< of the program
  ImportOptions import;                                                          ///< of all scenarios
  std::function<std::string(const std::filesystem::path&)> digest;               ///< of a file
  std::function<void(const std::string&)> progress = [](const std::string&) {};  ///< called before each run
};

/// The number at a dotted path of a report; names of objects may have dots, elements of lists are named by their number
/// or their member `name`. Throws ScenarioError, which begins with `place`, where there is no number.
double number_at(const nlohmann::ordered_json& report, const std::string& path, const std::string& place);

/// Runs all scenes. Throws ScenarioError for scenarios, settings and quantities that are wrong; a run that ends early is the
/// fault of its scene.
Verification verify(const VerificationPlan& plan, const VerificationOptions& options);

}  // namespace takt

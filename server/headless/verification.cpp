#include "server/headless/verification.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numeric>
#include <set>

#include "idl/common/mesh_path.h"
#include "idl/common/text.h"
#include "server/headless/report.h"
#include "server/scenario/note_sentences.h"
#include "server/scenario/scenario_reader.h"
#include "server/simulation/model/model_hash.h"

namespace takt {

namespace {

using Json = nlohmann::ordered_json;
using Verdict = VerificationVerdict;

/// u_num is the index divided by this: the index is an interval with a coverage of about 95 %.
constexpr double kIndexCoverage = 2.0;

// Without an order the uncertainty of the finest result is this many times the range of all results (Eca and Hoekstra 2014);
// the solution is good where that is below a tenth of a stated tolerance.
constexpr double kRangeFactor = 3.0, kPartOfTolerance = 0.1;

/// A run that ended early.
struct RunFault {
  std::string sentence;
};

/// A run that did not begin: its scenario cannot be loaded.
struct LoadFault {
  std::string sentence;
};

/// Walks down; a name of an object may contain dots. Notes the names of the deepest place that it reaches.
const Json* walk(const Json& at, const std::string& path, std::vector<std::string>& choices) {
  if (path.empty()) return &at;
  if (!at.is_structured()) return nullptr;
  choices.clear();
  if (at.is_array()) {
    for (std::size_t i = 0; i < at.size(); ++i)
      choices.push_back(at[i].is_object() && at[i].contains("name") && at[i]["name"].is_string()
                            ? at[i]["name"].get<std::string>()
                            : std::to_string(i));
  } else {
    for (const auto& [key, value] : at.items()) choices.push_back(key);
  }
  const std::vector<std::string> here = choices;
  for (std::size_t i = 0; i < here.size(); ++i) {
    const std::string& name = here[i];
    if (!path.starts_with(name) || (path.size() > name.size() && path[name.size()] != '.')) continue;
    const Json& next = at.is_array() ? at[i] : at[name];
    const std::string rest = path.size() > name.size() ? path.substr(name.size() + 1) : "";
    if (const Json* found = walk(next, rest, choices)) return found;
  }
  return nullptr;
}

class SceneRunner {
 public:
  SceneRunner(const VerificationScene& scene, const VerificationOptions& options, VerifiedScene& result)
      : scene_(scene), options_(options), result_(result) {}

  /// The quantity with these settings beside those of the scene. Throws RunFault and LoadFault.
  double operator()(const std::vector<std::string>& settings) {
    options_.progress(scene_.name + (settings.empty() ? "" : ": ") + join(settings, ", "));
    ScenarioOptions scenario_options;
    scenario_options.overrides = scene_.settings;
    for (const VerificationInput& input : scene_.inputs)
      scenario_options.overrides.push_back(input.key + "=" + exact_text(input.value));
    for (const std::string& setting : settings) scenario_options.overrides.push_back(setting);
    scenario_options.level_of_detail = scene_.level_of_detail;
    const auto [scenario, cell] = load(scenario_options);
    HeadlessOptions run;
    run.duration_s = scene_.duration_s.value_or(scenario.duration_s);
    run.program = scenario.controller_program;
    run.run_metrics = true;
    if (!(run.duration_s > 0.0))
      throw ScenarioError(scene_.quantity_place +
                          ": the scenario has no duration; allowed: duration_s here or in " +
                          scenario.file.string());
    Simulation simulation(cell);
    const HeadlessResult done = run_headless(simulation, scenario, run);
    note_files(scenario, *cell);
    if (!done.fault.empty()) throw RunFault{done.fault};
    const RunInfo info{scenario.initial_solver(), cell->description.level_of_detail, Pace::free,
                       cell->convex_imports, cell->import_notes};
    return number_at(Json::parse(report_json(scenario, cell->description, info, done)), scene_.quantity,
                     scene_.quantity_place);
  }

 private:
  std::pair<Scenario, std::shared_ptr<const CellModel>> load(const ScenarioOptions& scenario_options) const {
    try {
      Scenario scenario = read_scenario(scene_.scenario, scenario_options);
      auto cell = build_cell(scenario, options_.import);
      return {std::move(scenario), std::move(cell)};
    } catch (const std::runtime_error& error) {
      throw LoadFault{error.what()};
    }
  }

  /// The hash is that of the first run, which is the finest; files are those of all runs.
  void note_files(const Scenario& scenario, const CellModel& cell) {
    if (result_.model_hash.empty()) result_.model_hash = hexadecimal_text(model_hash(cell));
    notes_.insert(notes_.end(), cell.import_notes.begin(), cell.import_notes.end());
    result_.notes = note_sentences(notes_);
    const auto note = [&](const char* role, const std::filesystem::path& path) {
      const std::filesystem::path file = split_mesh_path(path).file;
      if (file.empty() || !noted_.insert(file).second) return;
      result_.files.push_back({role, file.lexically_normal().string(), options_.digest(file)});
    };
    note("scenario", scenario.file);
    note("program", scenario.controller_program);
    for (const ScenarioPart& part : scenario.parts) note("mesh", part.mesh);
    for (const ScenarioGround& ground : scenario.grounds) note("mesh", ground.mesh);
    for (const ScenarioRobot& robot : scenario.robots) note("robot", robot.urdf);
    for (const ScenarioGripper& gripper : scenario.grippers) {
      note("mesh", gripper.body_mesh);
      note("mesh", gripper.jaw_mesh);
    }
    note("measurement", scene_.reference.measurement);
  }

  const VerificationScene& scene_;
  const VerificationOptions& options_;
  VerifiedScene& result_;
  std::set<std::filesystem::path> noted_;
  std::vector<ImportNote> notes_;  ///< of all runs
};

std::string number(double value) {
  return number_text(value, 4);
}

/// With its unit; a pure number has "1".
std::string number(double value, const std::string& unit) {
  return number(value) + (unit == "1" ? "" : " " + unit);
}

void judge_code(VerifiedResolution& r, bool exact) {
  if (!exact) {
    r.code_sentence = "the reference is not exact";
    return;
  }
  const auto& order = r.runs.front().error_order;
  const auto& formal = r.plan.formal_order;
  if (!order) {
    r.code_sentence = "the error of a run is zero to rounding: no order";
    r.code = formal ? Verdict::bad : Verdict::not_demanded;
    return;
  }
  r.code_sentence = "order of the errors " + number(*order);
  if (!formal) return;
  r.code = std::abs(*order - *formal) <= kOrderAgreement * *formal ? Verdict::good : Verdict::bad;
  r.code_sentence +=
      ", formal order " + number(*formal) + ", allowed deviation " + number(100.0 * kOrderAgreement) + " %";
}

double range_of(const std::vector<VerifiedRun>& runs) {
  const auto [least, most] = std::minmax_element(
      runs.begin(), runs.end(), [](const auto& a, const auto& b) { return a.point.value < b.point.value; });
  return most->point.value - least->point.value;
}

/// `tolerance` of the comparison, if it is stated.
void judge_solution(VerifiedResolution& r, std::optional<double> tolerance, const std::string& unit) {
  const GridConvergence& c = r.convergence;
  const double uncertainty = kRangeFactor * range_of(r.runs);
  r.u_num = (c.state == GridState::monotone ? c.index : uncertainty) / kIndexCoverage;
  if (tolerance && (c.state == GridState::oscillatory || c.state == GridState::diverging) &&
      uncertainty <= kPartOfTolerance * *tolerance) {
    r.solution = Verdict::good;
    r.solution_sentence = "no order; three times the range of the results, " + number(uncertainty, unit) +
                          ", is below a tenth of the tolerance";
    return;
  }
  r.solution = c.state == GridState::monotone ? Verdict::good : Verdict::bad;
  switch (c.state) {
    case GridState::monotone:
      r.solution_sentence = "monotone convergence, observed order " + number(c.order) +
                            ", grid convergence index " + number(c.index, unit) + ", safety factor " +
                            number(c.safety_factor) +
                            (c.asymptotic ? " (asymptotic range)" : " (asymptotic range not shown)");
      return;
    case GridState::oscillatory:
      r.solution_sentence = "the results oscillate under refinement: no order, no index";
      return;
    case GridState::diverging:
      r.solution_sentence = "the differences do not shrink under refinement: no order, no index";
      return;
    case GridState::no_difference:
      r.solution_sentence =
          "neighbouring results do not differ: no order, no index; the refined key may have no effect";
  }
}

void judge_comparison(VerifiedScene& s) {
  const double k = s.plan.coverage_factor, reference = *s.plan.reference.value;
  const std::string uncertainties = " (" + number(k) + " u_val)";
  if (s.plan.reference.bound) {
    s.good_to = reference - k * s.u_val;
    s.comparison = s.result <= s.good_to ? Verdict::good : Verdict::bad;
    s.comparison_sentence = number(s.result) + " + " + number(k * s.u_val) + uncertainties +
                            (s.comparison == Verdict::good ? " <= " : " > ") + number(reference, s.plan.unit);
    return;
  }
  const double limit = s.plan.tolerance.value_or(k * s.u_val);
  s.good_from = reference - limit;
  s.good_to = reference + limit;
  s.comparison = std::abs(s.error) <= limit ? Verdict::good : Verdict::bad;
  s.comparison_sentence = "|E| = " + number(std::abs(s.error)) +
                          (s.comparison == Verdict::good ? " <= " : " > ") + number(limit, s.plan.unit) +
                          (s.plan.tolerance ? " (stated tolerance)" : uncertainties);
}

std::size_t finest(const VerificationResolution& r) {
  return static_cast<std::size_t>(std::min_element(r.sizes.begin(), r.sizes.end()) - r.sizes.begin());
}

/// Settings of all resolutions at their finest, but one at this level.
std::vector<std::string> settings_at(const VerificationScene& scene, std::size_t refined, std::size_t level) {
  std::vector<std::string> all;
  for (std::size_t i = 0; i < scene.resolutions.size(); ++i) {
    const VerificationResolution& r = scene.resolutions[i];
    const auto& settings = r.levels[i == refined ? level : finest(r)];
    all.insert(all.end(), settings.begin(), settings.end());
  }
  return all;
}

void refine(VerifiedScene& s, std::size_t refined, SceneRunner& run) {
  VerifiedResolution& r = s.resolutions.emplace_back();
  r.plan = s.plan.resolutions[refined];
  std::vector<std::size_t> order(r.plan.sizes.size());
  std::iota(order.begin(), order.end(), 0U);
  std::sort(order.begin(), order.end(),
            [&](std::size_t a, std::size_t b) { return r.plan.sizes[a] < r.plan.sizes[b]; });
  std::vector<GridPoint> points;
  for (const std::size_t level : order) {
    const double value = points.empty() ? s.result : run(settings_at(s.plan, refined, level));
    points.push_back({r.plan.sizes[level], value});
    const std::string setting = join(r.plan.levels[level], ", ");
    r.runs.push_back(
        {r.plan.key.empty() ? setting : setting.substr(r.plan.key.size() + 1), points.back(), {}});
  }
  const VerificationReference& reference = s.plan.reference;
  r.convergence = grid_convergence(points, r.plan.formal_order);
  for (std::size_t i = 0; reference.exact && i + 1 < points.size(); ++i)
    r.runs[i].error_order = error_order(points[i], points[i + 1], *reference.value);
  judge_code(r, reference.exact);
  judge_solution(r, reference.bound ? reference.value : s.plan.tolerance, s.plan.unit);
}

VerifiedScene verify_scene(const VerificationScene& scene, const VerificationOptions& options) {
  VerifiedScene s;
  s.plan = scene;
  s.u_reference = scene.reference.standard_uncertainty;
  SceneRunner run(scene, options, s);
  const std::vector<std::string> at_finest = settings_at(scene, scene.resolutions.size(), 0);
  try {
    s.result = run(at_finest);
    for (std::size_t i = 0; i < scene.resolutions.size(); ++i) refine(s, i, run);
    for (const VerificationInput& input : scene.inputs) {
      VerifiedInput& varied = s.inputs.emplace_back();
      varied.input = input;
      for (const auto& [sign, value] : {std::pair{-1.0, &varied.below}, std::pair{1.0, &varied.above}}) {
        std::vector<std::string> settings = at_finest;
        settings.push_back(input.key + "=" + exact_text(input.value + sign * input.standard_uncertainty));
        *value = run(settings);
      }
    }
  } catch (const RunFault& fault) {
    s.fault = fault.sentence;
    s.comparison_sentence = "a run ended early: " + fault.sentence;
    return s;
  } catch (const LoadFault& fault) {
    s.run = false;
    s.fault = fault.sentence;
    s.comparison_sentence = "the scenario cannot be loaded: " + fault.sentence;
    return s;
  }
  s.error = s.result - *scene.reference.value;
  for (const VerifiedResolution& r : s.resolutions) s.u_num = std::hypot(s.u_num, r.u_num);
  for (const VerifiedInput& input : s.inputs) s.u_input = std::hypot(s.u_input, input.uncertainty());
  s.u_val = std::hypot(s.u_num, s.u_input, s.u_reference);
  judge_comparison(s);
  return s;
}

}  // namespace

double VerifiedInput::uncertainty() const {
  return 0.5 * std::abs(above - below);
}

bool VerifiedScene::good() const {
  return fault.empty() && comparison == Verdict::good &&
         std::all_of(resolutions.begin(), resolutions.end(),
                     [](const VerifiedResolution& r) { return r.good(); });
}

bool Verification::good() const {
  return std::all_of(scenes.begin(), scenes.end(), [](const VerifiedScene& scene) { return scene.good(); });
}

double number_at(const nlohmann::ordered_json& report, const std::string& path, const std::string& place) {
  std::vector<std::string> choices;
  const Json* found = walk(report, path, choices);
  if (found != nullptr && found->is_number()) return found->get<double>();
  if (found != nullptr && found->is_structured()) {
    choices.clear();
    for (const auto& [key, value] : found->items()) choices.push_back(key);
  }
  throw ScenarioError(place + ": found '" + path +
                      "', which is no number in the report; allowed there: " + list_names(choices));
}

Verification verify(const VerificationPlan& plan, const VerificationOptions& options) {
  const auto wanted = [&](const std::string& name) {
    return options.scenes.empty() ||
           std::find(options.scenes.begin(), options.scenes.end(), name) != options.scenes.end();
  };
  for (const std::string& name : options.scenes)
    if (std::none_of(plan.scenes.begin(), plan.scenes.end(),
                     [&](const VerificationScene& scene) { return scene.name == name; }))
      throw ScenarioError(
          "--scene: found '" + name + "'; allowed: a scene of " + plan.file.string() + ": " +
          join(plan.scenes, ", ", [](const VerificationScene& scene) { return "'" + scene.name + "'"; }));
  Verification result{plan, options.version, {}};
  for (const VerificationScene& scene : plan.scenes) {
    if (!wanted(scene.name)) continue;
    VerifiedScene& verified = result.scenes.emplace_back(verify_scene(scene, options));
    if (!verified.run && !plan.preparation.empty())
      verified.comparison_sentence += "; to be run before the plan: " + plan.preparation;
  }
  return result;
}

}  // namespace takt

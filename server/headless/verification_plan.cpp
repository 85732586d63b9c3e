#include "server/headless/verification_plan.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <map>
#include <set>
#include <sstream>

#include "idl/common/parse.h"
#include "idl/common/text.h"
#include "server/fields/fields.h"
#include "server/headless/closed_form.h"

namespace takt {

namespace {

constexpr int kPlanFormat = 1;
constexpr std::size_t kLeastResolutions = 3, kMostResolutions = 20;

void check_settings(const Fields& f, const char* key, const std::vector<std::string>& settings) {
  for (const std::string& text : settings)
    f.check(text.find('=') != std::string::npos && text.front() != '=', key, "'" + text + "'",
            "KEY=VALUE with a dotted key of the scenario file");
}

}  // namespace

void describe(Fields& f, VerificationReference& r) {
  f.alternatives({"value", "formula", "measurement", "at_most"}, 1, 1, "", "none or several of them",
                 "one of value, formula, measurement, at_most");
  f.field("value", r.value, NumberRange{}, "Value of the reference, in the unit of the quantity.");
  f.field("formula", r.formula, Text{},
          "Closed form of the value: Lua, with the values of the inputs by their names.");
  r.formula_place = f.place("formula");
  f.field("measurement", r.measurement, f.file(), "Table of measurements (CSV).");
  std::optional<double> upper;
  f.field("at_most", upper, NumberRange{}, "Upper bound of the quantity.");
  if (upper) r.value = upper, r.bound = true;
  f.field("exact", r.exact, Flag{}, "The value solves the equations of the model.");
  f.field("standard_uncertainty", r.standard_uncertainty, not_negative(""), "Of the value.");
  f.field("source", r.source, Text{}, "Where the value comes from: derivation or publication.", kRequired);
  f.field("differences", r.differences, Text{}, "How the model differs from that of the source, and why.");
  const bool stated = !f.has("measurement");
  for (const char* key : {"exact", "standard_uncertainty"})
    f.check(stated || !f.has(key), key, "the key beside measurement", "the key beside value");
  f.check(!r.bound || !f.has("exact"), "exact", "the key beside at_most", "the key beside value or formula");
}

void describe(Fields& f, VerificationResolution& r) {
  std::vector<std::string> values;
  f.alternatives({"key", "settings"}, 1, 1, "", "neither or both of them", "one of key, settings");
  f.together("key", "values");
  f.field("key", r.key, Text{}, "Key of the scenario that is refined.");
  f.field("values", values, ListOf<Text>{{}, "a list of three values or more", kLeastResolutions},
          "Values of the key.");
  f.field(
      "settings", r.levels,
      ListOf<ListOf<Text>>{
          {{}, "a list of KEY=VALUE", 1}, "a list of three lists of KEY=VALUE or more", kLeastResolutions},
      "Settings of each level, in place of one key.");
  for (const auto& level : r.levels) check_settings(f, "settings", level);
  for (const std::string& text : values) r.levels.push_back({r.key + "=" + text});
  const char* levels = r.key.empty() ? "settings" : "values";
  f.check(r.levels.size() <= kMostResolutions, levels, std::to_string(r.levels.size()) + " values",
          "at most " + std::to_string(kMostResolutions));
  f.field("sizes", r.sizes, Numbers{0, positive("")}, "Sizes of the levels, where they are no numbers.");
  f.field("formal_order", r.formal_order, positive(""), "Order of the method.");
  if (r.sizes.empty()) {
    f.check(!r.key.empty(), "sizes", "nothing (the key is missing)", "the sizes of the settings");
    for (const std::string& text : values) {
      const auto number = finite_number(text);
      f.check(number && *number > 0.0, "values", "'" + text + "'",
              "numbers > 0; other values have their sizes under sizes");
      r.sizes.push_back(*number);
    }
  }
  f.check(r.sizes.size() == r.levels.size(), "sizes", std::to_string(r.sizes.size()) + " sizes",
          "one for each of the " + std::to_string(r.levels.size()) + " values");
  const std::set<double> different(r.sizes.begin(), r.sizes.end());
  f.check(different.size() == r.sizes.size(), levels, "the same size twice", "different sizes");
}

void describe(Fields& f, VerificationInput& i) {
  f.field("key", i.key, Text{}, "Key of the scenario.", kRequired);
  f.field("value", i.value, NumberRange{}, "Value of the key in all runs.", kRequired);
  f.field("standard_uncertainty", i.standard_uncertainty, positive(""), "Standard uncertainty of the value.",
          kRequired);
}

void describe(Fields& f, VerificationScene& s) {
  f.field("description", s.description, Text{}, "What the scene shows.");
  f.field("scenario", s.scenario, f.file(), "Scenario file, relative to the plan.", kRequired);
  f.field("level_of_detail", s.level_of_detail, WholeRange{1, 3}, "Level of detail of every process.");
  f.field("duration_s", s.duration_s, positive("s"), "Simulated time; without it the scenario's.");
  f.field("set", s.settings, ListOf<Text>{{}, "a list of KEY=VALUE", 0},
          "Values that replace the scenario's.");
  check_settings(f, "set", s.settings);
  f.field("quantity", s.quantity, Text{}, "Path to a number in the report of a run.", kRequired);
  s.quantity_place = f.place("quantity");
  f.field("unit", s.unit, Text{}, "Unit of the quantity.", kRequired);
  f.check(f.has("reference"), "reference", "nothing (the key is missing)", "a mapping");
  f.section("reference", "What the result is compared with.", s.reference);
  f.entries("resolutions", s.resolutions, "Refinements; without any a single run.",
            "Runs from coarse to fine.");
  f.entries("inputs", s.inputs, "Uncertain inputs.", "An input.");
  f.section("verdict", "Limit of the comparison error.", [&] {
    f.field("coverage_factor", s.coverage_factor, positive(""), "k in |E| <= k u_val.");
    f.field("tolerance", s.tolerance, positive(""), "Limit of |E| in place of k u_val.");
  });
}

VerificationPlan read_verification_plan(const std::filesystem::path& file) {
  YamlSource source{file, {}};
  const YAML::Node root = load_yaml(file);
  VerificationPlan plan;
  plan.file = file;
  Fields f(source, root);
  int format = 0;
  f.field("takt_verification", format, WholeRange{kPlanFormat, kPlanFormat}, "Format.", kRequired);
  f.field("name", plan.name, Text{}, "Title of the report.", kRequired);
  f.field("description", plan.description, Text{}, "Purpose of the report.");
  f.field("preparation", plan.preparation, Text{}, "Command that makes files which the scenes need.");
  f.entries("scenes", plan.scenes, "Scenes of the report.", "A scene.");
  f.check(!plan.scenes.empty(), "scenes", "no scene", "one scene or more");
  f.finish();
  for (VerificationScene& scene : plan.scenes) {
    if (!scene.reference.formula.empty()) {
      std::map<std::string, double> names;
      for (const VerificationInput& input : scene.inputs) names[input.name] = input.value;
      scene.reference.value = closed_form(scene.reference.formula, names, scene.reference.formula_place);
    }
    if (scene.reference.measurement.empty()) continue;
    VerificationReference measured = read_measurement(scene.reference.measurement);
    measured.source = scene.reference.source;
    measured.differences = scene.reference.differences;
    scene.reference = std::move(measured);
  }
  return plan;
}

VerificationReference read_measurement(const std::filesystem::path& file) {
  std::ifstream in(file);
  if (!in) throw ScenarioError(file.string() + ": cannot be read; allowed: a table (CSV)");
  int line_number = 0;
  const auto fail = [&](const std::string& column, const std::string& found, const std::string& allowed) {
    throw ScenarioError(file.string() + ":" + std::to_string(line_number) + ": " + column + ": found " +
                        found + "; allowed: " + allowed);
  };
  const auto cells_of = [](std::string line) {
    if (line.ends_with('\r')) line.pop_back();
    std::vector<std::string> cells;
    std::stringstream stream(line);
    for (std::string cell; std::getline(stream, cell, ',');) {
      const std::size_t begin = cell.find_first_not_of(' '), end = cell.find_last_not_of(' ');
      cells.push_back(begin == std::string::npos ? "" : cell.substr(begin, end - begin + 1));
    }
    return cells;
  };
  std::vector<std::string> head;
  std::vector<double> values, uncertainties;
  for (std::string line; std::getline(in, line);) {
    ++line_number;
    if (line.empty() || line.front() == '#' || line == "\r") continue;
    const std::vector<std::string> cells = cells_of(line);
    if (head.empty()) {
      head = cells;
      continue;
    }
    const auto number = [&](const std::string& column) {
      const auto at = std::find(head.begin(), head.end(), column);
      if (at == head.end())
        fail(column, "no such column in the first row", "the columns value, standard_uncertainty");
      const auto i = static_cast<std::size_t>(at - head.begin());
      const auto found = i < cells.size() ? finite_number(cells[i]) : std::nullopt;
      if (!found) fail(column, i < cells.size() ? "'" + cells[i] + "'" : "no cell", "a finite number");
      return *found;
    };
    values.push_back(number("value"));
    uncertainties.push_back(number("standard_uncertainty"));
    if (uncertainties.back() < 0.0)
      fail("standard_uncertainty", exact_text(uncertainties.back()), "a number >= 0");
  }
  if (values.empty()) fail("value", "no row", "one row or more below the names of the columns");
  const auto n = static_cast<double>(values.size());
  double mean = 0.0, common = 0.0, squares = 0.0;
  for (const double value : values) mean += value / n;
  for (const double u : uncertainties) common += u / n;
  for (const double value : values) squares += (value - mean) * (value - mean);
  const double scatter = values.size() > 1 ? std::sqrt(squares / (n - 1.0) / n) : 0.0;
  VerificationReference result;
  result.value = mean;
  result.measurement = file;
  result.standard_uncertainty = std::hypot(common, scatter);
  result.rows = static_cast<int>(values.size());
  return result;
}

}  // namespace takt

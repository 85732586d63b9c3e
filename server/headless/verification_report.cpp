#include "server/headless/verification_report.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "idl/common/text.h"
#include "idl/common/xml.h"
#include "server/headless/html_page.h"
#include "server/headless/svg_plot.h"

namespace takt {

namespace {

using Json = nlohmann::ordered_json;

template <class Value>
Json or_null(const std::optional<Value>& value) {
  return value ? Json(*value) : Json(nullptr);
}

Json resolution_json(const VerifiedResolution& r) {
  const GridConvergence& c = r.convergence;
  const bool monotone = c.state == GridState::monotone;
  const auto of_series = [&](double value) { return monotone ? Json(value) : Json(nullptr); };
  Json runs = Json::array(), orders = Json::array();
  for (const VerifiedRun& run : r.runs)
    runs.push_back({{"setting", run.setting},
                    {"size", run.point.size},
                    {"value", run.point.value},
                    {"error_order", or_null(run.error_order)}});
  for (const auto& order : c.orders) orders.push_back(or_null(order));
  return {{"name", r.plan.name},
          {"key", r.plan.key.empty() ? Json(nullptr) : Json(r.plan.key)},
          {"code_verification", {{"verdict", to_string(r.code)}, {"finding", r.code_sentence}}},
          {"solution_verification", {{"verdict", to_string(r.solution)}, {"finding", r.solution_sentence}}},
          {"runs", runs},
          {"state", to_string(c.state)},
          {"observed_order", of_series(c.order)},
          {"observed_orders", orders},
          {"formal_order", or_null(r.plan.formal_order)},
          {"asymptotic", c.asymptotic},
          {"extrapolated", of_series(c.extrapolated)},
          {"safety_factor", of_series(c.safety_factor)},
          {"grid_convergence_index", of_series(c.index)},
          {"u_num", r.u_num}};
}

Json inputs_json(const VerifiedScene& s) {
  Json inputs = Json::array();
  for (const VerifiedInput& one : s.inputs)
    inputs.push_back({{"name", one.input.name},
                      {"key", one.input.key},
                      {"value", one.input.value},
                      {"standard_uncertainty", one.input.standard_uncertainty},
                      {"below", one.below},
                      {"above", one.above},
                      {"contribution", one.uncertainty()}});
  return {{"inputs", inputs}, {"u_input", s.u_input}};
}

const char* kind_of(const VerificationReference& r) {
  if (r.bound) return "upper bound";
  if (!r.measurement.empty()) return "measurement";
  return r.exact ? "exact" : "stated";
}

Json scene_json(const VerifiedScene& s) {
  const VerificationReference& r = s.plan.reference;
  Json scene{{"name", s.plan.name},
             {"verdict", !s.run     ? "not run"
                         : s.good() ? "good"
                                    : "bad"},
             {"description", s.plan.description},
             {"quantity", s.plan.quantity},
             {"unit", s.plan.unit},
             {"fault", s.fault.empty() ? Json(nullptr) : Json(s.fault)},
             {"comparison",
              {{"verdict", to_string(s.comparison)},
               {"finding", s.comparison_sentence},
               {"result", s.fault.empty() ? Json(s.result) : Json(nullptr)},
               {"reference", or_null(r.value)},
               {"error", s.fault.empty() ? Json(s.error) : Json(nullptr)},
               {"u_num", s.u_num},
               {"u_input", s.u_input},
               {"u_reference", s.u_reference},
               {"u_val", s.u_val},
               {"coverage_factor", s.plan.coverage_factor},
               {"tolerance", or_null(s.plan.tolerance)},
               {"good_from", or_null(s.good_from)},
               {"good_to", s.good_to}}},
             {"resolutions", Json::array()},
             {"input_uncertainty", inputs_json(s)},
             {"reference",
              {{"kind", kind_of(r)},
               {"source", r.source},
               {"formula", r.formula.empty() ? Json(nullptr) : Json(r.formula)},
               {"differences", r.differences.empty() ? Json(nullptr) : Json(r.differences)},
               {"rows", r.rows}}},
             {"notes", s.notes},
             {"model_hash", s.model_hash}};
  for (const VerifiedResolution& resolution : s.resolutions)
    scene["resolutions"].push_back(resolution_json(resolution));
  Json files = Json::array();
  for (const VerifiedFile& file : s.files)
    files.push_back({{"role", file.role}, {"file", file.file}, {"sha256", file.digest}});
  scene["files"] = files;
  return scene;
}

std::string marked(const Json& verdict) {
  const std::string text = verdict.get<std::string>();
  if (text == "good") return "<span class=\"passed\">good</span>";
  if (text == "bad" || text == "not run") return "<span class=\"failed\">" + text + "</span>";
  return "<span class=\"skipped\">not demanded</span>";
}

/// Digits that show where a result is between the ends of the good ones.
int digits_between(const std::optional<double>& from, double to) {
  const double width = from ? to - *from : 0.0, scale = std::abs(to);
  const double digits = width > 0.0 && scale > 0.0 ? std::ceil(std::log10(scale / width)) : 0.0;
  return static_cast<int>(std::clamp(digits + 3.0, 4.0, 15.0));
}

std::string digits(const Json& value, int count) {
  return value.is_number() ? number_text(value.get<double>(), count) : std::string();
}

void write_resolution(std::ostream& out, const Json& resolution, const std::string& unit) {
  const Json &code = resolution["code_verification"], &solution = resolution["solution_verification"];
  out << "<h3>Refinement: " << xml_escaped(text_of(resolution["name"])) << "</h3>\n";
  {
    HtmlTable table(out, {"step", "verdict", "finding"});
    table.row({"code verification", marked(code["verdict"]), xml_escaped(text_of(code["finding"]))}, true);
    table.row(
        {"solution verification", marked(solution["verdict"]), xml_escaped(text_of(solution["finding"]))},
        true);
  }
  const Json& key = resolution["key"];
  HtmlTable table(out, {key.is_null() ? "settings" : text_of(key), "size (1)", "result" + unit,
                        "order of the error (1)"});
  for (const Json& run : resolution["runs"])
    table.row({text_of(run["setting"]), text_of(run["size"]), digits(run["value"], 9),
               text_of(run["error_order"])});
}

/// The error of each run over its size: against an exact reference, else against the extrapolated result. A line has the formal
/// order, or else the observed one.
void write_convergence(std::ostream& out, const Json& resolution, const Json& scene) {
  const bool exact = scene["reference"]["kind"] == "exact";
  const Json& truth = exact ? scene["comparison"]["reference"] : resolution["extrapolated"];
  if (!truth.is_number()) return;
  PlotLine errors{"runs", {}};
  for (const Json& run : resolution["runs"])
    if (const double error = std::abs(run["value"].get<double>() - truth.get<double>()); error > 0.0)
      errors.points.emplace_back(run["size"].get<double>(), error);
  if (errors.points.size() < 2) return;
  std::sort(errors.points.begin(), errors.points.end());
  const Json& key = resolution["key"];
  Plot plot;
  plot.title = "Convergence";
  plot.x = key.is_null() ? "size (1)" : text_of(key);
  plot.y = std::string("error against the ") + (exact ? "reference" : "extrapolated result") + " (" +
           text_of(scene["unit"]) + ")";
  plot.lines = {errors};
  plot.markers = plot.logarithmic = true;
  plot.width = 620.0, plot.height = 340.0;
  const Json& formal = resolution["formal_order"];
  const Json& order = formal.is_number() ? formal : resolution["observed_order"];
  if (order.is_number()) {
    const auto [x, y] = errors.points.front();
    const double last = errors.points.back().first;
    plot.lines.push_back({std::string(formal.is_number() ? "formal" : "observed") + " order " +
                              number_text(order.get<double>(), 3),
                          {{x, y}, {last, y * std::pow(last / x, order.get<double>())}}});
  }
  out << "<div class=\"scroll\">";
  write_svg(out, plot);
  out << "</div>\n";
}

void write_scene_page(std::ostream& out, const Json& scene) {
  const std::string unit = " (" + text_of(scene["unit"]) + ")";
  const Json &comparison = scene["comparison"], &inputs = scene["input_uncertainty"],
             &reference = scene["reference"];
  out << "<h2>" << xml_escaped(text_of(scene["name"])) << ": " << marked(scene["verdict"]) << "</h2>\n<p>"
      << xml_escaped(text_of(scene["description"])) << " Quantity: <code>"
      << xml_escaped(text_of(scene["quantity"])) << "</code>. Reference (" << text_of(reference["kind"])
      << "): " << xml_escaped(text_of(reference["source"])) << "</p>\n";
  if (!reference["formula"].is_null())
    out << "<pre>" << xml_escaped(text_of(reference["formula"])) << "</pre>\n";
  if (!reference["differences"].is_null())
    out << "<p>Differences from the source: " << xml_escaped(text_of(reference["differences"])) << "</p>\n";
  if (!scene["fault"].is_null()) {
    out << "<p class=\"failed\">Comparison: " << xml_escaped(text_of(comparison["finding"])) << "</p>\n";
    return;
  }
  out << "<p>Comparison: " << marked(comparison["verdict"]) << ", "
      << xml_escaped(text_of(comparison["finding"])) << ".</p>\n";
  {
    HtmlTable table(out,
                    {"result" + unit, "reference" + unit, "error E" + unit, "u_num" + unit, "u_input" + unit,
                     "u_reference" + unit, "u_val" + unit, "good from" + unit, "good to" + unit});
    const Json &from = comparison["good_from"], &to = comparison["good_to"];
    const int count =
        digits_between(from.is_null() ? std::nullopt : std::optional(from.get<double>()), to.get<double>());
    table.row({digits(comparison["result"], count), digits(comparison["reference"], count),
               text_of(comparison["error"]), text_of(comparison["u_num"]), text_of(comparison["u_input"]),
               text_of(comparison["u_reference"]), text_of(comparison["u_val"]), digits(from, count),
               digits(to, count)});
  }
  for (const Json& resolution : scene["resolutions"]) {
    write_resolution(out, resolution, unit);
    write_convergence(out, resolution, scene);
  }
  if (!inputs["inputs"].empty()) {
    HtmlTable table(out, {"input", "value #", "standard uncertainty #", "contribution" + unit});
    for (const Json& input : inputs["inputs"])
      table.row({text_of(input["name"]), text_of(input["value"]), text_of(input["standard_uncertainty"]),
                 text_of(input["contribution"])});
  }
  for (const Json& note : scene["notes"]) out << "<p>Note: " << xml_escaped(text_of(note)) << "</p>\n";
  HtmlTable table(out, {"file", "role", "SHA-256"});
  for (const Json& file : scene["files"])
    table.row({text_of(file["file"]), text_of(file["role"]), text_of(file["sha256"])});
  table.row({"", "model hash", text_of(scene["model_hash"])});
}

}  // namespace

const char* to_string(VerificationVerdict verdict) {
  switch (verdict) {
    case VerificationVerdict::good:
      return "good";
    case VerificationVerdict::bad:
      return "bad";
    case VerificationVerdict::not_demanded:
      break;
  }
  return "not_demanded";
}

nlohmann::ordered_json verification_json(const Verification& verification) {
  Json scenes = Json::array();
  for (const VerifiedScene& scene : verification.scenes) scenes.push_back(scene_json(scene));
  return {{"verdict", verification.good() ? "good" : "bad"},
          {"name", verification.plan.name},
          {"description", verification.plan.description},
          {"plan", verification.plan.file.string()},
          {"version", verification.version},
          {"test_configuration", "model in the loop"},
          {"scenes", scenes}};
}

void write_verification_page(std::ostream& out, const nlohmann::ordered_json& report) {
  begin_html(out, text_of(report["name"]));
  const bool good = report["verdict"] == "good";
  const Json& scenes = report["scenes"];
  const auto with = [&](const char* verdict) {
    return static_cast<std::size_t>(std::count_if(
        scenes.begin(), scenes.end(), [&](const Json& scene) { return scene["verdict"] == verdict; }));
  };
  std::string sentence =
      std::to_string(with("good")) + " of " + counted(scenes.size(), "scene is", "scenes are") + " good.";
  if (const std::size_t missing = with("not run"); missing > 0)
    sentence += " " + counted(missing, "scene was", "scenes were") + " not run.";
  write_verdict(out, good, good ? "good" : "bad", sentence);
  out << "<p>" << xml_escaped(text_of(report["description"]))
      << " Terms: ASME V&amp;V 10 and 20. Test configuration (VDI/VDE 3693): "
      << xml_escaped(text_of(report["test_configuration"])) << ". " << xml_escaped(text_of(report["version"]))
      << ".</p>\n";
  {
    HtmlTable table(out, {"scene", "verdict", "comparison"});
    for (const Json& scene : report["scenes"])
      table.row({xml_escaped(text_of(scene["name"])), marked(scene["verdict"]),
                 xml_escaped(text_of(scene["comparison"]["finding"]))},
                true);
  }
  for (const Json& scene : report["scenes"]) write_scene_page(out, scene);
  end_html(out);
}

void print_verification(std::ostream& out, const Verification& verification) {
  for (const VerifiedScene& s : verification.scenes) {
    out << (!s.run     ? "NOT RUN  "
            : s.good() ? "good  "
                       : "BAD   ")
        << s.plan.name << ": " << s.comparison_sentence << '\n';
    if (!s.fault.empty()) continue;
    const int count = digits_between(s.good_from, s.good_to);
    out << "      result " << number_text(s.result, count) << ", good "
        << (s.good_from ? "from " + number_text(*s.good_from, count) + " " : "") << "to "
        << number_text(s.good_to, count) << (s.plan.unit == "1" ? "" : " " + s.plan.unit) << '\n';
    for (const VerifiedResolution& r : s.resolutions) {
      if (r.code == VerificationVerdict::bad)
        out << "      code verification, " << r.plan.name << ": " << r.code_sentence << '\n';
      if (r.solution == VerificationVerdict::bad)
        out << "      solution verification, " << r.plan.name << ": " << r.solution_sentence << '\n';
    }
  }
  out << verification.plan.name << ": " << (verification.good() ? "good" : "bad") << '\n';
}

}  // namespace takt

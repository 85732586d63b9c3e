#include "server/headless/html_report.h"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <set>

#include "idl/common/text.h"
#include "idl/common/xml.h"
#include "server/headless/html_page.h"
#include "server/headless/svg_plot.h"

namespace takt {

namespace {

using Json = nlohmann::ordered_json;

constexpr std::size_t kMaxColumns = 500;  // of a curve as drawn: each with its least and its largest value

std::string time_text(const Json& time_s) {
  return time_s.is_number() ? fixed_text(time_s.get<double>(), 3) : text_of(time_s);
}

/// A share of a limit: "47.3 %", "921 times".
std::string used_text(double use) {
  return use < 10.0 ? fixed_text(100.0 * use, 1) + " %" : fixed_text(use, 0) + " times";
}

/// Of as many points as there are no more than a picture has columns, the least and the largest of each.
std::vector<std::pair<double, double>> thinned(const std::vector<std::pair<double, double>>& points) {
  if (points.size() <= 2 * kMaxColumns) return points;
  std::vector<std::pair<double, double>> few;
  for (std::size_t c = 0; c < kMaxColumns; ++c) {
    const auto begin = points.begin() + static_cast<std::ptrdiff_t>(c * points.size() / kMaxColumns);
    const auto end = points.begin() + static_cast<std::ptrdiff_t>((c + 1) * points.size() / kMaxColumns);
    const auto [least, most] =
        std::minmax_element(begin, end, [](const auto& a, const auto& b) { return a.second < b.second; });
    few.push_back(std::min(*least, *most));  // the earlier one first
    few.push_back(std::max(*least, *most));
  }
  return few;
}

std::vector<std::string> demands_with(const Json& report, std::string_view verdict) {
  std::vector<std::string> names;
  if (report.contains("assertions"))
    for (const auto& [name, demand] : report["assertions"].items())
      if (demand["verdict"] == verdict) names.push_back(name);
  return names;
}

void write_finding(std::ostream& out, const Json& report) {
  const auto failed = demands_with(report, "failed"), passed = demands_with(report, "passed"),
             skipped = demands_with(report, "skipped");
  const std::string skips =
      skipped.empty() ? "" : " " + counted(skipped.size(), "demand was", "demands were") + " not judged.";
  if (!report["fault"].is_null())
    write_verdict(out, false, "ended early", text_of(report["fault"]));
  else if (!failed.empty())
    write_verdict(out, false, "failed",
                  counted(failed.size(), "demand is", "demands are") + " not met: " + join(failed, ", ") +
                      "; " + counted(passed.size(), "demand is", "demands are") + " met." + skips);
  else if (!passed.empty())
    write_verdict(out, true, "passed", counted(passed.size(), "demand is", "demands are") + " met." + skips);
  else
    write_verdict(out, true, "passed",
                  "The run reached its end. The scenario has no demands to judge it by.");
}

void write_head(std::ostream& out, const Json& report, std::string_view png) {
  begin_html(out, report["scenario"].get<std::string>());
  write_finding(out, report);
  std::vector<std::pair<std::string, std::string>> numbers{{"simulated", quantity(report["time"], "s")}};
  const Json& metrics = report["run_metrics"];
  if (!metrics["cycle_time"].is_null())
    numbers.emplace_back("cycle time", quantity(metrics["cycle_time"], "s"));
  if (report.contains("max_position_error"))
    numbers.emplace_back("largest position error", quantity(report["max_position_error"], "m") + " of " +
                                                       quantity(report["tolerance"], "m"));
  if (const Json& force = report["summary"]["largest_contact_force"]; force.is_object())
    numbers.emplace_back("largest contact force", quantity(force["normal_force"], "N"));
  if (!metrics["consumers"].empty()) {
    double energy_J = 0.0;
    for (const auto& [name, consumer] : metrics["consumers"].items())
      energy_J += consumer["electrical_energy"].get<double>();
    numbers.emplace_back("electrical energy", quantity(energy_J, "J"));
  }
  // Of what the machines have; those of demands have no unit.
  const Json& margins = metrics["margins"];
  if (const auto found = std::find_if(margins.begin(), margins.end(),
                                      [](const Json& m) { return !text_of(m["unit"]).empty(); });
      found != margins.end()) {
    const Json& most = *found;
    numbers.emplace_back("most used limit: " + text_of(most["of"]), used_text(most["use"].get<double>()));
  }
  numbers.emplace_back("collisions", std::to_string(report["collisions"].size()));
  numbers.emplace_back(
      "warnings", std::to_string(report["warnings"].size() + report["further_warnings"].get<std::size_t>()));
  write_key_numbers(out, numbers);
  write_png_image(out, png, "The cell at the end of the run");
  out << "<p class=\"soft\">Level of detail " << report["level_of_detail"] << ", solver "
      << xml_escaped(text_of(report["solver"]["method"])) << ", " << quantity(report["cpu_time"], "s")
      << " of computation: computation ratio " << text_of(report["computation_ratio"]) << ". State hash "
      << text_of(report["state_hash"]) << ".</p>\n";
}

/// Those that are not met are first.
void write_demands(std::ostream& out, const Json& report) {
  if (!report.contains("assertions")) return;
  out << "<h2>Demands</h2>\n";
  HtmlTable table(out, {"verdict", "demand", "finding", "time (s)"});
  for (const char* verdict : {"failed", "passed", "skipped"})
    for (const std::string& name : demands_with(report, verdict)) {
      const Json& demand = report["assertions"][name];
      table.row({std::string("<span class=\"") + verdict + "\">" + verdict + "</span>", xml_escaped(name),
                 xml_escaped(text_of(demand["sentence"])), time_text(demand["time"])},
                true);
    }
}

/// Steps as bars over time, a row for each robot.
void write_timetable(std::ostream& out, const Json& report, const Json& steps) {
  std::vector<std::string> robots;
  for (const Json& step : steps) {
    const std::string robot = step["robot"].get<std::string>();
    if (std::find(robots.begin(), robots.end(), robot) == robots.end()) robots.push_back(robot);
  }
  constexpr double kLeft = 110.0, kWidth = 960.0, kRow = 34.0;
  const double end_s = std::max(report["time"].get<double>(), 1e-9);
  out << "<div class=\"scroll\">";
  begin_svg(out, kLeft + kWidth, kRow * static_cast<double>(robots.size()) + 24.0);
  constexpr std::size_t kTints = 5;  // of the curves' colours
  for (std::size_t r = 0; r < robots.size(); ++r) {
    const double y = kRow * static_cast<double>(r);
    out << "<text x=\"0\" y=\"" << y + 20 << "\">" << xml_escaped(robots[r]) << "</text>\n";
    std::size_t k = 0;
    for (const Json& step : steps) {
      if (step["robot"] != robots[r]) continue;
      const double x = kLeft + kWidth * step["begin"].get<double>() / end_s;
      const double w = kWidth * step["duration"].get<double>() / end_s;
      const std::string name = xml_escaped(step["name"].get<std::string>());
      out << "<rect class=\"c" << k++ % kTints << "\" x=\"" << fixed_text(x, 1) << "\" y=\"" << y + 4
          << "\" width=\"" << fixed_text(std::max(w, 0.5), 1)
          << "\" height=\"24\" fill=\"currentColor\" fill-opacity=\"0.35\"><title>" << name << ": "
          << fixed_text(step["begin"].get<double>(), 3) << " to " << fixed_text(step["end"].get<double>(), 3)
          << " s</title></rect>\n";
      if (w > 6.5 * static_cast<double>(name.size()))
        out << "<text x=\"" << fixed_text(x + 3, 1) << "\" y=\"" << y + 20 << "\">" << name << "</text>\n";
    }
  }
  const double y = kRow * static_cast<double>(robots.size()) + 14.0;
  for (int i = 0; i <= 10; ++i)
    out << "<text text-anchor=\"" << (i == 10 ? "end" : "middle") << "\" x=\"" << kLeft + 0.1 * kWidth * i
        << "\" y=\"" << y << "\">" << number_text(0.1 * i * end_s, 4) << " s</text>\n";
  out << "</svg></div>\n";
}

void write_steps(std::ostream& out, const Json& report) {
  const Json& metrics = report["run_metrics"];
  if (metrics["steps"].empty()) return;
  const Json& cycle = metrics["cycle_time"];
  out << "<h2>Steps of the program</h2>\n<p>"
      << (cycle.is_null() ? "The program goes on at the end of the run."
                          : "Cycle time " + quantity(cycle, "s") + ".")
      << "</p>\n";
  write_timetable(out, report, metrics["steps"]);
  std::vector<std::string> head{"robot", "step", "line #", "begin (s)", "end (s)", "duration (s)"};
  for (const auto& [consumer, numbers] : metrics["consumers"].items()) head.push_back(consumer + " #");
  if (metrics["consumers"].size() > 1) head.push_back("all #");
  HtmlTable table(out, head);
  for (const Json& step : metrics["steps"]) {
    std::vector<std::string> cells{text_of(step["robot"]),
                                   text_of(step["name"]),
                                   text_of(step["line"]),
                                   fixed_text(step["begin"].get<double>(), 3),
                                   fixed_text(step["end"].get<double>(), 3),
                                   fixed_text(step["duration"].get<double>(), 3)};
    double total_J = 0.0;
    if (step.contains("electrical_energy"))
      for (const auto& [consumer, energy] : step["electrical_energy"].items()) {
        cells.push_back(quantity(energy, "J"));
        total_J += energy.get<double>();
      }
    if (metrics["consumers"].size() > 1) cells.push_back(quantity(total_J, "J"));
    table.row(cells);
  }
}

void write_loads(std::ostream& out, const Json& report) {
  const Json& metrics = report["run_metrics"];
  if (!metrics["consumers"].empty()) {
    out << "<h2>Energy</h2>\n";
    HtmlTable table(out, {"consumer", "energy #", "largest power #", "at (s)"});
    for (const auto& [name, c] : metrics["consumers"].items())
      table.row({name, quantity(c["electrical_energy"], "J"), quantity(c["largest_electrical_power"], "W"),
                 time_text(c["largest_electrical_power_time"])});
  }
  if (report.contains("contacts") && !report["contacts"]["largest"].empty()) {
    out << "<h2>Largest contact forces</h2>\n";
    HtmlTable table(out, {"pair", "normal force #", "at (s)", "friction then #", "pressure then #",
                          "torque #", "at  (s)"});
    for (const Json& c : report["contacts"]["largest"])
      table.row({text_of(c["base"]) + " - " + text_of(c["target"]), quantity(c["normal_force"], "N"),
                 time_text(c["time"]), quantity(c["friction_force"], "N"),
                 quantity(c["largest_pressure"], "Pa"), quantity(c["largest_torque"], "N m"),
                 time_text(c["largest_torque_time"])});
  }
  if (!metrics["holding"].empty()) {
    out << "<h2>Holders of the Parts, with the largest load on the Part</h2>\n";
    HtmlTable table(out, {"part", "held by", "force #", "at (s)", "torque #", "at  (s)"});
    for (const Json& h : metrics["holding"])
      table.row({text_of(h["part"]), text_of(h["holder"]), quantity(h["largest_force"], "N"),
                 time_text(h["largest_force_time"]), quantity(h["largest_torque"], "N m"),
                 time_text(h["largest_torque_time"])});
  }
}

/// A bar with its number; `style` is that of a limit that is passed, or empty.
std::string bar_of(double use, const std::string& style) {
  return "<span class=\"bar " + style +
         "\" style=\"width:" + fixed_text(std::clamp(120.0 * use, 0.0, 240.0), 0) +
         "px\"></span> <span class=\"" + style + "\">" + used_text(use) + "</span>";
}

void write_margins(std::ostream& out, const Json& report) {
  out << "<h2>Margins to limits</h2>\n";
  HtmlTable table(out, {"of", "largest value #", "limit #", "at (s)", "used"});
  for (const Json& m : report["run_metrics"]["margins"]) {
    const double use = m["use"].get<double>();
    const std::string over = use > 1.0 ? "over" : "";
    const std::string unit = text_of(m["unit"]);
    const std::string bar = bar_of(use, over);
    table.row({xml_escaped(text_of(m["of"])), xml_escaped(quantity(m["value"], unit)),
               xml_escaped(quantity(m["limit"], unit)), time_text(m["time"]), bar},
              true);
  }
}

void write_events(std::ostream& out, const Json& report) {
  out << "<h2>Collisions</h2>\n";
  if (report["collisions"].empty()) {
    out << "<p>None was found, or nothing was checked (collision_checking).</p>\n";
  } else {
    HtmlTable table(out, {"time (s)", "what", "pair", "distance #"});
    for (const Json& c : report["collisions"])
      table.row({time_text(c["time"]), text_of(c["kind"]),
                 text_of(c["pair"][0]) + " - " + text_of(c["pair"][1]), quantity(c["distance"], "m")});
  }
  out << "<h2>Changes of the holder</h2>\n";
  HtmlTable table(out, {"time (s)", "part", "from", "to"});
  for (const Json& c : report["connection_changes"])
    table.row({time_text(c["time"]), text_of(c["part"]), text_of(c["from"]), text_of(c["to"])});
}

bool varies(const Curve& curve) {
  const auto value = [](const auto& point) { return point.second; };
  const auto [least, most] = std::ranges::minmax(curve.points, {}, value);
  return most.second > least.second;
}

/// A plot for each group, contact forces first. Curves that keep their value are in words.
void write_curves(std::ostream& out, const std::vector<Curve>& curves) {
  std::vector<std::string> groups, steady;
  for (const Curve& curve : curves) {
    if (!varies(curve))
      steady.push_back(
          curve.group + ", " + curve.name + ": " +
          (curve.points.empty() ? "no value" : quantity(curve.points.back().second, curve.unit)));
    else if (std::ranges::find(groups, curve.group) == groups.end())
      groups.push_back(curve.group);
  }
  std::stable_partition(groups.begin(), groups.end(),
                        [](const std::string& group) { return group == kContactForces; });
  if (!curves.empty()) out << "<h2>Curves</h2>\n";
  for (const std::string& group : groups) {
    Plot plot{group, "time (s)", "", "", {}, false, 1120.0, 380.0};
    std::set<std::string> units;
    for (const Curve& curve : curves) {
      if (curve.group != group || !varies(curve)) continue;
      plot.lines.push_back({curve.name, thinned(curve.points)});
      units.insert(curve.unit);
    }
    plot.y = join(units, ", ");
    out << "<div class=\"scroll\">";
    write_svg(out, plot);
    out << "</div>\n";
  }
  if (!steady.empty())
    out << "<p class=\"soft\">Without a change: " << xml_escaped(join(steady, "; ")) << ".</p>\n";
}

}  // namespace

void write_html_report(std::ostream& out, const Json& report, const std::vector<Curve>& curves,
                       std::string_view png) {
  write_head(out, report, png);
  write_demands(out, report);
  write_steps(out, report);
  write_margins(out, report);
  write_loads(out, report);
  write_events(out, report);
  write_curves(out, curves);
  end_html(out);
}

}  // namespace takt

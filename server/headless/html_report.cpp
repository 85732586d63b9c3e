#include "server/headless/html_report.h"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <set>

#include "idl/common/text.h"
#include "server/headless/html_page.h"
#include "server/headless/svg_plot.h"

namespace takt {

namespace {

using Json = nlohmann::ordered_json;

constexpr std::size_t kMaxColumns = 500;  // of a curve as drawn: each with its least and its largest value

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

void write_head(std::ostream& out, const Json& report) {
  begin_html(out, report["scenario"].get<std::string>());
  out << "<p>Level of detail " << report["level_of_detail"] << ", solver "
      << xml_escaped(text_of(report["solver"]["method"])) << ", " << text_of(report["time"])
      << " s simulated in " << text_of(report["cpu_time"]) << " s of computation: computation ratio "
      << text_of(report["computation_ratio"]) << ". State hash " << text_of(report["state_hash"])
      << ".</p>\n";
  if (!report["fault"].is_null())
    out << "<p class=\"failed\">The run ended early: " << xml_escaped(text_of(report["fault"])) << "</p>\n";
}

void write_demands(std::ostream& out, const Json& report) {
  if (!report.contains("assertions")) return;
  out << "<h2>Demands</h2>\n";
  HtmlTable table(out, {"verdict", "demand", "finding", "time (s)"});
  for (const auto& [name, demand] : report["assertions"].items()) {
    const std::string verdict = text_of(demand["verdict"]);
    table.row({"<span class=\"" + verdict + "\">" + verdict + "</span>", xml_escaped(name),
               xml_escaped(text_of(demand["sentence"])), text_of(demand["time"])},
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
  out << "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"" << kLeft + kWidth << "\" height=\""
      << kRow * static_cast<double>(robots.size()) + 24.0
      << "\" font-family=\"sans-serif\" font-size=\"11\">\n";
  const char* const colors[] = {"#aec7e8", "#ffbb78", "#98df8a", "#ff9896", "#c5b0d5", "#c7c7c7"};
  for (std::size_t r = 0; r < robots.size(); ++r) {
    const double y = kRow * static_cast<double>(r);
    out << "<text x=\"0\" y=\"" << y + 20 << "\">" << xml_escaped(robots[r]) << "</text>\n";
    std::size_t k = 0;
    for (const Json& step : steps) {
      if (step["robot"] != robots[r]) continue;
      const double x = kLeft + kWidth * step["begin"].get<double>() / end_s;
      const double w = kWidth * step["duration"].get<double>() / end_s;
      const std::string name = xml_escaped(step["name"].get<std::string>());
      out << "<rect x=\"" << fixed_text(x, 1) << "\" y=\"" << y + 4 << "\" width=\""
          << fixed_text(std::max(w, 0.5), 1) << "\" height=\"24\" fill=\"" << colors[k++ % std::size(colors)]
          << "\"><title>" << name << ": " << text_of(step["begin"]) << " to " << text_of(step["end"])
          << " s</title></rect>\n";
      if (w > 6.5 * static_cast<double>(name.size()))
        out << "<text x=\"" << fixed_text(x + 3, 1) << "\" y=\"" << y + 20 << "\">" << name << "</text>\n";
    }
  }
  const double y = kRow * static_cast<double>(robots.size()) + 14.0;
  for (int i = 0; i <= 10; ++i)
    out << "<text text-anchor=\"" << (i == 10 ? "end" : "middle") << "\" x=\"" << kLeft + 0.1 * kWidth * i
        << "\" y=\"" << y << "\">" << number_text(0.1 * i * end_s, 4) << " s</text>\n";
  out << "</svg>\n";
}

void write_steps(std::ostream& out, const Json& report) {
  const Json& metrics = report["run_metrics"];
  if (metrics["steps"].empty()) return;
  out << "<h2>Steps of the program</h2>\n<p>Cycle time " << text_of(metrics["cycle_time"]) << " s.</p>\n";
  write_timetable(out, report, metrics["steps"]);
  std::vector<std::string> head{"robot", "step", "line (#)", "begin (s)", "end (s)", "duration (s)"};
  for (const auto& [consumer, numbers] : metrics["consumers"].items()) head.push_back(consumer + " (J)");
  if (metrics["consumers"].size() > 1) head.push_back("all (J)");
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
        cells.push_back(text_of(energy));
        total_J += energy.get<double>();
      }
    if (metrics["consumers"].size() > 1) cells.push_back(text_of(total_J));
    table.row(cells);
  }
}

void write_loads(std::ostream& out, const Json& report) {
  const Json& metrics = report["run_metrics"];
  if (!metrics["consumers"].empty()) {
    out << "<h2>Energy</h2>\n";
    HtmlTable table(out, {"consumer", "energy (J)", "largest power (W)", "at (s)"});
    for (const auto& [name, c] : metrics["consumers"].items())
      table.row({name, text_of(c["electrical_energy"]), text_of(c["largest_electrical_power"]),
                 text_of(c["largest_electrical_power_time"])});
  }
  if (report.contains("contacts") && !report["contacts"]["largest"].empty()) {
    out << "<h2>Largest contact forces</h2>\n";
    HtmlTable table(out, {"pair", "normal force (N)", "at (s)", "friction then (N)", "pressure then (Pa)",
                          "torque (N m)", "at  (s)"});
    for (const Json& c : report["contacts"]["largest"])
      table.row({text_of(c["base"]) + " - " + text_of(c["target"]), text_of(c["normal_force"]),
                 text_of(c["time"]), text_of(c["friction_force"]), text_of(c["largest_pressure"]),
                 text_of(c["largest_torque"]), text_of(c["largest_torque_time"])});
  }
  if (!metrics["holding"].empty()) {
    out << "<h2>Holders of the Parts, with the largest load on the Part</h2>\n";
    HtmlTable table(out, {"part", "held by", "force (N)", "at (s)", "torque (N m)", "at  (s)"});
    for (const Json& h : metrics["holding"])
      table.row({text_of(h["part"]), text_of(h["holder"]), text_of(h["largest_force"]),
                 text_of(h["largest_force_time"]), text_of(h["largest_torque"]),
                 text_of(h["largest_torque_time"])});
  }
}

void write_margins(std::ostream& out, const Json& report) {
  out << "<h2>Margins to limits</h2>\n";
  HtmlTable table(out, {"of", "largest value (#)", "limit (#)", "unit", "at (s)", "used"});
  for (const Json& m : report["run_metrics"]["margins"]) {
    const double use = m["use"].get<double>();
    const std::string over = use > 1.0 ? "over" : "";
    table.row({xml_escaped(text_of(m["of"])), text_of(m["value"]), text_of(m["limit"]), text_of(m["unit"]),
               text_of(m["time"]),
               "<span class=\"bar " + over +
                   "\" style=\"width:" + fixed_text(std::clamp(120.0 * use, 0.0, 240.0), 0) +
                   "px\"></span> <span class=\"" + over + "\">" + fixed_text(100.0 * use, 1) + " %</span>"},
              true);
  }
}

void write_events(std::ostream& out, const Json& report) {
  out << "<h2>Collisions</h2>\n";
  if (report["collisions"].empty()) {
    out << "<p>None was found, or nothing was checked (collision_checking).</p>\n";
  } else {
    HtmlTable table(out, {"time (s)", "what", "pair", "distance (m)"});
    for (const Json& c : report["collisions"])
      table.row({text_of(c["time"]), text_of(c["kind"]),
                 text_of(c["pair"][0]) + " - " + text_of(c["pair"][1]), text_of(c["distance"])});
  }
  out << "<h2>Changes of the holder</h2>\n";
  HtmlTable table(out, {"time (s)", "part", "from", "to"});
  for (const Json& c : report["connection_changes"])
    table.row({text_of(c["time"]), text_of(c["part"]), text_of(c["from"]), text_of(c["to"])});
}

void write_curves(std::ostream& out, const std::vector<Curve>& curves) {
  std::vector<std::string> groups;
  for (const Curve& curve : curves)
    if (std::find(groups.begin(), groups.end(), curve.group) == groups.end()) groups.push_back(curve.group);
  if (!groups.empty()) out << "<h2>Curves</h2>\n";
  for (const std::string& group : groups) {
    Plot plot{group, "time (s)", "", "", {}, false, 1060.0, 380.0};
    std::set<std::string> units;
    for (const Curve& curve : curves) {
      if (curve.group != group) continue;
      plot.lines.push_back({curve.name, thinned(curve.points)});
      units.insert(curve.unit);
    }
    plot.y = join(units, ", ");
    write_svg(out, plot);
  }
}

}  // namespace

void write_html_report(std::ostream& out, const Json& report, const std::vector<Curve>& curves) {
  write_head(out, report);
  write_demands(out, report);
  write_steps(out, report);
  write_loads(out, report);
  write_margins(out, report);
  write_curves(out, curves);
  write_events(out, report);
  end_html(out);
}

}  // namespace takt

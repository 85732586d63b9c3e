#include "server/headless/study_page.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <optional>

#include "idl/common/parse.h"
#include "idl/common/text.h"
#include "idl/common/xml.h"
#include "server/headless/html_page.h"
#include "server/headless/svg_plot.h"

namespace takt {

namespace {

constexpr std::size_t kMostDrawn = 4, kMostColumns = 8;

struct Result {
  const char* ending;
  const char* unit;
  double floor;  ///< a change of less is noise
};
constexpr std::array kResults{Result{"max_position_error", "m", 1e-6}, Result{".normal_force", "N", 1e-3},
                              Result{".electrical_energy", "J", 1e-3}};

const Result* result_of(const std::string& column) {
  for (const Result& result : kResults)
    if (column.ends_with(result.ending)) return &result;
  return nullptr;
}

std::string unit_of(const std::string& column) {
  if (column.ends_with(".time")) return "s";
  const Result* result = result_of(column);
  return result == nullptr ? "" : result->unit;
}

std::string with_unit(const std::string& column) {
  const std::string unit = unit_of(column);
  return unit.empty() ? column : column + " (" + unit + ")";
}

bool is_bad(const std::string& verdict) {
  return verdict == "failed" || verdict == "fault";
}

/// A colour between dark and bright ones that keep their order in grey and for colour-blind eyes (viridis).
std::string color_of(double part) {
  constexpr std::array<std::array<double, 3>, 5> kStops{
      {{68, 1, 84}, {59, 82, 139}, {33, 145, 140}, {94, 201, 98}, {253, 231, 37}}};
  const double at = std::clamp(part, 0.0, 1.0) * (kStops.size() - 1);
  const auto i = std::min(static_cast<std::size_t>(at), kStops.size() - 2);
  std::string text = "rgb(";
  for (std::size_t c = 0; c < 3; ++c)
    text += fixed_text(kStops[i][c] + (at - static_cast<double>(i)) * (kStops[i + 1][c] - kStops[i][c]), 0) +
            (c < 2 ? "," : ")");
  return text;
}

/// The runs at one place of a map: several where more than two keys vary.
struct Place {
  std::optional<double> value;
  bool bad = false;
  std::size_t runs = 0;
};

/// Two keys as the axes of a map, or one and a single row.
struct Map {
  std::vector<double> across, up;
  std::map<std::pair<double, double>, Place> places;
  double least = std::numeric_limits<double>::infinity(), most = -least;
};

/// Without a column: of verdicts alone. Of several runs the largest value and the worst verdict.
Map map_of(const Table& table, const std::vector<std::string>& keys, const std::string& column) {
  Map map;
  for (std::size_t r = 0; r < table.rows(); ++r) {
    const auto x = finite_number(table.cell(r, keys[0]));
    const auto y = keys.size() > 1 ? finite_number(table.cell(r, keys[1])) : 0.0;
    if (!x || !y) continue;
    map.across.push_back(*x);
    map.up.push_back(*y);
    Place& place = map.places[{*x, *y}];
    ++place.runs;
    place.bad = place.bad || is_bad(table.cell(r, "verdict"));
    if (const auto value = finite_number(table.cell(r, column)); value && !column.empty()) {
      place.value = std::max(place.value.value_or(*value), *value);
      map.least = std::min(map.least, *value);
      map.most = std::max(map.most, *value);
    }
  }
  for (auto* values : {&map.across, &map.up}) {
    std::ranges::sort(*values);
    values->erase(std::unique(values->begin(), values->end()), values->end());
  }
  return map;
}

/// Runs that did not pass have a cross. Verdicts alone are green and red.
void write_map(std::ostream& out, const Map& map, const std::vector<std::string>& keys,
               const std::string& column) {
  constexpr double kLeft = 120.0, kTop = 34.0, kRight = 24.0, kBottom = 62.0, kWidth = 1120.0;
  const auto columns = static_cast<double>(map.across.size()), rows = static_cast<double>(map.up.size());
  const double w = std::min((kWidth - kLeft - kRight) / columns, 120.0), h = std::clamp(w, 18.0, 44.0);
  const bool written = w >= 76.0;  // a value has room in its place
  const std::string unit = unit_of(column);
  out << "<div class=\"scroll\">";
  begin_svg(out, kWidth, kTop + h * rows + kBottom);
  out << "<rect class=\"paper\" width=\"100%\" height=\"100%\" fill=\"white\"/>\n<text x=\"" << kLeft
      << "\" y=\"22\" font-size=\"15\">" << xml_escaped(column.empty() ? "Verdicts" : column);
  if (!column.empty() && map.least <= map.most)
    out << ": " << xml_escaped(quantity(map.least, unit)) << " (dark) to "
        << xml_escaped(quantity(map.most, unit)) << " (bright)";
  out << "</text>\n";
  const auto at = [](double value) { return fixed_text(value, 1); };
  for (std::size_t i = 0; i < map.across.size(); ++i)
    for (std::size_t k = 0; k < map.up.size(); ++k) {
      const auto found = map.places.find({map.across[i], map.up[k]});
      const double x = kLeft + w * static_cast<double>(i),
                   y = kTop + h * (rows - 1.0 - static_cast<double>(k));
      if (found == map.places.end()) continue;
      const Place& place = found->second;
      const double part =
          place.value && map.most > map.least ? (*place.value - map.least) / (map.most - map.least) : 0.0;
      const std::string fill = column.empty() ? (place.bad ? "#b3142b" : "#1c7444")
                               : place.value  ? color_of(part)
                                              : "none";
      out << "<rect stroke=\"#888\" stroke-opacity=\"0.3\" x=\"" << at(x) << "\" y=\"" << at(y)
          << "\" width=\"" << at(w) << "\" height=\"" << at(h) << "\" fill=\"" << fill << "\"><title>"
          << xml_escaped(keys[0]) << " " << number_text(map.across[i], 6);
      if (keys.size() > 1) out << ", " << xml_escaped(keys[1]) << " " << number_text(map.up[k], 6);
      if (place.value) out << ": " << xml_escaped(quantity(*place.value, unit));
      if (place.runs > 1) out << ", the largest of " << place.runs << " runs";
      out << (place.bad ? ", not passed" : ", passed") << "</title></rect>\n";
      const std::string word = column.empty() ? ""
                               : place.value  ? xml_escaped(quantity(*place.value, unit))
                                              : "–";
      if (written && !word.empty())
        out << "<text text-anchor=\"middle\" x=\"" << at(x + 0.5 * w) << "\" y=\"" << at(y + 0.5 * h + 4)
            << "\" fill=\"" << (part > 0.6 ? "#000" : "#fff") << "\">" << word << "</text>\n";
      if (place.bad)
        out << "<path fill=\"none\" stroke=\"" << (column.empty() ? "#fff" : "#ff2d46")
            << "\" stroke-width=\"2\" d=\"M" << at(x + 4) << ' ' << at(y + 4) << " l8 8 m-8 0 l8 -8\"/>\n";
    }
  const std::size_t every = std::max<std::size_t>(1, static_cast<std::size_t>(std::ceil(52.0 / w)));
  for (std::size_t i = 0; i < map.across.size(); i += every)
    out << "<text text-anchor=\"middle\" x=\"" << at(kLeft + w * (static_cast<double>(i) + 0.5)) << "\" y=\""
        << at(kTop + h * rows + 18) << "\">" << number_text(map.across[i], 4) << "</text>\n";
  if (keys.size() > 1)
    for (std::size_t k = 0; k < map.up.size(); ++k)
      out << "<text text-anchor=\"end\" x=\"" << kLeft - 8 << "\" y=\""
          << at(kTop + h * (rows - 0.5 - static_cast<double>(k)) + 4) << "\">" << number_text(map.up[k], 4)
          << "</text>\n";
  out << "<text text-anchor=\"middle\" x=\"" << at(kLeft + 0.5 * w * columns) << "\" y=\""
      << at(kTop + h * rows + 42) << "\">" << xml_escaped(keys[0]) << "</text>\n";
  if (keys.size() > 1)
    out << "<text text-anchor=\"middle\" transform=\"translate(22 " << at(kTop + 0.5 * h * rows)
        << ") rotate(-90)\">" << xml_escaped(keys[1]) << "</text>\n";
  out << "</svg></div>\n";
}

void write_verdicts(std::ostream& out, const Table& table, int runs) {
  std::size_t bad = 0, faults = 0;
  std::map<std::string, std::size_t> failed;  // by demand
  for (std::size_t r = 0; r < table.rows(); ++r) {
    const std::string verdict = table.cell(r, "verdict");
    bad += is_bad(verdict) ? 1 : 0;
    faults += verdict == "fault" ? 1 : 0;
    for (const std::string& column : table.columns())
      if (column != "verdict" && table.cell(r, column) == "failed") ++failed[column];
  }
  const auto missing = static_cast<std::size_t>(runs) - table.rows();
  std::string sentence =
      std::to_string(table.rows() - bad) + " of " + counted(table.rows(), "run", "runs") + " passed.";
  if (faults > 0) sentence += " " + counted(faults, "run", "runs") + " ended early.";
  for (const auto& [name, count] : failed)
    sentence += " " + name + ": not met in " + counted(count, "run", "runs") + ".";
  if (missing > 0) sentence += " " + counted(missing, "run is", "runs are") + " missing.";
  const bool good = bad == 0 && missing == 0;
  write_verdict(out, good, good ? "passed" : bad > 0 ? "failed" : "unfinished", sentence);
}

void write_runs(std::ostream& out, const Table& table, const std::vector<std::string>& keys,
                const std::vector<std::string>& results) {
  out << "<h2>Runs</h2>\n";
  std::vector<std::string> head{"run #"};
  for (const std::string& key : keys) head.push_back(key + " #");
  head.push_back("verdict");
  for (const std::string& column : results) head.push_back(column + " #");
  head.push_back("fault");
  HtmlTable rows(out, head);
  for (const bool bad : {true, false})
    for (std::size_t r = 0; r < table.rows(); ++r) {
      const std::string verdict = table.cell(r, "verdict");
      if (is_bad(verdict) != bad) continue;
      const auto number = [&](const std::string& column) {
        const auto value = finite_number(table.cell(r, column));
        return value ? xml_escaped(quantity(*value, unit_of(column))) : std::string();
      };
      std::vector<std::string> cells{table.cell(r, "run")};
      for (const std::string& key : keys) cells.push_back(number(key));
      cells.push_back("<span class=\"" + std::string(bad ? "failed" : "passed") + "\">" +
                      xml_escaped(verdict) + "</span>");
      for (const std::string& column : results) cells.push_back(number(column));
      cells.push_back(xml_escaped(table.cell(r, "fault")));
      rows.row(cells, true);
    }
}

}  // namespace

std::vector<std::string> changing_columns(const Table& table, const std::vector<std::string>& keys) {
  std::vector<std::pair<double, std::string>> found;
  for (const std::string& column : table.columns()) {
    if (column == "run" || column == "computation_ratio" || column.ends_with(".time") ||
        std::ranges::find(keys, column) != keys.end())
      continue;
    double least = std::numeric_limits<double>::infinity(), most = -least;
    std::size_t numbers = 0;
    for (std::size_t r = 0; r < table.rows(); ++r)
      if (const auto value = finite_number(table.cell(r, column))) {
        ++numbers;
        least = std::min(least, *value);
        most = std::max(most, *value);
      }
    const Result* result = result_of(column);
    const double scale = std::max({std::abs(least), std::abs(most), result == nullptr ? 0.0 : result->floor});
    if (numbers > 0 && 2 * numbers >= table.rows() && most - least > 1e-9 * scale)
      found.emplace_back((most - least) / scale, column);
  }
  std::ranges::stable_sort(found, std::greater{}, [](const auto& one) { return one.first; });
  std::vector<std::string> names;
  for (const auto& [change, column] : found) names.push_back(column);
  return names;
}

void write_study_page(std::ostream& out, const std::string& title, const Table& table,
                      const std::vector<std::string>& keys, int runs, const std::string& plot,
                      std::string_view png) {
  begin_html(out, title);
  write_verdicts(out, table, runs);
  write_png_image(out, png, "The cell at the beginning of the first run");
  std::vector<std::string> results = changing_columns(table, keys);
  if (!plot.empty()) {
    std::erase(results, plot);
    results.insert(results.begin(), plot);
  }
  if (table.rows() > 0) {
    out << "<h2>" << xml_escaped(join(keys, ", ")) << "</h2>\n";
    if (keys.size() > 2)
      out << "<p>Each place is the largest value and the worst verdict of all runs with its two "
             "values.</p>\n";
    write_map(out, map_of(table, keys, ""), keys, "");
  }
  for (std::size_t i = 0; i < std::min(results.size(), kMostDrawn); ++i)
    if (keys.size() > 1)
      write_map(out, map_of(table, keys, results[i]), keys, results[i]);
    else
      table.write_plot(out, results[i], keys[0], with_unit(results[i]), "");
  if (results.size() > kMostColumns) results.resize(kMostColumns);
  write_runs(out, table, keys, results);
  end_html(out);
}

}  // namespace takt

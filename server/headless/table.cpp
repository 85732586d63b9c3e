#include "server/headless/table.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <limits>
#include <ostream>
#include <utility>

namespace takt {

namespace {

std::string number(double value, const char* format = "%.9g") {
  std::array<char, 40> text{};
  std::snprintf(text.data(), text.size(), format, value);
  return text.data();
}

/// What separates cells, or breaks lines, is quoted.
std::string quoted(const std::string& text) {
  if (text.find_first_of(",\"\n") == std::string::npos) return text;
  std::string result = "\"";
  for (const char c : text) result += c == '"' ? std::string("\"\"") : std::string(1, c);
  return result + "\"";
}

std::string escaped(const std::string& text) {
  std::string result;
  for (const char c : text)
    result += c == '&' ? std::string("&amp;") : c == '<' ? std::string("&lt;") : std::string(1, c);
  return result;
}

/// An axis from one end to the other with round numbers.
struct Axis {
  double lower = 0.0, upper = 1.0, step = 1.0;

  Axis(double least, double most) {
    if (!(most > least)) {
      const double room = least != 0.0 ? 0.1 * std::abs(least) : 1.0;
      least -= room;
      most += room;
    }
    const double raw = (most - least) / 5.0;
    const double power = std::pow(10.0, std::floor(std::log10(raw)));
    step = power;
    for (const double factor : {2.0, 5.0, 10.0})
      if (step < raw) step = factor * power;
    lower = step * std::floor(least / step + 1e-9);
    upper = step * std::ceil(most / step - 1e-9);
  }
  double part(double value) const { return (value - lower) / (upper - lower); }
};

constexpr double kWidth = 720.0, kHeight = 440.0, kLeft = 90.0, kRight = 160.0, kTop = 40.0, kBottom = 60.0;

}  // namespace

void Table::set(const std::string& column, const std::string& value) {
  if (std::find(columns_.begin(), columns_.end(), column) == columns_.end()) columns_.push_back(column);
  rows_.back()[column] = value;
}

void Table::set(const std::string& column, double value) {
  set(column, number(value));
}

std::string Table::cell(std::size_t row, const std::string& column) const {
  const auto found = rows_[row].find(column);
  return found == rows_[row].end() ? "" : found->second;
}

void Table::write_csv(std::ostream& out) const {
  for (std::size_t c = 0; c < columns_.size(); ++c) out << (c > 0 ? "," : "") << quoted(columns_[c]);
  out << '\n';
  for (std::size_t r = 0; r < rows_.size(); ++r) {
    for (std::size_t c = 0; c < columns_.size(); ++c)
      out << (c > 0 ? "," : "") << quoted(cell(r, columns_[c]));
    out << '\n';
  }
}

void Table::write_plot(std::ostream& out, const std::string& title, const std::string& x,
                       const std::string& y, const std::string& series) const {
  using Points = std::vector<std::pair<double, double>>;
  std::vector<std::pair<std::string, Points>> lines;
  double x_lower = std::numeric_limits<double>::infinity(), x_upper = -x_lower;
  double y_lower = x_lower, y_upper = -x_lower;
  for (std::size_t r = 0; r < rows_.size(); ++r) {
    const std::string x_text = cell(r, x), y_text = cell(r, y);
    char *x_end = nullptr, *y_end = nullptr;
    const double px = std::strtod(x_text.c_str(), &x_end), py = std::strtod(y_text.c_str(), &y_end);
    if (x_text.empty() || y_text.empty() || *x_end != '\0' || *y_end != '\0' || !std::isfinite(px) ||
        !std::isfinite(py))
      continue;
    const std::string name = series.empty() ? "" : cell(r, series);
    auto line = std::find_if(lines.begin(), lines.end(), [&](const auto& l) { return l.first == name; });
    if (line == lines.end()) line = lines.insert(lines.end(), {name, {}});
    line->second.emplace_back(px, py);
    x_lower = std::min(x_lower, px), x_upper = std::max(x_upper, px);
    y_lower = std::min(y_lower, py), y_upper = std::max(y_upper, py);
  }
  if (lines.empty()) x_lower = y_lower = 0.0, x_upper = y_upper = 1.0;
  const Axis across(x_lower, x_upper), up(y_lower, y_upper);
  const double w = kWidth - kLeft - kRight, h = kHeight - kTop - kBottom;
  const auto at_x = [&](double value) { return kLeft + w * across.part(value); };
  const auto at_y = [&](double value) { return kTop + h * (1.0 - up.part(value)); };
  const auto place = [](double value) { return number(value, "%.1f"); };
  out << "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"" << kWidth << "\" height=\"" << kHeight
      << "\" font-family=\"sans-serif\" font-size=\"12\">\n<rect width=\"100%\" height=\"100%\" "
         "fill=\"white\"/>\n"
      << "<text x=\"" << kLeft << "\" y=\"24\" font-size=\"15\">" << escaped(title) << "</text>\n";
  for (double v = across.lower; v <= across.upper + 1e-9 * across.step; v += across.step)
    out << "<path d=\"M" << place(at_x(v)) << ' ' << kTop << " V" << kTop + h
        << "\" stroke=\"#ddd\"/><text text-anchor=\"middle\" x=\"" << place(at_x(v)) << "\" y=\""
        << kTop + h + 18 << "\">" << number(std::abs(v) < 1e-9 * across.step ? 0.0 : v, "%.6g")
        << "</text>\n";
  for (double v = up.lower; v <= up.upper + 1e-9 * up.step; v += up.step)
    out << "<path d=\"M" << kLeft << ' ' << place(at_y(v)) << " H" << kLeft + w
        << "\" stroke=\"#ddd\"/><text text-anchor=\"end\" x=\"" << kLeft - 6 << "\" y=\""
        << place(at_y(v) + 4) << "\">" << number(std::abs(v) < 1e-9 * up.step ? 0.0 : v, "%.6g")
        << "</text>\n";
  out << "<text text-anchor=\"middle\" x=\"" << kLeft + w / 2 << "\" y=\"" << kHeight - 14 << "\">"
      << escaped(x) << "</text>\n<text text-anchor=\"middle\" transform=\"translate(18 " << kTop + h / 2
      << ") rotate(-90)\">" << escaped(y) << "</text>\n";
  constexpr std::array<const char*, 6> kColors{"#1f77b4", "#d62728", "#2ca02c",
                                               "#9467bd", "#ff7f0e", "#555555"};
  for (std::size_t l = 0; l < lines.size(); ++l) {
    auto& [name, points] = lines[l];
    std::sort(points.begin(), points.end());
    const char* color = kColors[l % kColors.size()];
    out << "<polyline fill=\"none\" stroke-width=\"1.5\" stroke=\"" << color << "\" points=\"";
    for (const auto& [px, py] : points) out << place(at_x(px)) << ',' << place(at_y(py)) << ' ';
    out << "\"/>\n";
    for (const auto& [px, py] : points)
      out << "<circle r=\"2.5\" fill=\"" << color << "\" cx=\"" << place(at_x(px)) << "\" cy=\""
          << place(at_y(py)) << "\"/>\n";
    if (!series.empty() && l < 18)
      out << "<text fill=\"" << color << "\" x=\"" << kLeft + w + 12 << "\" y=\""
          << kTop + 16.0 * static_cast<double>(l + 1) << "\">" << escaped(name) << "</text>\n";
  }
  if (!series.empty())
    out << "<text x=\"" << kLeft + w + 12 << "\" y=\"" << kTop - 2 << "\">" << escaped(series) << "</text>\n";
  out << "</svg>\n";
}

}  // namespace takt

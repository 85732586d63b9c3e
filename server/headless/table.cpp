#include "server/headless/table.h"

#include <algorithm>
#include <ostream>

#include "idl/common/parse.h"
#include "idl/common/text.h"
#include "server/headless/svg_plot.h"

namespace takt {

namespace {

/// Quotes text with separators or line breaks.
std::string cell_text(const std::string& text) {
  if (text.find_first_of(",\"\n") == std::string::npos) return text;
  std::string result = "\"";
  for (const char c : text) result += c == '"' ? std::string("\"\"") : std::string(1, c);
  return result + "\"";
}

/// "1.5", "1.5 mm"; "" and "-" stand for a number that there is not.
bool begins_with_number(const std::string& text) {
  return text.empty() || text == "-" || finite_number(text.substr(0, text.find(' ')));
}

}  // namespace

void Table::set(const std::string& column, const std::string& value) {
  if (std::find(columns_.begin(), columns_.end(), column) == columns_.end()) columns_.push_back(column);
  rows_.back()[column] = value;
}

void Table::set(const std::string& column, double value) {
  set(column, number_text(value));
}

std::string Table::cell(std::size_t row, const std::string& column) const {
  const auto found = rows_[row].find(column);
  return found == rows_[row].end() ? "" : found->second;
}

void Table::write_csv(std::ostream& out) const {
  for (std::size_t c = 0; c < columns_.size(); ++c) out << (c > 0 ? "," : "") << cell_text(columns_[c]);
  out << '\n';
  for (std::size_t r = 0; r < rows_.size(); ++r) {
    for (std::size_t c = 0; c < columns_.size(); ++c)
      out << (c > 0 ? "," : "") << cell_text(cell(r, columns_[c]));
    out << '\n';
  }
}

void Table::write_aligned(std::ostream& out) const {
  std::vector<std::string> lines(rows_.size() + 1);
  for (std::size_t c = 0; c < columns_.size(); ++c) {
    const auto text = [&](std::size_t line) { return line == 0 ? columns_[c] : cell(line - 1, columns_[c]); };
    std::size_t width = 0;
    bool numbers = true;
    for (std::size_t line = 0; line < lines.size(); ++line) {
      width = std::max(width, text(line).size());
      numbers = numbers && (line == 0 || begins_with_number(text(line)));
    }
    for (std::size_t line = 0; line < lines.size(); ++line) {
      const std::string blank(width - text(line).size(), ' ');
      if (c > 0) lines[line] += "  ";
      lines[line] += numbers ? blank + text(line) : text(line) + blank;
    }
  }
  for (std::string& line : lines) {
    line.erase(line.find_last_not_of(' ') + 1);
    out << line << '\n';
  }
}

void Table::write_plot(std::ostream& out, const std::string& title, const std::string& x,
                       const std::string& y, const std::string& series) const {
  Plot plot{title, x, y, series, {}, true};
  for (std::size_t r = 0; r < rows_.size(); ++r) {
    const auto px = finite_number(cell(r, x)), py = finite_number(cell(r, y));
    if (!px || !py) continue;
    const std::string name = series.empty() ? "" : cell(r, series);
    auto line =
        std::find_if(plot.lines.begin(), plot.lines.end(), [&](const PlotLine& l) { return l.name == name; });
    if (line == plot.lines.end()) line = plot.lines.insert(plot.lines.end(), {name, {}});
    line->points.emplace_back(*px, *py);
  }
  for (PlotLine& line : plot.lines) std::sort(line.points.begin(), line.points.end());
  write_svg(out, plot);
}

}  // namespace takt

#include "server/headless/html_page.h"

#include <nlohmann/json.hpp>

#include "idl/common/text.h"
#include "server/headless/svg_plot.h"

namespace takt {

namespace {

constexpr std::size_t kMaxRows = 200;  // of a table

constexpr const char* kStyle = R"(
body { font: 15px/1.4 sans-serif; max-width: 1100px; margin: 2em auto; padding: 0 1em; color: #222 }
h1 { font-size: 1.6em } h2 { font-size: 1.2em; margin-top: 1.8em; border-bottom: 1px solid #ccc }
table { border-collapse: collapse; margin: .6em 0 } td, th { padding: .15em .8em .15em 0; text-align: left }
td.n, th.n { text-align: right; font-variant-numeric: tabular-nums } tr:nth-child(even) { background: #f5f5f5 }
.passed { color: #196f3d } .failed, .over { color: #b00020; font-weight: bold } .skipped { color: #777 }
.bar { display: inline-block; height: .7em; background: #1f77b4 } .bar.over { background: #b00020 }
)";

}  // namespace

void begin_html(std::ostream& out, const std::string& title) {
  const std::string name = xml_escaped(title);
  out << "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>" << name
      << "</title><style>" << kStyle << "</style></head><body>\n<h1>" << name << "</h1>\n";
}

void end_html(std::ostream& out) {
  out << "</body></html>\n";
}

std::string text_of(const nlohmann::ordered_json& value) {
  if (value.is_null()) return "";
  if (value.is_string()) return value.get<std::string>();
  if (value.is_number()) return number_text(value.get<double>(), 4);
  return value.dump();
}

HtmlTable::HtmlTable(std::ostream& out, const std::vector<std::string>& head) : out_(out) {
  out_ << "<table><tr>";
  for (const std::string& name : head) {
    numbers_.push_back(name.find('(') != std::string::npos || name == "#");
    out_ << "<th" << (numbers_.back() ? " class=\"n\"" : "") << ">" << xml_escaped(name) << "</th>";
  }
  out_ << "</tr>\n";
}

HtmlTable::~HtmlTable() {
  if (rows_ > kMaxRows)
    out_ << "<tr><td colspan=\"" << numbers_.size() << "\">and " << rows_ - kMaxRows
         << " more (the JSON report has all)</td></tr>\n";
  out_ << "</table>\n";
}

void HtmlTable::row(const std::vector<std::string>& cells, bool raw) {
  if (++rows_ > kMaxRows) return;
  out_ << "<tr>";
  for (std::size_t i = 0; i < cells.size(); ++i)
    out_ << "<td" << (i < numbers_.size() && numbers_[i] ? " class=\"n\"" : "") << ">"
         << (raw ? cells[i] : xml_escaped(cells[i])) << "</td>";
  out_ << "</tr>\n";
}

}  // namespace takt

#include "server/headless/html_page.h"

#include <array>
#include <cmath>
#include <nlohmann/json.hpp>

#include "idl/common/text.h"
#include "idl/common/xml.h"
#include "server/headless/svg_plot.h"

namespace takt {

namespace {

constexpr std::size_t kMaxRows = 200;  // of a table

// Colours and sizes are those of client_lib/view/web/style.css.
constexpr const char* kStyle = R"(
:root { --ground: #f6f7f9; --panel: #fff; --raised: #eef1f5; --line: #d5dae1; --ink: #1b232c; --soft: #55616e;
  --accent: #0b62b8; --good: #1c7444; --bad: #b3142b; --curve-0: #1953bb; --curve-1: #e96c03; --curve-2: #00a86b;
  --curve-3: #d26fb4; --curve-4: #64410a; --curve-5: #2a2f37; color-scheme: light dark }
@media (prefers-color-scheme: dark) { :root { --ground: #14181d; --panel: #1b2027; --raised: #262d36;
  --line: #38414c; --ink: #e6ebf0; --soft: #a3b0bd; --accent: #6cb6ff; --good: #63cf94; --bad: #ff8593;
  --curve-0: #11bcff; --curve-1: #de5d17; --curve-2: #487753; --curve-3: #a64596; --curve-4: #f8e226;
  --curve-5: #dbfff7 } }
* { box-sizing: border-box }
body { font: 14px/1.45 system-ui, 'Segoe UI', Roboto, sans-serif; max-width: 1160px; margin: 0 auto;
  padding: 20px 16px 60px; color: var(--ink); background: var(--ground) }
h1 { font-size: 22px; margin: 0 0 12px } h3 { font-size: 14px }
h2 { font-size: 16px; margin: 28px 0 8px; border-bottom: 1px solid var(--line); padding-bottom: 4px }
p { margin: 6px 0 } .soft { color: var(--soft) }
.verdict { display: flex; gap: 14px; align-items: baseline; padding: 12px 16px; border-radius: 6px;
  background: var(--panel); border: 1px solid var(--line); border-left: 6px solid var(--bad) }
.verdict.passed { border-left-color: var(--good) } .verdict strong { font-size: 18px }
.numbers { display: grid; grid-template-columns: repeat(auto-fill, minmax(160px, 1fr)); gap: 8px; margin: 12px 0 }
.numbers div { background: var(--panel); border: 1px solid var(--line); border-radius: 6px; padding: 8px 12px }
.numbers dt { color: var(--soft); font-size: 12px } .numbers dd { margin: 0; font-size: 17px;
  font-variant-numeric: tabular-nums }
pre { white-space: pre-wrap; overflow-wrap: anywhere; background: var(--raised); padding: 8px 12px; border-radius: 6px }
img { max-width: 100%; height: auto; display: block; margin: 12px 0; border: 1px solid var(--line); border-radius: 6px }
.scroll { overflow-x: auto }
table { border-collapse: collapse; margin: 8px 0; background: var(--panel) }
td, th { padding: 4px 12px; text-align: left; border-bottom: 1px solid var(--line) }
th { color: var(--soft); font-weight: 600; font-size: 12px }
td.n, th.n { text-align: right; font-variant-numeric: tabular-nums; white-space: nowrap }
.passed { color: var(--good) } .failed, .over { color: var(--bad); font-weight: 650 } .skipped { color: var(--soft) }
.verdict.passed, .verdict.failed { color: inherit; font-weight: inherit }
.verdict.passed strong { color: var(--good) } .verdict.failed strong { color: var(--bad) }
.bar { display: inline-block; height: 8px; border-radius: 2px; background: var(--accent) }
.bar.over { background: var(--bad) }
svg { max-width: 100%; height: auto; display: block; margin: 8px 0; color: var(--ink) }
.scroll svg { min-width: 720px }
svg .paper { fill: var(--panel) }
svg .c0 { color: var(--curve-0) } svg .c1 { color: var(--curve-1) } svg .c2 { color: var(--curve-2) }
svg .c3 { color: var(--curve-3) } svg .c4 { color: var(--curve-4) } svg .c5 { color: var(--curve-5) }
)";

std::string base64(std::string_view bytes) {
  constexpr std::string_view kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    unsigned word = 0;
    for (std::size_t k = 0; k < 3; ++k)
      word = word << 8 | (i + k < bytes.size() ? static_cast<unsigned char>(bytes[i + k]) : 0U);
    for (std::size_t k = 0; k < 4; ++k)
      text += i + k <= bytes.size() ? kDigits[word >> (18 - 6 * k) & 63U] : '=';
  }
  return text;
}

}  // namespace

void begin_html(std::ostream& out, const std::string& title) {
  const std::string name = xml_escaped(title);
  out << "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><meta name=\"viewport\" "
         "content=\"width=device-width, initial-scale=1\"><title>"
      << name << "</title><style>" << kStyle << "</style></head><body>\n<h1>" << name << "</h1>\n";
}

void end_html(std::ostream& out) {
  out << "</body></html>\n";
}

void write_verdict(std::ostream& out, bool good, const std::string& word, const std::string& sentence) {
  out << "<div class=\"verdict " << (good ? "passed" : "failed") << "\"><strong>" << xml_escaped(word)
      << "</strong><span>" << xml_escaped(sentence) << "</span></div>\n";
}

void write_key_numbers(std::ostream& out, const std::vector<std::pair<std::string, std::string>>& numbers) {
  out << "<dl class=\"numbers\">\n";
  for (const auto& [name, value] : numbers)
    out << "<div><dt>" << xml_escaped(name) << "</dt><dd>" << xml_escaped(value) << "</dd></div>\n";
  out << "</dl>\n";
}

void write_png_image(std::ostream& out, std::string_view png, const std::string& description) {
  if (png.empty()) return;
  out << "<img alt=\"" << xml_escaped(description) << "\" src=\"data:image/png;base64," << base64(png)
      << "\">\n";
}

std::string text_of(const nlohmann::ordered_json& value) {
  if (value.is_null()) return "";
  if (value.is_string()) return value.get<std::string>();
  if (value.is_number()) return number_text(value.get<double>(), 4);
  return value.dump();
}

std::string quantity(double value, const std::string& unit) {
  struct Prefix {
    const char* text;
    double factor;
  };
  // From the smallest one. Lengths stay below kilometres.
  constexpr std::array kPrefixes{Prefix{"µ", 1e-6}, Prefix{"m", 1e-3}, Prefix{"", 1.0},
                                 Prefix{"k", 1e3},  Prefix{"M", 1e6},  Prefix{"G", 1e9}};
  const bool length = unit == "m";
  const bool scaled = length || unit == "N" || unit == "Pa" || unit == "J" || unit == "W" || unit == "N m";
  const double size = std::abs(value);
  if (unit.empty()) return number_text(value, 4);
  if (!scaled || !(size > 0.0) || !std::isfinite(size)) return number_text(value, 4) + " " + unit;
  const Prefix* chosen = length ? &kPrefixes[0] : &kPrefixes[1];
  for (const Prefix& prefix : kPrefixes)
    if (prefix.factor >= chosen->factor && !(length && prefix.factor > 1.0) && 0.9999 * prefix.factor <= size)
      chosen = &prefix;
  const double scaled_size = size / chosen->factor;
  if (scaled_size < 1e-3) return "< 0.001 " + (chosen->text + unit);  // what is left of rounding
  return number_text(value / chosen->factor, 4) + " " + chosen->text + unit;
}

std::string quantity(const nlohmann::ordered_json& value, const std::string& unit) {
  return value.is_number() ? quantity(value.get<double>(), unit) : text_of(value);
}

HtmlTable::HtmlTable(std::ostream& out, const std::vector<std::string>& head) : out_(out) {
  out_ << "<div class=\"scroll\"><table><tr>";
  for (const std::string& name : head) {
    const bool of_quantities = name.ends_with(" #");
    numbers_.push_back(of_quantities || name.find('(') != std::string::npos);
    out_ << "<th" << (numbers_.back() ? " class=\"n\"" : "") << ">"
         << xml_escaped(of_quantities ? name.substr(0, name.size() - 2) : name) << "</th>";
  }
  out_ << "</tr>\n";
}

HtmlTable::~HtmlTable() {
  if (rows_ > kMaxRows)
    out_ << "<tr><td colspan=\"" << numbers_.size() << "\">and " << rows_ - kMaxRows
         << " more (the JSON report or the CSV table has all)</td></tr>\n";
  out_ << "</table></div>\n";
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

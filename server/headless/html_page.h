#pragma once
// What the reports have in common as pages for a browser: head with the style of takt view's page, verdict, numbers,
// pictures, tables. No external files.
#include <nlohmann/json_fwd.hpp>
#include <ostream>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace takt {

/// Up to the heading, which is the title.
void begin_html(std::ostream& out, const std::string& title);
void end_html(std::ostream& out);

/// Ahead of all else. `good`: in the colour of success; the sentence is text.
void write_verdict(std::ostream& out, bool good, const std::string& word, const std::string& sentence);

/// The numbers that matter most: names, and values with their units.
void write_key_numbers(std::ostream& out, const std::vector<std::pair<std::string, std::string>>& numbers);

/// A picture within the page; nothing without bytes.
void write_png_image(std::ostream& out, std::string_view png, const std::string& description);

/// A value as a cell of a table: null as nothing, numbers with four digits.
std::string text_of(const nlohmann::ordered_json& value);

/// Four digits and the unit, with a prefix that leaves 1 to 1000 of it, "1.25 MPa", or "< 0.001 mN". Angles, times and
/// numbers without a unit have no prefix. Null as nothing.
std::string quantity(const nlohmann::ordered_json& value, const std::string& unit);
std::string quantity(double value, const std::string& unit);

/// A table, written row by row.
class HtmlTable {
 public:
  /// A name with a unit in parentheses, "name (unit)", is that of a column of numbers; so is "name #", without
  /// its sign, where the cells have units.
  HtmlTable(std::ostream& out, const std::vector<std::string>& head);
  ~HtmlTable();
  HtmlTable(const HtmlTable&) = delete;
  HtmlTable& operator=(const HtmlTable&) = delete;

  /// Cells are HTML already where `raw`.
  void row(const std::vector<std::string>& cells, bool raw = false);

 private:
  std::ostream& out_;
  std::vector<bool> numbers_;
  std::size_t rows_ = 0;
};

}  // namespace takt

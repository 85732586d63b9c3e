#pragma once
// What the reports have in common as pages for a browser: head with style, tables. No external files.
#include <nlohmann/json_fwd.hpp>
#include <ostream>
#include <string>
#include <vector>

namespace takt {

/// Up to the heading, which is the title.
void begin_html(std::ostream& out, const std::string& title);
void end_html(std::ostream& out);

/// A value as a cell of a table: null as nothing, numbers with four digits.
std::string text_of(const nlohmann::ordered_json& value);

/// A table, written row by row.
class HtmlTable {
 public:
  /// A name with a unit in parentheses, "name (unit)", is that of a column of numbers; so is "#".
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

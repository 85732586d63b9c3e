#pragma once
// A table of numbers and words with named columns: as CSV, as text for a terminal, and as a plot of one column over another (SVG).
#include <iosfwd>
#include <map>
#include <string>
#include <vector>

namespace takt {

class Table {
 public:
  /// Starts a new row; columns appear in the order of their first use.
  void begin_row() { rows_.emplace_back(); }
  void set(const std::string& column, const std::string& value);
  void set(const std::string& column, double value);

  const std::vector<std::string>& columns() const { return columns_; }
  std::size_t rows() const { return rows_.size(); }
  /// Empty where the row has no such cell.
  std::string cell(std::size_t row, const std::string& column) const;

  void write_csv(std::ostream& out) const;
  /// For a terminal: columns as wide as their widest cell, two spaces apart, numbers to the right.
  void write_aligned(std::ostream& out) const;
  /// Points of `y` over `x`, one line for each value of `series` (empty: one line). Rows without numbers are
  /// skipped.
  void write_plot(std::ostream& out, const std::string& title, const std::string& x, const std::string& y,
                  const std::string& series) const;

 private:
  std::vector<std::string> columns_;
  std::vector<std::map<std::string, std::string>> rows_;
};

}  // namespace takt

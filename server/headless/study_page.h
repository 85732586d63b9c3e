#pragma once
// The table of a study as a page for a browser: verdicts first, the cell, what changes most, all runs.
#include <ostream>
#include <string>
#include <string_view>
#include <vector>

#include "server/headless/table.h"

namespace takt {

/// Columns of results that are numbers in at least half of the rows: those that change most come first, by their range
/// over their largest absolute value. Times of computation and columns that do not change are left out.
std::vector<std::string> changing_columns(const Table& table, const std::vector<std::string>& keys);

/// `table`: columns "run", the keys, "verdict" and results; `runs`: of the whole study; `plot`: the column that is drawn
/// first, or empty; `png`: a picture of the cell, or empty.
void write_study_page(std::ostream& out, const std::string& title, const Table& table,
                      const std::vector<std::string>& keys, int runs, const std::string& plot,
                      std::string_view png);

}  // namespace takt

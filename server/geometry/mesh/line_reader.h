#pragma once
// Lines, words and numbers of mesh files that are text (OBJ, STL).
#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "plant_models/spatial.h"

namespace takt {

/// Iterates over the lines of a text. Blanks are space, tab, carriage return, vertical tab and form feed.
class LineReader {
 public:
  /// With `join_continued` a backslash as the last word of a line joins the next line to it (OBJ).
  LineReader(std::string_view text, bool join_continued) : text_(text), join_continued_(join_continued) {}

  /// Goes to the next line that is not blank. False at the end of the text.
  bool next();

  std::size_t line = 0;        ///< number of the line, from 1; of joined lines the first
  std::string_view word;       ///< the first word of the line
  std::string_view arguments;  ///< the rest of the line, without blanks at its ends

  /// The words of `arguments`; valid until the next call.
  const std::vector<std::string_view>& words();

  /// Reads `arguments` as numbers. Throws MeshFault for fewer than three numbers or for a number that is not
  /// finite in single precision. `vertex`: its number in the file, for the message; 0: without number.
  const std::vector<double>& coordinates(std::size_t vertex = 0);

  /// Throws MeshFault with the number of the line.
  [[noreturn]] void fail(const std::string& problem) const;

 private:
  std::string_view take_line();

  std::string_view text_;
  bool join_continued_;
  std::size_t next_line_ = 1;
  std::string joined_;
  std::vector<std::string_view> words_;
  std::vector<double> numbers_;
};

/// The word in quotation marks, shortened if it is long.
std::string quoted(std::string_view word);

}  // namespace takt

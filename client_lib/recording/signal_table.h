#pragma once
// Instants as a table (CSV), of `takt record` and of takt-run: a column for each number, text and truth value, called as
// the signals of recordings are, e.g. components.P.position.x.
#include <nlohmann/json.hpp>
#include <string>
#include <unordered_map>

namespace takt::recording {

class SignalTable {
 public:
  /// The lines that an instant adds: a row, and ahead of the first one the names. `time` is the first column; the first
  /// instant gives the others. A value that an instant lacks is empty. Numbers read back to the same bits; truth values
  /// are 1 and 0.
  std::string lines(const nlohmann::json& instant);

 private:
  std::unordered_map<std::string, std::size_t> columns_;
};

}  // namespace takt::recording

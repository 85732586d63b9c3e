#include "client_lib/recording/signal_table.h"

#include <vector>

#include "client_lib/recording/message_json.h"
#include "idl/common/text.h"

namespace takt::recording {
namespace {

std::string text_of(const nlohmann::json& value) {
  if (value.is_null()) return {};
  if (value.is_boolean()) return value.get<bool>() ? "1" : "0";
  if (value.is_number_float()) return exact_text(value.get<double>());
  return value.is_string() ? value.get<std::string>() : value.dump();
}

}  // namespace

std::string SignalTable::lines(const nlohmann::json& instant) {
  std::string names, row;
  const bool first = columns_.empty();
  if (first) columns_.emplace(names = "time", 0);
  std::vector<std::string> cells(columns_.size());
  const auto put = [&](const std::string& name, const nlohmann::json& value) {
    if (first && columns_.emplace(name, cells.size()).second) {
      names += "," + name;
      cells.emplace_back();
    }
    if (const auto column = columns_.find(name); column != columns_.end())
      cells[column->second] = text_of(value);
  };
  for_each_leaf(instant, put);
  for (const std::string& cell : cells) row += (&cell == cells.data() ? "" : ",") + cell;
  return (first ? names + "\n" : "") + row + "\n";
}

}  // namespace takt::recording

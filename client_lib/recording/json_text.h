#pragma once
// JSON with foreign texts: names and messages come from the wire, from files and from the command line. They may
// be invalid UTF-8, for which dump() alone throws, and nested so deeply that writing them overflows the stack.
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "takt_msgs.h"

namespace takt::recording {

/// Invalid UTF-8 becomes U+FFFD. `indent` as of dump(): below 0, the text has one line.
template <typename Document>
std::string json_text(const Document& document, int indent = -1) {
  return document.dump(indent, ' ', false, Document::error_handler_t::replace);
}

/// Largest depth of nested objects and lists; takt's own messages have less than half.
inline constexpr int kDeepestJson = 32;

/// Empty if the text is invalid JSON or nested deeper than kDeepestJson.
inline std::optional<nlohmann::json> read_json(std::string_view text) {
  using Event = nlohmann::json::parse_event_t;
  bool deep = false;
  // The callback discards deeper elements, so that no deep document is built from any text.
  const auto shallow = [&deep](int depth, Event event, const nlohmann::json&) {
    deep = deep || (depth >= kDeepestJson && (event == Event::object_start || event == Event::array_start));
    return !deep;
  };
  nlohmann::json document = nlohmann::json::parse(text.begin(), text.end(), shallow, false);
  if (deep || document.is_discarded()) return std::nullopt;
  return document;
}

/// The value of an argument or a result; a document as it is, but one that cannot be read as its text.
inline nlohmann::json value_json(const takt_msgs::msg::Value& value) {
  switch (value.kind) {
    case ValueKind::boolean:
      return value.flag;
    case ValueKind::integer:
      return value.integer;
    case ValueKind::number:
      return value.number;
    case ValueKind::numbers:
      return value.numbers;
    case ValueKind::texts:
      return value.texts;
    case ValueKind::document:
      if (auto document = read_json(value.text)) return *std::move(document);
      break;
    case ValueKind::text:
      break;
  }
  return value.text;
}
/// {name: value}.
inline nlohmann::json values_json(const std::vector<takt_msgs::msg::Argument>& values) {
  auto object = nlohmann::json::object();
  for (const auto& [name, value] : values) object[name] = value_json(value);
  return object;
}

}  // namespace takt::recording

#include "server/headless/scenario_schema.h"

#include <cmath>
#include <map>
#include <nlohmann/json.hpp>

#include "server/fields/field_value.h"
#include "server/scenario/scenario_writer.h"

namespace takt {

namespace {

using Json = nlohmann::ordered_json;
using Kind = KeyInfo::Kind;

Json default_value(const KeyInfo& field) {
  const Json value = Json::parse(field.default_text, nullptr, false);
  return value.is_discarded() ? Json(field.default_text) : value;
}

class Schema {
 public:
  Json root(const KeyInfo& info) {
    Json schema{{"$schema", "https://json-schema.org/draft/2020-12/schema"}, {"title", "Scenario of takt"}};
    schema.update(section(info));
    schema["type"] = "object";
    schema["$defs"] = shared_;
    return schema;
  }

 private:
  Json property(const KeyInfo& field) {
    Json schema = value(field);
    if (!field.other_forms.empty()) {
      Json forms = Json::array({schema});
      for (const KeyInfo& form : field.other_forms) forms.push_back(value(form));
      schema = Json{{"anyOf", forms}};
    }
    const std::string unit = field.unit.empty() ? "" : " (" + field.unit + ")";
    if (!field.doc.empty()) schema["description"] = field.doc + unit;
    if (!field.default_text.empty()) schema["default"] = default_value(field);
    return schema;
  }

  Json value(const KeyInfo& field) {
    switch (field.kind) {
      case Kind::number:
      case Kind::whole: {
        Json schema{{"type", field.kind == Kind::whole ? "integer" : "number"}};
        if (std::isfinite(field.lower))
          schema[field.lower_open ? "exclusiveMinimum" : "minimum"] = field.lower;
        if (std::isfinite(field.upper)) schema["maximum"] = field.upper;
        return schema;
      }
      case Kind::flag:
        return {{"type", "boolean"}};
      case Kind::text:
      case Kind::file:
        return {{"type", "string"}, {"minLength", 1}};
      case Kind::choice:
        return {{"enum", field.choices}};
      case Kind::list: {
        Json schema{{"type", "array"}, {"items", property(field.items.front())}};
        if (field.min_items > 0) schema["minItems"] = field.min_items;
        if (field.max_items > 0) schema["maxItems"] = field.max_items;
        if (field.min_items + field.max_items == 0) schema["type"] = {"array", "null"};
        return schema;
      }
      case Kind::section:
        break;
    }
    if (field.shared.empty()) return section(field);
    if (!shared_.contains(field.shared)) shared_[field.shared] = section(field);
    return {{"$ref", "#/$defs/" + field.shared}};
  }

  Json section(const KeyInfo& info) {
    Json schema{{"type", "object"}, {"properties", Json::object()}, {"additionalProperties", false}};
    Json required = Json::array(), all = Json::array();
    std::map<std::string, Json> conditions;  // by the condition as text: its branches
    for (const KeyInfo& field : info.items) {
      if (field.key == "*") {
        schema["additionalProperties"] = property(field);
        if (info.scenario_names) schema["propertyNames"] = {{"pattern", "^[A-Za-z][A-Za-z0-9_]{0,63}$"}};
        continue;
      }
      schema["properties"][field.key] = property(field);
      if (!field.required_for.empty())
        conditions[condition({field.required_key, field.required_for, false}).dump()]["then"]["required"]
            .push_back(field.key);
      if (field.when.key.empty()) {
        if (field.required) required.push_back(field.key);
        continue;
      }
      Json& both = conditions[condition(field.when).dump()];
      if (field.required) both["then"]["required"].push_back(field.key);
      both["else"]["properties"][field.key] = false;
    }
    for (const auto& [when, both] : conditions) {
      Json rule{{"if", Json::parse(when)}};
      rule.update(both);
      all.push_back(rule);
    }
    for (const KeyInfo::Alternatives& group : info.alternatives) {
      const Json rule = alternatives(group);
      all.push_back(group.when.key.empty() ? rule : Json{{"if", condition(group.when)}, {"then", rule}});
    }
    for (const std::vector<std::string>& group : info.together)
      for (const std::string& key : group) schema["dependentRequired"][key] = group;
    const bool may_be_empty = required.empty() && info.key != "*";
    if (may_be_empty) schema["type"] = {"object", "null"};
    if (!required.empty()) schema["required"] = required;
    if (!all.empty()) schema["allOf"] = all;
    if (schema["properties"].empty()) schema.erase("properties");
    return schema;
  }

  static Json condition(const KeyInfo::Condition& when) {
    Json result{{"properties", {{when.key, {{"enum", when.words}}}}}};
    if (!when.absent) result["required"] = {when.key};
    return result;
  }

  static Json alternatives(const KeyInfo::Alternatives& group) {
    Json given = Json::array(), both = Json::array();
    for (std::size_t i = 0; i < group.keys.size(); ++i) {
      given.push_back({{"required", {group.keys[i]}}});
      for (std::size_t j = 0; j < i; ++j) both.push_back({{"required", {group.keys[j], group.keys[i]}}});
    }
    if (group.least > 0) return {{group.most == 1 ? "oneOf" : "anyOf", given}};
    return {{"not", {{"anyOf", both}}}};
  }

  Json shared_ = Json::object();
};

// The page.

std::string interval(const KeyInfo& field) {
  NumberRange range{field.lower, field.upper, field.lower_open};
  const std::string words = range.allowed();
  return field.kind == Kind::whole ? "whole number" + words.substr(std::string("a number").size())
                                   : words.substr(std::string("a ").size());
}

std::string words_of(const KeyInfo& field) {
  std::string words;
  switch (field.kind) {
    case Kind::number:
    case Kind::whole:
      words = interval(field);
      break;
    case Kind::flag:
      words = "true or false";
      break;
    case Kind::text:
      words = "text";
      break;
    case Kind::file:
      words = "path, relative to the file";
      break;
    case Kind::choice:
      for (const std::string& word : field.choices) words += (words.empty() ? "`" : ", `") + word + "`";
      break;
    case Kind::list:
      words = "list of " +
              (field.max_items == 0 || field.max_items != field.min_items
                   ? ""
                   : std::to_string(field.max_items) + ": ") +
              words_of(field.items.front());
      break;
    case Kind::section:
      words = field.shared.empty() ? "section" : "section [" + field.shared + "](#" + field.shared + ")";
  }
  for (const KeyInfo& form : field.other_forms) words += "; or " + words_of(form);
  return field.unit.empty() ? words : words + "; " + field.unit;
}

class Page {
 public:
  void section(const KeyInfo& info, const std::string& path) {
    text += "\n## " + path + "\n\n";
    if (!info.doc.empty()) text += info.doc + "\n\n";
    for (const KeyInfo::Alternatives& group : info.alternatives) {
      text += group.least == 0 ? "At most one of" : group.most == 1 ? "Exactly one of" : "At least one of";
      for (const std::string& key : group.keys)
        text += (&key == &group.keys.front() ? " `" : ", `") + key + "`";
      text += condition(group.when) + ".\n\n";
    }
    text += "| key | value | default | meaning |\n|---|---|---|---|\n";
    for (const KeyInfo& field : info.items) row(field);
    for (const KeyInfo& field : info.items) {
      const KeyInfo& inner = field.kind == Kind::list ? field.items.front() : field;
      if (inner.kind != Kind::section || inner.items.empty()) continue;
      const std::string key = field.key == "*" ? "NAME" : field.key;
      if (inner.shared.empty())
        section(inner, path == kTop ? key : path + "." + key);
      else
        shared.emplace(inner.shared, inner);
    }
  }
  static constexpr const char* kTop = "The file";
  std::string text;
  std::map<std::string, KeyInfo> shared;

 private:
  static std::string condition(const KeyInfo::Condition& when) {
    std::string words;
    for (const std::string& word : when.words)
      words += (words.empty() ? " where `" + when.key + "` is " : " or ") + word;
    return words;
  }
  void row(const KeyInfo& field) {
    std::string fallback = field.required               ? "required"
                           : field.default_text.empty() ? ""
                                                        : "`" + field.default_text + "`";
    for (const std::string& word : field.required_for)
      fallback += (fallback.empty() ? "" : "; ") + ("required for " + word);
    text += "| `" + (field.key == "*" ? "NAME" : field.key) + "` | " + words_of(field) + " | " + fallback +
            " | " + field.doc;
    if (!field.when.key.empty()) text += " Only" + condition(field.when) + ".";
    if (!field.in_model) text += " *";
    text += " |\n";
  }
};

}  // namespace

std::string scenario_schema() {
  return Schema().root(scenario_info()).dump(1) + "\n";
}

std::string scenario_reference() {
  Page page;
  page.text =
      "# Keys of scenario files\n\n"
      "A scenario is a YAML file. This page is made of the tables that read it (`takt-run "
      "reference`), as is the "
      "JSON Schema `config/scenarios/scenario.schema.json`, with which editors that know the YAML language "
      "server complete "
      "and check keys: the line `# yaml-language-server: $schema=PATH` at the top of a file names it.\n\n"
      "Units are in the names of keys. Quaternions are x, y, z, w. Keys marked * are not part of the model: "
      "with another "
      "value a cell has the same model hash, and its saved states fit.\n";
  page.section(scenario_info(), Page::kTop);
  for (const auto& [name, info] : std::map<std::string, KeyInfo>(page.shared)) page.section(info, name);
  return page.text;
}

}  // namespace takt

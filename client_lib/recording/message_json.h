#pragma once
// Messages as JSON with the names of the IDL; `takt --json` writes this form. If a list has the order of a description
// (@order) or a @key, its elements are members with their name. An index of the description (@index) is a name, or null
// without an element; without a description it is a number. Enumerations are names, and @hexadecimal numbers are texts.
// The path to a number, joined by points, is the name of its signal in a recording: components.P.position.x.
#include <functional>
#include <nlohmann/json.hpp>
#include <string>

#include "idl/common/named_lists.h"
#include "idl/common/text.h"

namespace takt::recording {

namespace detail {

struct JsonValues {
  const Named& cell;

  template <typename Number>
  nlohmann::json value(const FieldInfo& field, const Number& number, const Named&) const {
    if constexpr (TabledEnumeration<Number>) {
      return to_string(number);
    } else if constexpr (std::is_integral_v<Number> && !std::is_same_v<Number, bool>) {
      if (has_annotation(field.annotations, "hexadecimal"))
        return hexadecimal_text(static_cast<std::uint64_t>(number));
      const std::string_view list = annotation(field.annotations, "index");
      if (list.empty() || cell.find(list) == nullptr) return number;
      const std::string* name = cell.name_of(list, static_cast<std::int64_t>(number));
      return name == nullptr ? nlohmann::json() : nlohmann::json(*name);
    } else {
      return number;  // a text too
    }
  }
  template <Message Type>
  nlohmann::json value(const FieldInfo&, const Type& message, const Named& of) const {
    auto object = nlohmann::json::object();
    for_each_field(message, [&](const FieldInfo& field, const auto& member) {
      object[std::string(field.name)] = value(field, member, of);
    });
    return object;
  }
  template <typename Element>
  nlohmann::json value(const FieldInfo& field, const std::vector<Element>& list, const Named& of) const {
    const std::string key(annotation(field.annotations, "key"));
    const auto* order = order_of(field, of);
    auto made = key.empty() && order == nullptr ? nlohmann::json::array() : nlohmann::json::object();
    for (std::size_t i = 0; i < list.size(); ++i) {
      const bool described = order != nullptr && i < order->size();
      nlohmann::json element = value({}, list[i], described ? (*order)[i] : of);
      if (made.is_array()) {
        made.push_back(std::move(element));
      } else if (order != nullptr) {
        if (described) made[(*order)[i].name] = std::move(element);
      } else {
        const std::string name = element[key];
        element.erase(key);
        made[name] = std::move(element);
      }
    }
    return made;
  }
};

}  // namespace detail

/// `cell`: named_lists() of the description.
template <Message Type>
nlohmann::json message_json(const Type& message, const Named& cell) {
  return detail::JsonValues{cell}.value({}, message, cell);
}

/// Calls the function for each number, text, truth value and null of a document, with its path: "robots.R.effort.a".
void for_each_leaf(const nlohmann::json& document,
                   const std::function<void(const std::string& name, const nlohmann::json& value)>& function,
                   const std::string& name = {});

}  // namespace takt::recording

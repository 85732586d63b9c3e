#include "idl/vocabulary/arguments.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <concepts>
#include <limits>
#include <nlohmann/json.hpp>

#include "idl/common/near_miss.h"
#include "idl/common/text.h"
#include "takt_pendant_table.h"
#include "takt_player_table.h"

namespace takt {
namespace {

using nlohmann::json;
using nlohmann::ordered_json;

constexpr double kMaxNormDeviation = 1e-3;
constexpr std::size_t kMaxFound = 100;  // characters of the value found, in a sentence
constexpr std::size_t kMaxList = 600;   // and of the names that there are

template <typename Type>
inline constexpr bool is_optional = false;
template <typename Type>
inline constexpr bool is_optional<std::optional<Type>> = true;
template <typename Type>
inline constexpr bool is_list = false;
template <typename Type>
inline constexpr bool is_list<std::vector<Type>> = true;

/// Vector3, Quaternion.
template <typename Type>
concept Quantity = Message<Type> && has_annotation(message_info<Type>().annotations, "quantity");

template <Quantity Type>
std::vector<double> numbers_of(const Type& quantity) {
  std::vector<double> numbers;
  for_each_field(quantity, [&](const FieldInfo&, double value) { numbers.push_back(value); });
  return numbers;
}
template <Quantity Type>
bool take_numbers(const std::vector<double>& numbers, Type& quantity) {
  if (numbers.size() != message_info<Type>().fields.size()) return false;
  std::size_t at = 0;
  for_each_field(quantity, [&](const FieldInfo&, double& value) { value = numbers[at++]; });
  return true;
}

std::vector<std::string_view> split(std::string_view text, std::string_view between) {
  std::vector<std::string_view> words;
  for (std::size_t at = 0; (at = text.find_first_not_of(between, at)) != std::string_view::npos;) {
    const std::size_t end = std::min(text.find_first_of(between, at), text.size());
    words.push_back(text.substr(at, end - at));
    at = end;
  }
  return words;
}

template <typename Number>
bool read_number(std::string_view text, Number& number) {
  const char* end = text.data() + text.size();
  const auto [last, error] = std::from_chars(text.data(), end, number);
  return error == std::errc() && last == end && !text.empty();
}

double number_annotation(const FieldInfo& field, const char* name, double otherwise) {
  double number = otherwise;
  read_number(annotation(field.annotations, name), number);
  return number;
}

bool is_real(FieldKind kind) {
  return kind == FieldKind::float32 || kind == FieldKind::float64;
}
bool is_whole(FieldKind kind) {
  return kind >= FieldKind::int8 && kind <= FieldKind::uint64;
}

/// @hexadecimal: 0x and 16 digits.
bool is_hexadecimal(const FieldInfo& field) {
  return has_annotation(field.annotations, "hexadecimal");
}

// --- JSON of documents

template <typename Type>
ordered_json json_of(const FieldInfo& field, const Type& value) {
  if constexpr (is_optional<Type>) {
    return value ? json_of(field, *value) : ordered_json();
  } else if constexpr (TabledEnumeration<Type>) {
    return is_known(value) ? ordered_json(to_string(value)) : ordered_json(static_cast<std::int64_t>(value));
  } else if constexpr (Quantity<Type>) {
    return numbers_of(value);
  } else if constexpr (Message<Type>) {
    ordered_json object = ordered_json::object();
    for_each_field(value, [&](const FieldInfo& of, const auto& member) {
      object[std::string(of.name)] = json_of(of, member);
    });
    return object;
  } else if constexpr (is_list<Type>) {
    ordered_json list = ordered_json::array();
    for (const auto& one : value) list.push_back(json_of(field, one));
    return list;
  } else {
    return value;
  }
}

/// Throws json::exception.
template <typename Type>
void read_json(const json& document, Type& value) {
  if constexpr (is_optional<Type>) {
    value.reset();
    if (!document.is_null()) read_json(document, value.emplace());
  } else if constexpr (TabledEnumeration<Type>) {
    const auto found = document.is_string() ? enumerator_of<Type>(document.get_ref<const std::string&>())
                                            : std::optional(static_cast<Type>(document.get<std::int64_t>()));
    if (found) value = *found;
  } else if constexpr (Quantity<Type>) {
    take_numbers(document.get<std::vector<double>>(), value);
  } else if constexpr (Message<Type>) {
    for_each_field(value, [&](const FieldInfo& of, auto& member) {
      read_json(document.at(std::string(of.name)), member);
    });
  } else if constexpr (is_list<Type>) {
    value.clear();
    for (const json& one : document) read_json(one, value.emplace_back());
  } else if constexpr (std::floating_point<Type>) {
    value = document.is_null() ? std::numeric_limits<Type>::quiet_NaN() : document.get<Type>();
  } else {
    value = document.get<Type>();
  }
}

// --- one value

template <typename Type>
Value value_of(const FieldInfo& field, const Type& from) {
  Value value;
  if constexpr (std::same_as<Type, bool>) {
    value.kind = ValueKind::boolean;
    value.flag = from;
  } else if constexpr (TabledEnumeration<Type>) {
    value.kind = is_known(from) ? ValueKind::text : ValueKind::integer;
    if (is_known(from)) value.text = to_string(from);
    value.integer = static_cast<std::int64_t>(from);
  } else if constexpr (std::integral<Type>) {
    constexpr auto kMost = std::numeric_limits<std::int64_t>::max();
    if (is_hexadecimal(field))
      return {.kind = ValueKind::text, .text = hexadecimal_text(static_cast<std::uint64_t>(from))};
    value.kind = ValueKind::integer;
    value.integer = std::in_range<std::int64_t>(from) ? static_cast<std::int64_t>(from) : kMost;
  } else if constexpr (std::floating_point<Type>) {
    value.kind = ValueKind::number;
    value.number = static_cast<double>(from);
  } else if constexpr (std::same_as<Type, std::string>) {
    value.kind = ValueKind::text;
    value.text = from;
  } else if constexpr (Quantity<Type>) {
    value.kind = ValueKind::numbers;
    value.numbers = numbers_of(from);
  } else if constexpr (std::same_as<Type, std::vector<std::string>>) {
    value.kind = ValueKind::texts;
    value.texts = from;
  } else if constexpr (is_list<Type> && !Message<typename Type::value_type>) {
    value.kind = ValueKind::numbers;
    value.numbers.assign(from.begin(), from.end());
  } else {
    value.kind = ValueKind::document;
    value.text = json_of(field, from).dump(-1, ' ', false, json::error_handler_t::replace);
  }
  return value;
}

bool read_hexadecimal(std::string_view text, std::uint64_t& number) {
  if (!text.starts_with("0x")) return false;
  const auto [last, error] = std::from_chars(text.data() + 2, text.data() + text.size(), number, 16);
  return error == std::errc() && last == text.data() + text.size();
}

/// Within @min and @max, and one of @one_of.
bool is_allowed(const FieldInfo& field, double number) {
  const std::string_view listed = annotation(field.annotations, "one_of");
  return number >= number_annotation(field, "min", -std::numeric_limits<double>::infinity()) &&
         number <= number_annotation(field, "max", std::numeric_limits<double>::infinity()) &&
         (listed.empty() || std::ranges::any_of(split(listed, ", "), [&](std::string_view one) {
            double allowed = 0.0;
            return read_number(one, allowed) && allowed == number;
          }));
}
bool is_allowed(const FieldInfo& field, const std::string& text) {
  return static_cast<double>(text.size()) >= number_annotation(field, "length", 0.0) &&
         (field.string_bound == 0 || text.size() <= field.string_bound);
}

/// False for a value that the field does not allow.
template <typename Type>
bool take(const FieldInfo& field, const Value& from, Type& value) {
  if constexpr (is_optional<Type>) {
    return take(field, from, value.emplace());
  } else if constexpr (std::same_as<Type, bool>) {
    value = from.flag;
    return from.kind == ValueKind::boolean;
  } else if constexpr (TabledEnumeration<Type>) {
    const EnumeratorInfo* found = nullptr;
    for (const EnumeratorInfo& one : kEnumeration<Type>.enumerators)
      if (from.kind == ValueKind::text ? one.name == from.text
                                       : from.kind == ValueKind::integer && one.value == from.integer)
        found = &one;
    const std::string_view listed = annotation(field.annotations, "one_of");
    if (found == nullptr || (!listed.empty() && std::ranges::count(split(listed, ", "), found->name) == 0))
      return false;
    value = static_cast<Type>(found->value);
    return true;
  } else if constexpr (std::integral<Type>) {
    if constexpr (std::same_as<Type, std::uint64_t>)
      if (is_hexadecimal(field)) return from.kind == ValueKind::text && read_hexadecimal(from.text, value);
    if (from.kind != ValueKind::integer || !std::in_range<Type>(from.integer) ||
        !is_allowed(field, static_cast<double>(from.integer)))
      return false;
    value = static_cast<Type>(from.integer);
    return true;
  } else if constexpr (std::floating_point<Type>) {
    if (from.kind != ValueKind::number && from.kind != ValueKind::integer) return false;
    value =
        static_cast<Type>(from.kind == ValueKind::number ? from.number : static_cast<double>(from.integer));
    return std::isfinite(value) && is_allowed(field, value);
  } else if constexpr (std::same_as<Type, std::string>) {
    value = from.text;
    return from.kind == ValueKind::text && is_allowed(field, value);
  } else if constexpr (Quantity<Type>) {
    if (from.kind != ValueKind::numbers || !take_numbers(from.numbers, value)) return false;
    double square = 0.0;
    for (const double number : from.numbers) {
      if (!std::isfinite(number) || !is_allowed(field, number)) return false;
      square += number * number;
    }
    return from.numbers.size() != 4 || std::abs(std::sqrt(square) - 1.0) <= kMaxNormDeviation;
  } else if constexpr (std::same_as<Type, std::vector<std::string>>) {
    value = from.texts;
    return from.kind == ValueKind::texts && (field.bound == 0 || value.size() <= field.bound) &&
           std::ranges::all_of(value, [&](const std::string& text) { return is_allowed(field, text); });
  } else if constexpr (is_list<Type> && !Message<typename Type::value_type>) {
    using Number = typename Type::value_type;
    value.clear();
    for (const double number : from.numbers) {
      if (!(std::abs(number) <= static_cast<double>(std::numeric_limits<Number>::max()))) return false;
      value.push_back(static_cast<Number>(number));
    }
    return from.kind == ValueKind::numbers;
  } else {
    if (from.kind != ValueKind::document) return false;
    try {
      read_json(json::parse(from.text), value);
      return true;
    } catch (const json::exception&) {
      return false;
    }
  }
}

/// The names in a value.
std::vector<std::string> names_in(const Value& value) {
  return value.kind == ValueKind::texts ? value.texts : std::vector{value.text};
}

std::optional<ArgumentFault> unknown_name(const FieldInfo& field, const Value& value,
                                          const KnownNames& known) {
  const std::string_view kind = annotation(field.annotations, "names");
  if (kind.empty() || !known) return std::nullopt;
  const std::vector<std::string> names = known(kind);
  for (const std::string& name : names_in(value)) {
    // A default stands for all of them.
    if (name == annotation(field.annotations, "default") || std::ranges::find(names, name) != names.end())
      continue;
    std::string list;
    for (const std::string& one : names) {
      if (list.size() + one.size() > kMaxList) {
        list += ", ...";
        break;
      }
      list += (list.empty() ? "" : ", ") + one;
    }
    return ArgumentFault{ControlResult::not_found, "There is no " + std::string(kind) + " '" +
                                                       name.substr(0, kMaxFound) + "' in this cell; it has " +
                                                       (list.empty() ? "none" : list) + "." +
                                                       did_you_mean(name, names)};
  }
  return std::nullopt;
}

std::string in_quotes(std::string_view text) {
  return "'" + std::string(text.substr(0, kMaxFound)) + "'";
}

std::vector<std::string_view> names_of(std::span<const FieldInfo> fields) {
  std::vector<std::string_view> names;
  for (const FieldInfo& field : fields) names.push_back(field.name);
  return names;
}

/// An unknown or repeated argument.
std::optional<std::string> strange_argument(const Arguments& arguments, std::span<const FieldInfo> fields) {
  const auto names = names_of(fields);
  for (auto one = arguments.begin(); one != arguments.end(); ++one) {
    if (std::ranges::find(names, one->name) == names.end())
      return " has no argument " + in_quotes(one->name) + "; it takes " +
             (names.empty() ? "none" : join(names, ", ")) + "." + did_you_mean(one->name, names);
    if (std::any_of(arguments.begin(), one, [&](const auto& other) { return other.name == one->name; }))
      return " has the argument " + in_quotes(one->name) + " twice.";
  }
  return std::nullopt;
}

}  // namespace

template <typename Message>
Arguments arguments_of(const Message& message) {
  Arguments arguments;
  for_each_field(message, [&](const FieldInfo& field, const auto& value) {
    if constexpr (is_optional<std::remove_cvref_t<decltype(value)>>) {
      if (value) arguments.push_back({std::string(field.name), value_of(field, *value)});
    } else {
      arguments.push_back({std::string(field.name), value_of(field, value)});
    }
  });
  return arguments;
}

template <typename Message>
std::optional<ArgumentFault> read_arguments(std::string_view name, const Arguments& arguments,
                                            Message& message, const KnownNames& known) {
  const auto fault = [&](const std::string& what) {
    return ArgumentFault{ControlResult::failed,
                         (Request<Message> ? "" : "The reply to ") + in_quotes(name) + what};
  };
  if constexpr (Request<Message>)
    if (const auto what = strange_argument(arguments, message_info<Message>().fields)) return fault(*what);
  std::optional<ArgumentFault> found;
  for_each_field(message, [&](const FieldInfo& field, auto& value) {
    if (found) return;
    const auto given =
        std::ranges::find(arguments, field.name, [](const auto& one) { return std::string_view(one.name); });
    if (given == arguments.end()) {
      if (Request<Message> && !has_annotation(field.annotations, "optional") &&
          !has_annotation(field.annotations, "default"))
        found = fault(" needs the argument " + in_quotes(field.name) + ", " + allowed_of(field) +
                      (field.doc.empty() ? "." : ": " + std::string(field.doc) + "."));
    } else if (!take(field, given->value, value)) {
      found = ArgumentFault{ControlResult::failed,
                            (Request<Message> ? "Argument " : "The reply to " + in_quotes(name) + ": ") +
                                in_quotes(field.name) + " is " + in_quotes(text_of(given->value)) +
                                "; allowed is " + allowed_of(field) + "."};
    } else {
      found = unknown_name(field, given->value, known);
    }
  });
  return found;
}

#define TAKT_INSTANTIATE(Message)                                                                    \
  template Arguments arguments_of(const Message&);                                                   \
  template std::optional<ArgumentFault> read_arguments(std::string_view, const Arguments&, Message&, \
                                                       const KnownNames&);
#define TAKT_INSTANTIATE_OF_SERVER(Name) \
  TAKT_INSTANTIATE(requests::Name) TAKT_INSTANTIATE(requests::Name##Response)
#define TAKT_INSTANTIATE_OF_PLAYER(Name) \
  TAKT_INSTANTIATE(player::Name) TAKT_INSTANTIATE(player::Name##Response)
#define TAKT_INSTANTIATE_OF_PENDANT(Name) \
  TAKT_INSTANTIATE(pendant::Name) TAKT_INSTANTIATE(pendant::Name##Response)
TAKT_FOR_EACH_REQUEST(TAKT_INSTANTIATE_OF_SERVER)
TAKT_FOR_EACH_PLAYER_REQUEST(TAKT_INSTANTIATE_OF_PLAYER)
TAKT_FOR_EACH_PENDANT_REQUEST(TAKT_INSTANTIATE_OF_PENDANT)
#undef TAKT_INSTANTIATE_OF_PENDANT
#undef TAKT_INSTANTIATE_OF_PLAYER
#undef TAKT_INSTANTIATE_OF_SERVER
#undef TAKT_INSTANTIATE

const RequestInfo* find_request(std::string_view name) {
  const auto found = std::ranges::find(requests::kAll, name, [](const auto* one) { return one->name; });
  return found == std::end(requests::kAll) ? nullptr : *found;
}

std::string unknown_request(std::string_view name) {
  std::vector<std::string_view> names;
  for (const RequestInfo* one : requests::kAll) names.push_back(one->name);
  return "This server has no request " + in_quotes(name) + "; it has " + join(names, ", ") + "." +
         did_you_mean(name, names);
}

std::optional<ArgumentFault> read_request(std::string_view name, const Arguments& arguments,
                                          requests::Any& request, const KnownNames& known) {
  std::optional<ArgumentFault> fault;
  const auto read_as = [&]<typename Type>(Type made) {
    if (request_info<Type>().name != name) return false;
    fault = read_arguments(name, arguments, made, known);
    request = std::move(made);
    return true;
  };
#define TAKT_READ_AS(Name) || read_as(requests::Name{})
  const bool is_known = false TAKT_FOR_EACH_REQUEST(TAKT_READ_AS);
#undef TAKT_READ_AS
  if (!is_known) fault = ArgumentFault{ControlResult::unsupported, unknown_request(name)};
  return fault;
}

std::string text_of(const Value& value) {
  switch (value.kind) {
    case ValueKind::boolean:
      return value.flag ? "true" : "false";
    case ValueKind::integer:
      return std::to_string(value.integer);
    case ValueKind::number:
      return exact_text(value.number);
    case ValueKind::text:
    case ValueKind::document:
      return value.text;
    case ValueKind::numbers:
      return join(value.numbers, " ", exact_text);
    case ValueKind::texts:
      return join(value.texts, ", ");
  }
  return "of an unknown kind";
}

std::string allowed_of(const FieldInfo& field) {
  const std::string_view listed = annotation(field.annotations, "one_of");
  if (!listed.empty() || field.enumeration != nullptr) {
    std::vector<std::string_view> names = split(listed, ", ");
    if (names.empty())
      for (const EnumeratorInfo& one : field.enumeration->enumerators) names.push_back(one.name);
    const std::string_view last = names.back();
    names.pop_back();
    return join(names, ", ") + (names.empty() ? "" : " or ") + std::string(last);
  }
  const std::string low(annotation(field.annotations, "min")), high(annotation(field.annotations, "max"));
  const std::string range = low.empty() ? "" : " from " + low + " to " + high;
  const std::string unit = field.unit.empty() || field.unit == "1" ? "" : " " + std::string(field.unit);
  if (field.kind == FieldKind::message) {
    if (field.message->fields.size() == 4) return "a quaternion x y z w of length 1, within 0.001";
    return std::to_string(field.message->fields.size()) + " finite numbers" + range + unit;
  }
  if (field.sequence) return field.kind == FieldKind::string ? "a list of texts" : "a list of numbers";
  if (field.kind == FieldKind::boolean) return "true or false";
  if (is_real(field.kind)) return (range.empty() ? "a finite number" : "a number" + range) + unit;
  if (is_whole(field.kind)) return "a whole number" + range;
  const std::string least(annotation(field.annotations, "length"));
  const std::string most = field.string_bound == 0 ? "" : " at most " + std::to_string(field.string_bound);
  return "a text" + (least.empty() ? "" : " of at least " + least + " character") +
         (most.empty() ? "" : (least.empty() ? " of" : " and") + most + " bytes");
}

namespace {

/// Commas outside of brackets separate.
std::vector<std::string> split_texts(std::string_view text) {
  std::vector<std::string> texts;
  std::string one;
  int depth = 0;
  const auto end = [&] {
    const std::size_t first = one.find_first_not_of(' ');
    if (first != std::string::npos) texts.push_back(one.substr(first, one.find_last_not_of(' ') - first + 1));
    one.clear();
  };
  for (const char c : text) {
    depth += c == '[' || c == '{' ? 1 : c == ']' || c == '}' ? -1 : 0;
    if (c == '\n' || (c == ',' && depth == 0))
      end();
    else
      one += c;
  }
  end();
  return texts;
}

Value value_of_text(const FieldInfo& field, const std::string& text) {
  Value value;
  value.kind = ValueKind::text;
  value.text = text;
  if (field.sequence || field.kind == FieldKind::message) {
    if (field.kind == FieldKind::string) {
      value = {.kind = ValueKind::texts, .texts = split_texts(text)};
      return value;
    }
    std::vector<double> numbers;
    for (const std::string_view word : split(text, ", "))
      if (!read_number(word, numbers.emplace_back())) return value;
    return {.kind = ValueKind::numbers, .numbers = numbers};
  }
  if (field.kind == FieldKind::boolean && (text == "true" || text == "false"))
    return {.kind = ValueKind::boolean, .flag = text == "true"};
  const bool number = is_real(field.kind) || is_whole(field.kind);
  if (std::int64_t integer = 0; number && read_number(text, integer))
    return {.kind = ValueKind::integer, .integer = integer};
  if (double real = 0.0; is_real(field.kind) && read_number(text, real))
    return {.kind = ValueKind::number, .number = real};
  return value;
}

}  // namespace

Arguments arguments_of_text(std::string_view request,
                            const std::vector<std::pair<std::string, std::string>>& texts) {
  const RequestInfo* info = find_request(request);
  Arguments arguments;
  for (const auto& [name, text] : texts) {
    FieldInfo plain{};
    plain.kind = FieldKind::string;
    const FieldInfo* field = &plain;
    if (info != nullptr)
      for (const FieldInfo& one : info->request->fields)
        if (one.name == name) field = &one;
    arguments.push_back({name, value_of_text(*field, text)});
  }
  return arguments;
}

}  // namespace takt

#include "client_lib/recording/sample.h"

#include <optional>
#include <type_traits>

#include "client_lib/recording/message_json.h"
#include "idl/common/cdr.h"
#include "takt_msgs.h"

namespace takt::recording {
namespace {

constexpr int kDeepest = 64;
/// A value takes a byte at least. The rest is for messages that hold one another and few values.
constexpr std::size_t kValuesPerByte = 8, kFurtherValues = 1000;

/// The types one is inside of: a schema of a damaged or foreign file may hold itself, without end.
struct Inside {
  const MessageType* type;
  const Inside* outer;
  int depth;
};

/// One sample. A schema of a few hundred bytes may describe 2^60 messages that take no byte.
struct Reading {
  const MessageTypes& types;
  cdr::Reader reader;
  std::size_t values_left;

  void count_value() {
    if (values_left-- == 0) throw RecordingError("A sample has more values than its bytes can hold.");
  }
};

Json read_struct(Reading& sample, const MessageType& type, const Inside* outer);

Json read_single(Reading& sample, const Field& field, const Inside& inside) {
  cdr::Reader& reader = sample.reader;
  sample.count_value();
  switch (field.kind) {
    case Kind::boolean:
      return reader.number<std::uint8_t>() != 0;
    case Kind::int8:
      return reader.number<std::int8_t>();
    case Kind::uint8:
      return reader.number<std::uint8_t>();
    case Kind::int16:
      return reader.number<std::int16_t>();
    case Kind::uint16:
      return reader.number<std::uint16_t>();
    case Kind::int32:
      return reader.number<std::int32_t>();
    case Kind::uint32:
      return reader.number<std::uint32_t>();
    case Kind::int64:
      return reader.number<std::int64_t>();
    case Kind::uint64:
      return reader.number<std::uint64_t>();
    case Kind::float32:
      return reader.number<float>();
    case Kind::float64:
      return reader.number<double>();
    case Kind::string:
      return std::string(reader.text());
    case Kind::message:
      return read_struct(sample, sample.types.at(field.message), &inside);
  }
  return {};
}

Json read_field(Reading& sample, const Field& field, const Inside& inside) {
  if (!field.sequence && field.count == 0) return read_single(sample, field, inside);
  const std::size_t count = field.sequence ? sample.reader.number<std::uint32_t>() : field.count;
  if (count > sample.reader.left()) throw RecordingError("A sample ends before its last member.");
  Json list = Json::array();
  for (std::size_t i = 0; i < count; ++i) list.push_back(read_single(sample, field, inside));
  return list;
}

Json read_struct(Reading& sample, const MessageType& type, const Inside* outer) {
  for (const Inside* at = outer; at != nullptr; at = at->outer)
    if (at->type == &type) throw RecordingError("The message type '" + type.name + "' holds itself.");
  const Inside inside{&type, outer, outer == nullptr ? 1 : outer->depth + 1};
  if (inside.depth > kDeepest)
    throw RecordingError("The message type '" + type.name + "' is nested deeper than " +
                         std::to_string(kDeepest) + " types.");
  Json object = Json::object();
  for (const Field& field : type.fields) {
    object[field.name] = read_field(sample, field, inside);
    if (!sample.reader.ok()) throw RecordingError("A sample ends before its last member.");
  }
  return object;
}

}  // namespace

Json to_json(const MessageTypes& types, const std::string& type, std::string_view sample) {
  Reading reading{types, cdr::Reader(sample), sample.size() * kValuesPerByte + kFurtherValues};
  if (!reading.reader.ok() && sample.size() >= cdr::kEncapsulation_bytes)
    throw RecordingError("A sample has an encoding other than plain CDR.");
  return read_struct(reading, types.at(type), nullptr);
}

namespace {

template <Message Type>
std::optional<Json> named_json(std::string_view sample, Named& names) {
  Type message;
  if (!cdr::read({reinterpret_cast<const std::uint8_t*>(sample.data()), sample.size()}, message))
    return std::nullopt;
  if constexpr (std::is_same_v<Type, takt_msgs::msg::CellDescription>) names = named_lists(message);
  return message_json(message, fits(message, names, names) ? names : Named{});
}

/// Nothing for a type that is not of the list.
template <typename... Types>
std::optional<Json> named_json(MessageList<Types...>, const std::string& type, std::string_view sample,
                               Named& names) {
  std::optional<Json> json;
  static_cast<void>(
      ((type == message_info<Types>().name && (json = named_json<Types>(sample, names), true)) || ...));
  return json;
}

}  // namespace

Json JsonSamples::read(const std::string& type, std::string_view sample) {
  const auto [ours, is_new] = is_ours_.try_emplace(type, false);
  if (is_new)
    ours->second = known_types().find(type) != nullptr && known_types().ros2msg(type) == types_.ros2msg(type);
  if (ours->second)
    if (auto json = named_json(TaktMsgs{}, type, sample, names_)) return *std::move(json);
  return to_json(types_, type, sample);
}

/// Where in a sample one is.
struct SignalNames::Place {
  const Json* holder = nullptr;  ///< the object that has the list
  std::string list;              ///< its member, where the value is a list
  const Json* named = nullptr;   ///< what the description says of the holder
};

void SignalNames::describe(const Json& description) {
  description_ = description;
  for (auto& component : description_["components"]) {
    component.erase("vertices");
    component.erase("triangles");
  }
}

std::string SignalNames::element_name(const Json& element, std::size_t index, const Place& place) const {
  const auto member = [](const Json* object, const char* key) -> const Json* {
    if (object == nullptr || !object->is_object()) return nullptr;
    const auto found = object->find(key);
    return found == object->end() ? nullptr : &*found;
  };
  const auto listed = [&](const Json* object, const char* key, std::size_t i) -> const Json* {
    const Json* list = member(object, key);
    return list != nullptr && list->is_array() && i < list->size() ? &(*list)[i] : nullptr;
  };
  const auto text = [](const Json* value) { return value != nullptr && value->is_string(); };
  const auto component = [&](const char* key) -> const Json* {
    const Json* number = member(&element, key);
    if (number == nullptr || !number->is_number_integer() || number->get<int>() < 0) return nullptr;
    return member(listed(&description_, "components", number->get<std::size_t>()), "name");
  };
  if (element.is_object()) {
    for (const char* key : {"name", "target", "child_frame_id"})
      if (const Json* name = member(&element, key); text(name)) return *name;
    const Json *base = component("base"), *target = component("target");
    if (text(base) && text(target)) return base->get<std::string>() + "-" + target->get<std::string>();
    if (const Json* name = member(listed(&description_, place.list.c_str(), index), "name"); text(name))
      return *name;
  } else {
    // Joint states name their numbers beside them; the joints of a robot's state are in the description.
    if (const Json* name = listed(place.holder, "name", index); text(name)) return *name;
    for (const char* list : {"joints", "signals"})
      if (const Json* name = member(listed(place.named, list, index), "name"); text(name)) return *name;
  }
  return std::to_string(index);
}

namespace {
/// Lists of thousands of numbers that belong to a picture (ContactPressure), not signals.
bool is_picture(const std::string& member) {
  return member == "corners" || member == "pressures";
}
}  // namespace

void SignalNames::walk(const Json& value, const std::string& name, const Place& place, const Number& number,
                       const Text& text) const {
  const auto below = [&](const std::string& last) { return name.empty() ? last : name + "." + last; };
  if (value.is_object()) {
    for (const auto& [key, member] : value.items()) {
      if (is_picture(key)) continue;
      walk(member, below(key), {&value, key, place.named}, number, text);
    }
  } else if (value.is_array()) {
    const auto described = description_.find(place.list);
    for (std::size_t i = 0; i < value.size(); ++i) {
      Place next = place;
      if (value[i].is_object() && described != description_.end() && described->is_array() &&
          i < described->size())
        next.named = &(*described)[i];
      walk(value[i], below(element_name(value[i], i, place)), next, number, text);
    }
  } else if (value.is_boolean()) {
    number(name, value.get<bool>() ? 1.0 : 0.0);
  } else if (value.is_number()) {
    number(name, value.get<double>());
  } else if (value.is_string() && text) {
    text(name, value.get<std::string>());
  }
}

void SignalNames::visit(const Json& sample, const Number& number, const Text& text) const {
  walk(sample, "", {}, number, text);
}

}  // namespace takt::recording

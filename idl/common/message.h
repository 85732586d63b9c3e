#pragma once
// Messages as data. From each struct of idl/*.idl the generator makes a plain C++ struct
// (takt_msgs::msg::CellState) and a table of its fields. An operation on every field (encoding, text, signal
// names, documentation) is written once:
//
//   for_each_field(state, [](const FieldInfo& field, const auto& value) { ... });
//
// visits name, unit, frame and meaning of each field together with its value, in the order of the wire; a
// value is a number, bool, enumeration, std::string, another message (see `Message`), or a std::vector of one
// of these. message_info<CellState>() is the same table without values.
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>
#include <type_traits>
#include <utility>

#include "idl/common/enumeration.h"

namespace takt {

enum class FieldKind : std::uint8_t {
  boolean,
  int8,
  uint8,
  int16,
  uint16,
  int32,
  uint32,
  int64,
  uint64,
  float32,
  float64,
  string,
  message,
};

/// One argument of an annotation of the IDL: @name(key=text). The key of a lone argument is "value".
struct AnnotationInfo {
  std::string_view name, key, text;
};

/// The text of the first such argument, or an empty one.
constexpr std::string_view annotation(std::span<const AnnotationInfo> of, std::string_view name,
                                      std::string_view key = "value") {
  for (const AnnotationInfo& one : of)
    if (one.name == name && one.key == key) return one.text;
  return {};
}

constexpr bool has_annotation(std::span<const AnnotationInfo> of, std::string_view name) {
  for (const AnnotationInfo& one : of)
    if (one.name == name) return true;
  return false;
}

struct MessageInfo;

struct FieldInfo {
  std::string_view name;
  std::string_view unit;   ///< "m", "rad | m", "1" for a pure number; empty: no quantity
  std::string_view frame;  ///< "W" the world, "B" the component's; empty: without frame
  std::string_view doc;    ///< one line
  FieldKind kind;          ///< of the field, or of each element of a sequence
  bool sequence;
  std::uint32_t bound;                          ///< most elements of the sequence, 0: any number
  std::uint32_t string_bound;                   ///< most bytes of a string, 0: any number
  const MessageInfo* message;                   ///< of FieldKind::message
  const EnumerationInfo* enumeration;           ///< names of the numbers, or nullptr
  std::span<const AnnotationInfo> annotations;  ///< all other annotations of the IDL
};

struct MessageInfo {
  std::string_view name;      ///< takt_msgs/msg/CellState
  std::string_view dds_type;  ///< takt_msgs::msg::dds_::CellState_
  std::string_view doc;
  std::span<const FieldInfo> fields;
  std::span<const AnnotationInfo> annotations;
};

/// Generated for each struct of the IDL.
template <typename Message>
struct MessageTable;

template <typename Type>
concept Message = requires {
  MessageTable<std::remove_const_t<Type>>::info;
};

template <Message Type>
constexpr const MessageInfo& message_info() {
  return MessageTable<std::remove_const_t<Type>>::info;
}

/// The field of this name; a name that the message does not have does not compile.
template <Message Type>
consteval const FieldInfo& field_info(std::string_view name) {
  for (const FieldInfo& field : message_info<Type>().fields)
    if (field.name == name) return field;
  throw "the message has no such field";
}

/// `visitor(const FieldInfo&, value&)` for each field, in the order of the IDL.
template <Message Type, typename Visitor>
constexpr void for_each_field(Type& message, Visitor&& visitor) {
  MessageTable<std::remove_const_t<Type>>::visit(message, std::forward<Visitor>(visitor));
}

/// A list of messages as one type.
template <typename... Messages>
struct MessageList {
  static constexpr const MessageInfo* infos[] = {&MessageTable<Messages>::info...};
};

}  // namespace takt

#include "client_lib/recording/message_types.h"

#include <algorithm>
#include <cctype>
#include <optional>
#include <set>

#include "idl/common/text.h"
#include "ros2_action_msgs.h"
#include "ros2_msgs.h"
#include "takt_msgs.h"

namespace takt::recording {
namespace {

/// Names of ros2msg, in the order of FieldKind.
constexpr std::string_view kRosNames[] = {"bool",   "int8",  "uint8",  "int16",   "uint16",  "int32",
                                          "uint32", "int64", "uint64", "float32", "float64", "string"};

/// takt_msgs/Vector3 of takt_msgs/msg/Vector3, as it stands in fields and after MSG.
std::string short_name(const std::string& name) {
  const std::size_t place = name.find("/msg/");
  return place == std::string::npos ? name : name.substr(0, place) + name.substr(place + 4);
}

std::string long_name(const std::string& name, const std::string& package) {
  const std::size_t slash = name.find('/');
  if (slash == std::string::npos) return package + "/msg/" + name;
  return name.find('/', slash + 1) == std::string::npos
             ? name.substr(0, slash) + "/msg/" + name.substr(slash + 1)
             : name;
}

std::string ros_line(const Field& field) {
  std::string line = field.kind == Kind::message
                         ? short_name(field.message)
                         : std::string(kRosNames[static_cast<std::size_t>(field.kind)]);
  if (field.string_bound > 0) line += "<=" + std::to_string(field.string_bound);
  if (field.sequence)
    line += field.count > 0 ? "[<=" + std::to_string(field.count) + "]" : "[]";
  else if (field.count > 0)
    line += "[" + std::to_string(field.count) + "]";
  return line + " " + field.name + "\n";
}

/// A field of `ros2msg` text; nothing for a line that declares none.
std::optional<Field> field_of_line(std::string line, const std::string& package) {
  line = line.substr(0, line.find('#'));
  const auto trim = [](std::string& text) {
    const auto blank = [](char c) { return c == ' ' || c == '\t' || c == '\r'; };
    while (!text.empty() && blank(text.back())) text.pop_back();
    while (!text.empty() && blank(text.front())) text.erase(0, 1);
  };
  trim(line);
  const std::size_t space = line.find_first_of(" \t");
  if (space == std::string::npos) return std::nullopt;
  std::string type = line.substr(0, space), name = line.substr(space + 1);
  trim(name);
  const std::size_t name_end = name.find_first_of(" \t=");
  if (name.find('=') != std::string::npos && name.find_first_not_of(" \t", name_end) == name.find('='))
    return std::nullopt;  // a constant
  Field field;
  field.name = name.substr(0, name_end);
  if (!type.empty() && type.back() == ']') {
    const std::size_t open = type.rfind('[');
    const std::string inside = type.substr(open + 1, type.size() - open - 2);
    field.sequence = inside.empty() || inside.starts_with("<=");
    const std::string digits = inside.starts_with("<=") ? inside.substr(2) : inside;
    if (!digits.empty()) field.count = std::stoul(digits);
    type.erase(open);
  }
  if (const std::size_t bound = type.find("<="); bound != std::string::npos) {
    field.string_bound = std::stoul(type.substr(bound + 2));
    type.erase(bound);
  }
  if (type == "byte" || type == "char") type = "uint8";
  const auto primitive = std::find(std::begin(kRosNames), std::end(kRosNames), type);
  field.kind = static_cast<Kind>(primitive - std::begin(kRosNames));
  if (field.kind == Kind::message) field.message = long_name(type, package);
  return field;
}

}  // namespace

void MessageTypes::add(const MessageInfo& message) {
  MessageType type{std::string(message.name), {}};
  for (const FieldInfo& field : message.fields) {
    if (!type.fields.empty() && type.fields.back().name == field.name) {  // a further element of an array
      std::size_t& count = type.fields.back().count;
      count = std::max<std::size_t>(count, 1) + 1;
      continue;
    }
    if (field.message != nullptr) add(*field.message);
    type.fields.push_back({std::string(field.name), field.kind,
                           std::string(field.message == nullptr ? "" : field.message->name),
                           field.string_bound, field.sequence, field.bound});
  }
  types_.insert_or_assign(type.name, std::move(type));
}

void MessageTypes::add_ros2msg(const std::string& name, std::string_view text) {
  MessageType type{name, {}};
  const auto finish = [&] { types_.insert_or_assign(type.name, type); };
  const auto package = [&] { return type.name.substr(0, type.name.find('/')); };
  try {
    while (!text.empty()) {
      const std::size_t end = text.find('\n');
      const std::string line(text.substr(0, end));
      text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
      if (line.starts_with("===")) continue;
      if (line.starts_with("MSG: ")) {
        finish();
        std::string next = line.substr(5);
        while (!next.empty() && std::isspace(static_cast<unsigned char>(next.back())) != 0) next.pop_back();
        type = {long_name(next, package()), {}};
      } else if (auto field = field_of_line(line, package())) {
        type.fields.push_back(*std::move(field));
      }
    }
  } catch (const std::logic_error&) {  // of stoul
    throw RecordingError("The schema of '" + name + "' is not readable as ros2msg.");
  }
  finish();
}

const MessageType* MessageTypes::find(const std::string& name) const {
  const auto found = types_.find(name);
  return found == types_.end() ? nullptr : &found->second;
}

const MessageType& MessageTypes::at(const std::string& name) const {
  if (const MessageType* type = find(name)) return *type;
  throw RecordingError("The message type '" + name + "' is not described.");
}

std::string MessageTypes::ros2msg(const std::string& name) const {
  std::string text;
  std::vector<std::string> pending{name};
  std::set<std::string> done{name};
  for (std::size_t i = 0; i < pending.size(); ++i) {
    const std::string current = pending[i];
    if (i > 0) text += std::string(80, '=') + "\nMSG: " + short_name(current) + "\n";
    for (const Field& field : at(current).fields) {
      text += ros_line(field);
      if (field.kind == Kind::message && done.insert(field.message).second) pending.push_back(field.message);
    }
  }
  return text;
}

const MessageTypes& known_types() {
  static const MessageTypes types = [] {
    MessageTypes all;
    for (const MessageInfo* message : TaktMsgs::infos) all.add(*message);
    for (const MessageInfo* message : Ros2Msgs::infos) all.add(*message);
    all.add(message_info<action_msgs::msg::GoalStatusArray>());
    return all;
  }();
  return types;
}

std::string message_name(std::string_view dds_type) {
  constexpr std::string_view middle = "::msg::dds_::";
  const std::size_t place = dds_type.find(middle);
  if (place == std::string_view::npos || !dds_type.ends_with('_')) return {};
  std::string name(dds_type.substr(place + middle.size()));
  name.pop_back();
  return std::string(dds_type.substr(0, place)) + "/msg/" + name;
}

std::string dds_type_name(std::string_view message) {
  constexpr std::string_view middle = "/msg/";
  const std::size_t place = message.find(middle);
  if (place == std::string_view::npos) return {};
  return std::string(message.substr(0, place)) +
         "::msg::dds_::" + std::string(message.substr(place + middle.size())) + "_";
}

}  // namespace takt::recording

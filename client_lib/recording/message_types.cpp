#include "client_lib/recording/message_types.h"

#include <algorithm>
#include <cctype>
#include <optional>
#include <set>

#include "client_lib/recording/idl_texts.h"
#include "idl/common/text.h"

namespace takt::recording {
namespace {

struct Primitive {
  Kind kind;
  std::string_view idl, ros;
};
constexpr Primitive kPrimitives[] = {
    {Kind::boolean, "boolean", "bool"},
    {Kind::int8, "int8", "int8"},
    {Kind::uint8, "octet", "uint8"},
    {Kind::int16, "short", "int16"},
    {Kind::uint16, "unsigned short", "uint16"},
    {Kind::int32, "long", "int32"},
    {Kind::uint32, "unsigned long", "uint32"},
    {Kind::int64, "long long", "int64"},
    {Kind::uint64, "unsigned long long", "uint64"},
    {Kind::float32, "float", "float32"},
    {Kind::float64, "double", "float64"},
    {Kind::string, "string", "string"},
};

std::string_view ros_name(Kind kind) {
  for (const Primitive& p : kPrimitives)
    if (p.kind == kind) return p.ros;
  return {};
}

/// Words and marks of an IDL text, without comments.
class IdlTokens {
 public:
  explicit IdlTokens(std::string_view text) : text_(text) { next(); }

  const std::string& now() const { return token_; }
  bool end() const { return token_.empty(); }
  std::string take() {
    std::string token = std::move(token_);
    next();
    return token;
  }
  void expect(std::string_view wanted) {
    if (token_ != wanted) fail("'" + std::string(wanted) + "'");
    next();
  }
  bool accept(std::string_view wanted) {
    if (token_ != wanted) return false;
    next();
    return true;
  }
  [[noreturn]] void fail(const std::string& wanted) const {
    throw RecordingError("IDL, line " + std::to_string(line_) + ": found '" + token_ + "', expected " +
                         wanted + ".");
  }

 private:
  static bool of_word(char c) { return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_'; }
  void next() {
    while (place_ < text_.size()) {
      const char c = text_[place_];
      if (c == '\n') ++line_;
      if (c == '#' || text_.substr(place_, 2) == "//")
        place_ = std::min(text_.find('\n', place_), text_.size());
      else if (std::isspace(static_cast<unsigned char>(c)) != 0)
        ++place_;
      else
        break;
    }
    const std::size_t begin = place_;
    if (place_ < text_.size()) {
      if (of_word(text_[place_]))
        while (place_ < text_.size() && of_word(text_[place_])) ++place_;
      else
        place_ += text_.substr(place_, 2) == "::" ? 2 : 1;
    }
    token_ = text_.substr(begin, place_ - begin);
  }

  std::string_view text_;
  std::size_t place_ = 0;
  int line_ = 1;
  std::string token_;
};

std::size_t number(IdlTokens& tokens) {
  const std::string token = tokens.now();
  if (token.empty() || !std::all_of(token.begin(), token.end(), [](char c) { return c >= '0' && c <= '9'; }))
    tokens.fail("a number");
  return std::stoul(tokens.take());
}

/// pkg::msg::Name, or a Name of the present module, as pkg/msg/Name. The generator's escape for names that
/// are words of the language is a leading underscore.
std::string scoped_name(IdlTokens& tokens, const std::vector<std::string>& modules) {
  std::vector<std::string> parts{tokens.take()};
  while (tokens.accept("::")) parts.push_back(tokens.take());
  if (parts.size() == 1) parts.insert(parts.begin(), modules.begin(), modules.end());
  if (parts.back().starts_with("_")) parts.back().erase(0, 1);
  return join(parts, "/");
}

/// A type that is no sequence.
void single_type(IdlTokens& tokens, const std::vector<std::string>& modules, Field& field) {
  std::string words = tokens.now();
  if (words == "unsigned" || words == "long") {
    tokens.take();
    if (words == "unsigned") words += " " + tokens.take();
    if (tokens.now() == "long") words += " " + tokens.take();
  } else if (std::none_of(std::begin(kPrimitives), std::end(kPrimitives),
                          [&](const Primitive& p) { return p.idl == words; })) {
    field.kind = Kind::message;
    field.message = scoped_name(tokens, modules);
    return;
  } else {
    tokens.take();
  }
  for (const Primitive& p : kPrimitives)
    if (p.idl == words) field.kind = p.kind;
  if (field.kind == Kind::string && tokens.accept("<")) {
    field.string_bound = number(tokens);
    tokens.expect(">");
  }
}

Field field_of(IdlTokens& tokens, const std::vector<std::string>& modules) {
  Field field;
  if (tokens.accept("sequence")) {
    field.sequence = true;
    tokens.expect("<");
    single_type(tokens, modules, field);
    if (tokens.accept(",")) field.count = number(tokens);
    tokens.expect(">");
  } else {
    single_type(tokens, modules, field);
  }
  field.name = tokens.take();
  if (field.name.starts_with("_")) field.name.erase(0, 1);
  if (tokens.accept("[")) {
    field.count = number(tokens);
    tokens.expect("]");
  }
  tokens.expect(";");
  return field;
}

MessageType struct_of(IdlTokens& tokens, const std::vector<std::string>& modules) {
  MessageType type;
  type.name = scoped_name(tokens, modules);
  tokens.expect("{");
  while (!tokens.accept("}")) type.fields.push_back(field_of(tokens, modules));
  tokens.expect(";");
  return type;
}

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
  std::string line =
      field.kind == Kind::message ? short_name(field.message) : std::string(ros_name(field.kind));
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
  for (const Primitive& p : kPrimitives)
    if (p.ros == type) field.kind = p.kind;
  if (field.kind == Kind::message) field.message = long_name(type, package);
  return field;
}

}  // namespace

void MessageTypes::add_idl(std::string_view text) {
  IdlTokens tokens(text);
  std::vector<std::string> modules;
  while (!tokens.end()) {
    if (tokens.accept("module")) {
      modules.push_back(tokens.take());
      tokens.expect("{");
    } else if (tokens.accept("@")) {
      tokens.take();
    } else if (tokens.accept("struct")) {
      MessageType type = struct_of(tokens, modules);
      types_.insert_or_assign(type.name, std::move(type));
    } else if (!modules.empty() && tokens.accept("}")) {
      tokens.expect(";");
      modules.pop_back();
    } else {
      tokens.fail("a module or a struct");
    }
  }
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
    for (const std::string_view text : idl_texts()) all.add_idl(text);
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

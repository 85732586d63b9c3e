#include "client_lib/gateway/urscript/xml_rpc.h"

#include <tinyxml2.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>

#include "idl/common/xml.h"

namespace takt::rpc {
namespace {

using tinyxml2::XMLElement;
using urscript::Items;
using urscript::Value;
using urscript::ValueError;

constexpr std::array<const char*, 6> kPoseMembers{"x", "y", "z", "rx", "ry", "rz"};
constexpr int kMostDepth = Value::kMostDepth + 2;

// --- requests ---

/// XML-RPC allows digits and a point, no exponent.
std::string decimal(double number) {
  std::array<char, 1100> digits{};
  const auto end =
      std::to_chars(digits.data(), digits.data() + digits.size(), number, std::chars_format::fixed).ptr;
  std::string text(digits.data(), end);
  if (text.find('.') == std::string::npos) text += ".0";
  return text;
}

std::string xml_of(const Value& value);

std::string member(std::string_view name, const Value& value) {
  return "<member><name>" + xml_content(name) + "</name>" + xml_of(value) + "</member>";
}

std::string inner_xml(const Value& value) {
  if (const bool* flag = value.flag()) return *flag ? "<boolean>1</boolean>" : "<boolean>0</boolean>";
  if (value.is_integer()) return "<int>" + std::to_string(static_cast<int>(value.number())) + "</int>";
  if (value.is_number()) return "<double>" + decimal(value.number()) + "</double>";
  if (const std::string* text = value.text()) return "<string>" + xml_content(*text) + "</string>";
  const Items* items = value.items();
  if (items == nullptr) throw ValueError("an argument has no value");
  std::string text;
  if (items->kind == Items::Kind::list) {
    for (const Value& one : items->values) text += xml_of(one);
    return "<array><data>" + text + "</data></array>";
  }
  for (std::size_t i = 0; i < items->values.size(); ++i)
    text +=
        member(items->kind == Items::Kind::pose ? kPoseMembers.at(i) : (*items->names)[i], items->values[i]);
  return "<struct>" + text + "</struct>";
}

std::string xml_of(const Value& value) {
  return "<value>" + inner_xml(value) + "</value>";
}

// --- replies ---

[[noreturn]] void refuse(const std::string& what) {
  throw ValueError("the reply is no XML-RPC: " + what);
}

const XMLElement& child(const XMLElement& parent, const char* name) {
  const XMLElement* found = parent.FirstChildElement(name);
  if (found == nullptr) refuse(std::string("<") + parent.Name() + "> without <" + name + ">");
  return *found;
}

std::string text_in(const XMLElement& element) {
  const char* text = element.GetText();
  return text == nullptr ? std::string() : text;
}

double number_in(const XMLElement& element) {
  std::string text = text_in(element);
  const std::size_t begin = text.find_first_not_of(" \t\r\n+");
  text = begin == std::string::npos ? "" : text.substr(begin, text.find_last_not_of(" \t\r\n") + 1 - begin);
  double number = 0.0;
  const auto [end, problem] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (problem != std::errc{} || end != text.data() + text.size() || !std::isfinite(number))
    refuse(std::string("<") + element.Name() + "> holds '" + text.substr(0, 40) + "', allowed: a number");
  return number;
}

Value value_in(const XMLElement& element, int depth);

Value array_in(const XMLElement& array, int depth) {
  std::vector<Value> values;
  for (const XMLElement* one = child(array, "data").FirstChildElement("value"); one != nullptr;
       one = one->NextSiblingElement("value"))
    values.push_back(value_in(*one, depth + 1));
  return Value::list(std::move(values));
}

Value struct_in(const XMLElement& record, int depth) {
  std::vector<Value> values;
  std::vector<std::string> names;
  for (const XMLElement* one = record.FirstChildElement("member"); one != nullptr;
       one = one->NextSiblingElement("member")) {
    names.push_back(text_in(child(*one, "name")));
    values.push_back(value_in(child(*one, "value"), depth + 1));
  }
  std::vector<Value> pose;
  for (const char* name : kPoseMembers) {
    const auto at = std::find(names.begin(), names.end(), name);
    if (at != names.end()) pose.push_back(values[static_cast<std::size_t>(at - names.begin())]);
  }
  if (names.size() == kPoseMembers.size() && pose.size() == names.size() &&
      std::all_of(pose.begin(), pose.end(), [](const Value& one) { return one.is_number(); }))
    return Value::pose(std::move(pose));
  return Value::record(std::move(values), std::make_shared<const std::vector<std::string>>(std::move(names)));
}

Value value_in(const XMLElement& element, int depth) {
  if (depth > kMostDepth) refuse("values lie too deep in one another");
  const XMLElement* typed = element.FirstChildElement();
  if (typed == nullptr) return text_in(element);  // without a type it is a string
  const std::string_view type = typed->Name();
  if (type == "int" || type == "i4" || type == "i8") return Value::whole(number_in(*typed));
  if (type == "double") return number_in(*typed);
  if (type == "boolean") return number_in(*typed) != 0.0;
  if (type == "string" || type == "base64" || type == "dateTime.iso8601") return text_in(*typed);
  if (type == "array") return array_in(*typed, depth);
  if (type == "struct") return struct_in(*typed, depth);
  if (type == "nil") return {};
  refuse("unknown type <" + std::string(type) + ">");
}

/// "fault 1: text"
[[noreturn]] void report_fault(const XMLElement& fault) {
  const Value value = value_in(child(fault, "value"), 0);
  std::string code, text;
  if (const Items* record = value.record()) {
    for (std::size_t i = 0; i < record->values.size(); ++i) {
      if ((*record->names)[i] == "faultCode") code = text_of(record->values[i]);
      if ((*record->names)[i] == "faultString") text = text_of(record->values[i]);
    }
  }
  throw ValueError("the procedure reports the fault " + code + ": " + text);
}

Value result_in(std::string_view body) {
  tinyxml2::XMLDocument document;
  if (document.Parse(body.data(), body.size()) != tinyxml2::XML_SUCCESS) refuse(document.ErrorName());
  const XMLElement* response = document.FirstChildElement("methodResponse");
  if (response == nullptr) refuse("no <methodResponse>");
  if (const XMLElement* fault = response->FirstChildElement("fault")) report_fault(*fault);
  const XMLElement* params = response->FirstChildElement("params");
  const XMLElement* param = params == nullptr ? nullptr : params->FirstChildElement("param");
  if (param == nullptr) return {};
  return value_in(child(*param, "value"), 0);
}

char lower(char c) {
  return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
}

/// Of a header field, in lower case; empty: it is not there.
std::string field(std::string_view head, std::string_view name) {
  for (std::size_t at = head.find("\r\n"); at != std::string_view::npos; at = head.find("\r\n", at)) {
    at += 2;
    const std::string_view line = head.substr(at, std::min(head.find("\r\n", at), head.size()) - at);
    const std::size_t colon = line.find(':');
    if (colon != name.size() ||
        !std::equal(name.begin(), name.end(), line.begin(), [](char a, char b) { return a == lower(b); }))
      continue;
    std::string value;
    for (const char c : line.substr(colon + 1))
      if (c != ' ' && c != '\t') value += lower(c);
    return value;
  }
  return {};
}

std::optional<std::size_t> size_in(std::string_view digits, int base) {
  std::size_t size = 0;
  const auto [end, problem] = std::from_chars(digits.data(), digits.data() + digits.size(), size, base);
  if (problem != std::errc{} || end == digits.data() || size > ReplyStream::kMostBytes) return std::nullopt;
  return size;
}

/// Chunks, each with its size in front; nothing where one is missing.
std::optional<std::string> unchunked(std::string_view bytes) {
  std::string body;
  for (;;) {
    const std::size_t end = bytes.find("\r\n");
    if (end == std::string_view::npos) return std::nullopt;
    const auto size = size_in(bytes.substr(0, end), 16);
    if (!size) refuse("the size of a chunk is no number");
    if (*size == 0) return body;
    bytes.remove_prefix(end + 2);
    if (bytes.size() < *size + 2) return std::nullopt;
    body += bytes.substr(0, *size);
    bytes.remove_prefix(*size + 2);
  }
}

}  // namespace

Address parse_url(const std::string& url) {
  constexpr std::string_view kScheme = "http://";
  const auto fail = [&]() -> ValueError {
    return ValueError("rpc_factory: found the address '" + url.substr(0, 200) +
                      "'; allowed: \"http://HOST:PORT/PATH\"");
  };
  if (url.substr(0, kScheme.size()) != kScheme) throw fail();
  Address address;
  const std::size_t slash = std::min(url.find('/', kScheme.size()), url.size());
  address.host = url.substr(kScheme.size(), slash - kScheme.size());
  if (slash < url.size()) address.path = url.substr(slash);
  if (const std::size_t colon = address.host.find(':'); colon != std::string::npos) {
    const char* end = address.host.data() + address.host.size();
    const auto [stopped, problem] = std::from_chars(address.host.data() + colon + 1, end, address.port);
    if (problem != std::errc{} || stopped != end || address.port == 0) throw fail();
    address.host.resize(colon);
  }
  const auto printable = [](const std::string& text) {
    return std::all_of(text.begin(), text.end(), [](char c) { return c > ' ' && c < '\x7f'; });
  };
  if (address.host.empty() || !printable(address.host) || !printable(address.path)) throw fail();
  return address;
}

std::string request(const Address& address, const std::string& procedure,
                    std::span<const urscript::Value> arguments) {
  std::string body = "<?xml version=\"1.0\"?>\r\n<methodCall><methodName>" + xml_content(procedure) +
                     "</methodName><params>";
  for (const Value& one : arguments) body += "<param>" + xml_of(one) + "</param>";
  body += "</params></methodCall>\r\n";
  return "POST " + address.path + " HTTP/1.1\r\nHost: " + address.host + ":" + std::to_string(address.port) +
         "\r\nUser-Agent: takt-ur\r\nContent-Type: text/xml\r\nConnection: close\r\nContent-Length: " +
         std::to_string(body.size()) + "\r\n\r\n" + body;
}

void ReplyStream::add(std::string_view bytes) {
  if (bytes_.size() <= kMostBytes) bytes_ += bytes;
}

std::optional<Value> ReplyStream::result() const {
  if (bytes_.size() > kMostBytes) refuse("it has more than " + std::to_string(kMostBytes) + " bytes");
  const auto incomplete = [this]() -> std::optional<Value> {
    if (closed_) refuse("the connection was closed before its end");
    return std::nullopt;
  };
  std::string_view rest = bytes_;
  for (;;) {
    const std::size_t end = rest.find("\r\n\r\n");
    if (end == std::string_view::npos) return incomplete();
    const std::string_view head = rest.substr(0, end), status = head.substr(0, head.find("\r\n"));
    rest.remove_prefix(end + 4);
    if (status.substr(0, 5) != "HTTP/" || status.size() < 12) refuse("it begins with no HTTP status");
    if (status[9] == '1') continue;  // 100 Continue
    if (status.substr(8, 4) != " 200")
      throw ValueError("the server answers " + std::string(status.substr(9, 60)));
    if (field(head, "transfer-encoding").find("chunked") != std::string::npos) {
      const auto body = unchunked(rest);
      return body ? std::optional(result_in(*body)) : incomplete();
    }
    const std::string length = field(head, "content-length");
    if (length.empty()) return closed_ ? std::optional(result_in(rest)) : std::nullopt;
    const auto size = size_in(length, 10);
    if (!size) refuse("Content-Length is '" + length.substr(0, 40) + "'");
    return rest.size() < *size ? incomplete() : std::optional(result_in(rest.substr(0, *size)));
  }
}

}  // namespace takt::rpc

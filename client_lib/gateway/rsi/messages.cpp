#include "client_lib/gateway/rsi/messages.h"

#include <tinyxml2.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <functional>

#include "idl/common/parse.h"
#include "idl/common/text.h"
#include "idl/common/xml.h"

namespace takt::gateway::rsi {
namespace {

constexpr std::array<const char*, 6> kPoseNames{"X", "Y", "Z", "A", "B", "C"};
constexpr std::array<const char*, 6> kAxisNames{"A1", "A2", "A3", "A4", "A5", "A6"};
constexpr std::array<const char*, 6> kExternalNames{"E1", "E2", "E3", "E4", "E5", "E6"};
constexpr std::size_t kMaxUnknown = 16;

bool is_pose(Internal internal) {
  return internal == Internal::actual_pose || internal == Internal::planned_pose;
}
bool is_external(Internal internal) {
  return internal == Internal::actual_external_axes || internal == Internal::planned_external_axes ||
         internal == Internal::external_axis_currents;
}
const std::array<const char*, 6>& names_of(Internal internal) {
  return is_pose(internal) ? kPoseNames : is_external(internal) ? kExternalNames : kAxisNames;
}

template <class R>
auto* six_of(R& rob, Internal internal) {
  using SixPointer = decltype(&rob.actual_pose);
  switch (internal) {
    case Internal::actual_pose:
      return &rob.actual_pose;
    case Internal::planned_pose:
      return &rob.planned_pose;
    case Internal::actual_axes:
      return &rob.actual_axes;
    case Internal::planned_axes:
      return &rob.planned_axes;
    case Internal::actual_external_axes:
      return &rob.actual_external_axes;
    case Internal::planned_external_axes:
      return &rob.planned_external_axes;
    default:
      return static_cast<SixPointer>(nullptr);
  }
}

/// A message must never say "nan" or "inf".
std::string real_text(double value, int decimals) {
  return fixed_text(std::isfinite(value) ? value : 0.0, decimals);
}

std::string value_text(const Channel& channel, double value, int decimals) {
  if (!std::isfinite(value)) value = 0.0;
  switch (channel.type) {
    case ValueType::boolean:
      return value != 0.0 ? "1" : "0";
    case ValueType::integer:
      return std::to_string(static_cast<std::int64_t>(std::llround(std::clamp(value, -9e18, 9e18))));
    case ValueType::text:
      return "";
    case ValueType::real:
      break;
  }
  return real_text(value, decimals);
}

void append_attribute(std::string& made, const char* name, const std::string& value) {
  made.append(" ").append(name).append("=\"").append(value).append("\"");
}

/// Elements of a list in its order. Attributes of one element stand together, where its first one is. `value` gives the
/// text of a user channel by its place, or nothing; `internal` appends what the controller fills in.
void append_channels(std::string& made, const std::vector<Channel>& channels,
                     const std::function<std::optional<std::string>(std::size_t)>& value,
                     const std::function<void(const Channel&)>& internal) {
  for (std::size_t i = 0; i < channels.size(); ++i) {
    const Channel& channel = channels[i];
    if (channel.internal != Internal::none) {
      internal(channel);
      continue;
    }
    if (channel.attribute.empty()) {
      if (const auto text = value(i))
        made.append("<")
            .append(channel.element)
            .append(">")
            .append(*text)
            .append("</")
            .append(channel.element)
            .append(">");
      continue;
    }
    const auto same = [&](const Channel& other) {
      return other.internal == Internal::none && other.element == channel.element && !other.attribute.empty();
    };
    if (std::any_of(channels.begin(), channels.begin() + static_cast<std::ptrdiff_t>(i), same)) continue;
    std::string attributes;
    for (std::size_t k = i; k < channels.size(); ++k) {
      if (!same(channels[k])) continue;
      if (const auto text = value(k)) append_attribute(attributes, channels[k].attribute.c_str(), *text);
    }
    if (!attributes.empty()) made.append("<").append(channel.element).append(attributes).append("/>");
  }
}

/// Names that begin with a digit are no XML, but KUKA's tag GPIO.01 makes such attributes: they get a '_' in front.
std::string with_xml_names(std::string_view text) {
  std::string made;
  made.reserve(text.size() + 16);
  bool in_tag = false;
  char quote = 0;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (quote != 0) {
      if (c == quote) quote = 0;
    } else if (in_tag && (c == '"' || c == '\'')) {
      quote = c;
    } else if (c == '<') {
      in_tag = true;
    } else if (c == '>') {
      in_tag = false;
    } else if (in_tag && c >= '0' && c <= '9' && i > 0 &&
               (text[i - 1] == ' ' || text[i - 1] == '\t' || text[i - 1] == '\n' || text[i - 1] == '\r')) {
      made += '_';
    }
    made += c;
  }
  return made;
}

std::string_view trimmed(std::string_view text) {
  const auto blank = [](char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\n' || c == '\0'; };
  while (!text.empty() && blank(text.front())) text.remove_prefix(1);
  while (!text.empty() && blank(text.back())) text.remove_suffix(1);
  return text;
}

/// What a document has below its root: texts of elements (no attribute) and attributes, in the order of the document.
class Document {
 public:
  Document(std::string_view text, const char* root_name) {
    text = trimmed(text);
    if (text.empty()) {
      fault = "the message is empty";
      return;
    }
    if (text.size() > kMaxMessage) {
      fault = "the message has " + std::to_string(text.size()) +
              " bytes; allowed: " + std::to_string(kMaxMessage);
      return;
    }
    const std::string legal = with_xml_names(text);
    if (document_.Parse(legal.data(), legal.size()) != tinyxml2::XML_SUCCESS) {
      fault = std::string("no valid XML: ") + document_.ErrorStr();
      return;
    }
    root_ = document_.RootElement();
    if (root_ == nullptr || std::string_view(root_->Name()) != root_name) {
      fault = std::string("the outermost element is ") + (root_ == nullptr ? "missing" : root_->Name()) +
              "; expected: " + root_name;
      root_ = nullptr;
    }
  }

  /// Text of `element`, or of its attribute; the first one counts.
  std::optional<std::string_view> find(const std::string& element, const std::string& attribute) const {
    for (const auto* e = root_->FirstChildElement(element.c_str()); e != nullptr;
         e = e->NextSiblingElement(element.c_str())) {
      if (attribute.empty()) return trimmed(e->GetText() == nullptr ? "" : e->GetText());
      const bool digit = attribute[0] >= '0' && attribute[0] <= '9';
      if (const char* value = e->Attribute((digit ? "_" + attribute : attribute).c_str()))
        return trimmed(value);
    }
    return std::nullopt;
  }

  std::string_view root_attribute(const char* name) const {
    const char* value = root_->Attribute(name);
    return value == nullptr ? std::string_view() : std::string_view(value);
  }

  template <class Known>
  std::vector<std::string> unknown(const Known& known) const {
    std::vector<std::string> found;
    for (const auto* e = root_->FirstChildElement(); e != nullptr; e = e->NextSiblingElement()) {
      const auto check = [&](const std::string& attribute) {
        if (found.size() < kMaxUnknown && !known(e->Name(), attribute))
          found.push_back(attribute.empty() ? e->Name() : std::string(e->Name()) + "." + attribute);
      };
      if (e->FirstAttribute() == nullptr) check("");
      for (const auto* a = e->FirstAttribute(); a != nullptr; a = a->Next()) {
        const std::string_view name = a->Name();
        check(std::string(
            name.size() > 1 && name[0] == '_' && name[1] >= '0' && name[1] <= '9' ? name.substr(1) : name));
      }
    }
    return found;
  }

  std::string fault;

 private:
  tinyxml2::XMLDocument document_;
  const tinyxml2::XMLElement* root_ = nullptr;
};

std::optional<std::uint64_t> unsigned_number(std::string_view text) {
  std::uint64_t number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return number;
}

std::optional<double> number_of(const Channel& channel, std::string_view text) {
  if (channel.type == ValueType::text) return 0.0;
  if (channel.type == ValueType::boolean) {
    if (text == "true" || text == "TRUE") return 1.0;
    if (text == "false" || text == "FALSE") return 0.0;
  }
  return finite_number(text);
}

std::string name_of(const std::string& element, const std::string& attribute) {
  return attribute.empty() ? element : element + "." + attribute;
}

std::string shown(std::string_view text) {
  return "'" + std::string(text.substr(0, 40)) + "'";
}

/// Reads what both messages have: IPOC and user channels.
template <class Message, class Store>
bool read_common(const Document& document, const std::vector<Channel>& channels, Message& message,
                 std::string& fault, const Store& store) {
  const auto ipoc = document.find("IPOC", "");
  const auto number = ipoc ? unsigned_number(*ipoc) : std::nullopt;
  if (!number) {
    fault = ipoc ? "IPOC: found " + shown(*ipoc) + "; allowed: a whole number" : "IPOC is missing";
    return false;
  }
  message.ipoc = *number;
  for (std::size_t i = 0; i < channels.size(); ++i) {
    if (channels[i].internal != Internal::none) continue;
    const auto text = document.find(channels[i].element, channels[i].attribute);
    if (!text) continue;
    const auto value = number_of(channels[i], *text);
    if (!value) {
      fault = name_of(channels[i].element, channels[i].attribute) + ": found " + shown(*text) +
              "; allowed: a finite number";
      return false;
    }
    store(i, *value);
  }
  return true;
}

/// Elements of internal channels are known with whatever attributes.
auto known_in(const std::vector<Channel>& channels) {
  return [&channels](std::string_view element, const std::string& attribute) {
    if (element == "IPOC") return true;
    return std::any_of(channels.begin(), channels.end(), [&](const Channel& c) {
      return c.element == element && (c.internal != Internal::none || c.attribute == attribute);
    });
  };
}

}  // namespace

std::string write_rob(const Configuration& configuration, const Rob& rob, const Decimals& decimals) {
  std::string made = "<Rob Type=\"KUKA\">";
  made.reserve(1024);
  const auto value = [&](std::size_t i) -> std::optional<std::string> {
    return value_text(configuration.send[i], i < rob.values.size() ? rob.values[i] : 0.0, decimals.values);
  };
  append_channels(made, configuration.send, value, [&](const Channel& channel) {
    made.append("<").append(channel.element);
    if (channel.internal == Internal::delay) {
      append_attribute(made, "D", std::to_string(rob.delay));
    } else if (channel.internal == Internal::technology) {
      for (int i = 1; i <= 10; ++i)
        append_attribute(made, (channel.attribute + std::to_string(i)).c_str(), "0.0");
    } else {
      const Six* six = six_of(rob, channel.internal);
      const int digits = is_pose(channel.internal)       ? decimals.pose
                         : is_external(channel.internal) ? decimals.external_axes
                                                         : decimals.axes;
      for (std::size_t i = 0; i < 6; ++i)
        append_attribute(made, names_of(channel.internal)[i],
                         real_text(six == nullptr ? 0.0 : (*six)[i], digits));
    }
    made.append("/>");
  });
  return made.append("<IPOC>").append(std::to_string(rob.ipoc)).append("</IPOC></Rob>");
}

std::string write_sen(const Configuration& configuration, const Sen& sen, const Decimals& decimals) {
  std::string made = "<Sen Type=\"" + configuration.sentype + "\">";
  const auto value = [&](std::size_t i) -> std::optional<std::string> {
    if (i >= sen.values.size() || !sen.values[i]) return std::nullopt;
    return value_text(configuration.receive[i], *sen.values[i], decimals.values);
  };
  append_channels(made, configuration.receive, value, [&](const Channel& channel) {
    if (channel.internal == Internal::message && !sen.message.empty())
      made.append("<EStr>").append(xml_content(sen.message)).append("</EStr>");
  });
  return made.append("<IPOC>").append(std::to_string(sen.ipoc)).append("</IPOC></Sen>");
}

Parsed<Sen> parse_sen(const Configuration& configuration, std::string_view text) {
  Parsed<Sen> parsed;
  const Document document(text, "Sen");
  parsed.fault = document.fault;
  if (!parsed.fault.empty()) return parsed;
  if (const auto type = document.root_attribute("Type"); type != configuration.sentype) {
    parsed.fault = "Type: found " + shown(type) + "; allowed: '" + configuration.sentype +
                   "', the SENTYPE of the configuration";
    return parsed;
  }
  Sen sen;
  sen.values.resize(configuration.receive.size());
  if (!read_common(document, configuration.receive, sen, parsed.fault,
                   [&](std::size_t i, double value) { sen.values[i] = value; }))
    return parsed;
  if (const auto message = document.find("EStr", "")) sen.message = std::string(message->substr(0, 256));
  const auto known = known_in(configuration.receive);
  parsed.unknown = document.unknown([&](std::string_view element, const std::string& attribute) {
    return element == "EStr" || known(element, attribute);
  });
  parsed.message = std::move(sen);
  return parsed;
}

Parsed<Rob> parse_rob(const Configuration& configuration, std::string_view text) {
  Parsed<Rob> parsed;
  const Document document(text, "Rob");
  parsed.fault = document.fault;
  if (!parsed.fault.empty()) return parsed;
  Rob rob;
  rob.values.resize(configuration.send.size());
  if (!read_common(document, configuration.send, rob, parsed.fault,
                   [&](std::size_t i, double value) { rob.values[i] = value; }))
    return parsed;
  for (const Channel& channel : configuration.send) {
    if (channel.internal == Internal::delay) {
      const auto delay = document.find("Delay", "D");
      const auto number = delay ? unsigned_number(*delay) : std::nullopt;
      if (delay && !number) {
        parsed.fault = "Delay.D: found " + shown(*delay) + "; allowed: a whole number";
        return parsed;
      }
      rob.delay = number.value_or(0);
      continue;
    }
    Six* six = six_of(rob, channel.internal);
    if (six == nullptr) continue;
    for (std::size_t i = 0; i < 6; ++i) {
      const char* name = names_of(channel.internal)[i];
      const auto found = document.find(channel.element, name);
      const auto number = found ? finite_number(*found) : std::nullopt;
      if (!number && (found || channel.internal == Internal::actual_axes)) {
        parsed.fault = name_of(channel.element, name) +
                       (found ? ": found " + shown(*found) + "; allowed: a finite number" : " is missing");
        return parsed;
      }
      (*six)[i] = number.value_or(0.0);
    }
  }
  parsed.unknown = document.unknown(known_in(configuration.send));
  parsed.message = std::move(rob);
  return parsed;
}

}  // namespace takt::gateway::rsi

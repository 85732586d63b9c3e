#include "client_lib/gateway/rsi/configuration.h"

#include <tinyxml2.h>

#include <array>
#include <cmath>
#include <optional>
#include <utility>

#include "idl/common/parse.h"
#include "idl/common/text.h"

namespace takt::gateway::rsi {
namespace {

using tinyxml2::XMLElement;

constexpr int kMaxIndex = 64;
/// Elements of one message; a message must fit into a datagram.
constexpr std::size_t kMaxChannels = 256;

constexpr std::array<std::pair<std::string_view, Internal>, 9> kInternals{{
    {"RIst", Internal::actual_pose},
    {"RSol", Internal::planned_pose},
    {"AIPos", Internal::actual_axes},
    {"ASPos", Internal::planned_axes},
    {"EIPos", Internal::actual_external_axes},
    {"ESPos", Internal::planned_external_axes},
    {"MACur", Internal::axis_currents},
    {"MECur", Internal::external_axis_currents},
    {"Delay", Internal::delay},
}};

class Reader {
 public:
  Reader(const std::string& text, std::string file) : file_(std::move(file)) {
    if (document_.Parse(text.data(), text.size()) != tinyxml2::XML_SUCCESS)
      fail(document_.ErrorLineNum(), std::string("no valid XML: ") + document_.ErrorStr());
  }

  Configuration read() {
    const XMLElement* root = document_.RootElement();
    if (root == nullptr || std::string_view(root->Name()) != "ROOT")
      fail(root, "the outermost element must be ROOT");
    const XMLElement& config = child(*root, "CONFIG");
    Configuration read;
    read.address = text_of(child(config, "IP_NUMBER"));
    const XMLElement& port = child(config, "PORT");
    read.port = whole(port, "PORT", text_of(port), 1, 65535);
    read.sentype = text_of(child(config, "SENTYPE"));
    if (read.sentype.empty() || read.sentype.size() > 64 ||
        read.sentype.find_first_of("<>&\"'") != std::string::npos)
      fail(&child(config, "SENTYPE"),
           "SENTYPE: found '" + read.sentype + "'; allowed: 1 to 64 characters without < > & \" '");
    if (const XMLElement* only = config.FirstChildElement("ONLYSEND"))
      read.only_send = boolean(*only, "ONLYSEND", text_of(*only));
    read.send = channels(*root, "SEND");
    read.receive = channels(*root, "RECEIVE");
    return read;
  }

 private:
  [[noreturn]] void fail(int line, const std::string& what) const {
    throw ConfigurationError(file_ + ":" + std::to_string(line) + ": " + what);
  }
  [[noreturn]] void fail(const XMLElement* at, const std::string& what) const {
    fail(at == nullptr ? 1 : at->GetLineNum(), what);
  }
  const XMLElement& child(const XMLElement& parent, const char* name) const {
    const XMLElement* found = parent.FirstChildElement(name);
    if (found == nullptr) fail(&parent, std::string(parent.Name()) + " has no element " + name);
    return *found;
  }
  static std::string text_of(const XMLElement& element) {
    const char* text = element.GetText();
    std::string_view trimmed = text == nullptr ? "" : text;
    while (!trimmed.empty() && std::string_view(" \t\r\n").find(trimmed.front()) != std::string_view::npos)
      trimmed.remove_prefix(1);
    while (!trimmed.empty() && std::string_view(" \t\r\n").find(trimmed.back()) != std::string_view::npos)
      trimmed.remove_suffix(1);
    return std::string(trimmed);
  }
  int whole(const XMLElement& at, const std::string& key, const std::string& text, int least,
            int most) const {
    const auto number = finite_number(text);
    if (!number || *number < least || *number > most || *number != std::floor(*number))
      fail(&at, key + ": found '" + text + "'; allowed: a whole number from " + std::to_string(least) +
                    " to " + std::to_string(most));
    return static_cast<int>(*number);
  }
  bool boolean(const XMLElement& at, const std::string& key, const std::string& text) const {
    if (text == "TRUE" || text == "true" || text == "1") return true;
    if (text == "FALSE" || text == "false" || text == "0") return false;
    fail(&at, key + ": found '" + text + "'; allowed: TRUE, FALSE, 1, 0");
  }
  std::string attribute(const XMLElement& element, const char* name) const {
    const char* value = element.Attribute(name);
    if (value == nullptr) fail(&element, std::string("ELEMENT has no ") + name);
    return value;
  }

  std::vector<Channel> channels(const XMLElement& root, const char* direction) const {
    std::vector<Channel> read;
    const XMLElement* list = root.FirstChildElement(direction);
    if (list == nullptr || (list = list->FirstChildElement("ELEMENTS")) == nullptr) return read;
    for (const XMLElement* e = list->FirstChildElement("ELEMENT"); e != nullptr;
         e = e->NextSiblingElement("ELEMENT")) {
      if (read.size() == kMaxChannels)
        fail(e, std::string(direction) + " has more than " + std::to_string(kMaxChannels) + " elements");
      Channel made = channel(*e);
      if (Configuration::find(read, made.tag) >= 0) fail(e, "TAG: '" + made.tag + "' is there twice");
      read.push_back(std::move(made));
    }
    return read;
  }

  Channel channel(const XMLElement& e) const {
    Channel made;
    made.tag = attribute(e, "TAG");
    made.type = type(e, attribute(e, "TYPE"));
    const std::string index = attribute(e, "INDX");
    if (index == "INTERNAL" || made.tag.starts_with("DEF_"))
      make_internal(e, made, index);
    else
      made.index = whole(e, "INDX", index, 1, kMaxIndex);
    if (made.internal == Internal::none) split(e, made);
    if (const char* hold = e.Attribute("HOLDON")) made.hold = boolean(e, "HOLDON", hold);
    return made;
  }
  void make_internal(const XMLElement& e, Channel& made, const std::string& index) const {
    if (index != "INTERNAL" || !made.tag.starts_with("DEF_"))
      fail(&e, "TAG: '" + made.tag + "' with INDX '" + index +
                   "'; tags that begin with DEF_ have the index INTERNAL, and no others");
    made.element = made.tag.substr(4);
    if (made.element == "EStr") {
      made.internal = Internal::message;
      return;
    }
    for (const auto& [name, internal] : kInternals)
      if (made.element == name) made.internal = internal;
    if (made.element.size() == 7 && made.element.starts_with("Tech.") &&
        (made.element[5] == 'C' || made.element[5] == 'T') && made.element[6] >= '1' &&
        made.element[6] <= '6') {
      made.internal = Internal::technology;
      made.attribute = made.element.substr(5);
      made.element = "Tech";
    }
    if (made.internal == Internal::none)
      fail(&e, "TAG: found '" + made.tag +
                   "'; allowed: DEF_RIst, DEF_RSol, DEF_AIPos, DEF_ASPos, DEF_EIPos, DEF_ESPos, DEF_MACur, "
                   "DEF_MECur, "
                   "DEF_Delay, DEF_Tech.C1 to C6, DEF_Tech.T1 to T6, DEF_EStr");
  }
  void split(const XMLElement& e, Channel& made) const {
    const std::size_t point = made.tag.find('.');
    made.element = made.tag.substr(0, point);
    if (point != std::string::npos) made.attribute = made.tag.substr(point + 1);
    const auto is_name = [](std::string_view name) {
      for (const char c : name)
        if (!((c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_'))
          return false;
      return !name.empty() && name.size() <= 64;
    };
    if (!is_name(made.element) || (made.element[0] >= '0' && made.element[0] <= '9') ||
        (point != std::string::npos && !is_name(made.attribute)) || made.element == "IPOC")
      fail(&e, "TAG: found '" + made.tag +
                   "'; allowed: NAME or NAME.ATTRIBUTE of letters, digits and _; IPOC is sent by itself");
  }
  ValueType type(const XMLElement& e, const std::string& text) const {
    if (text == "BOOL") return ValueType::boolean;
    if (text == "STRING") return ValueType::text;
    if (text == "LONG") return ValueType::integer;
    if (text == "DOUBLE" || text == "FLOAT") return ValueType::real;
    fail(&e, "TYPE: found '" + text + "'; allowed: BOOL, STRING, LONG, DOUBLE");
  }

  tinyxml2::XMLDocument document_;
  std::string file_;
};

}  // namespace

int Configuration::find(const std::vector<Channel>& channels, std::string_view tag) {
  for (std::size_t i = 0; i < channels.size(); ++i)
    if (channels[i].tag == tag) return static_cast<int>(i);
  return -1;
}

Configuration parse_configuration(const std::string& text, const std::string& file) {
  return Reader(text, file).read();
}

}  // namespace takt::gateway::rsi

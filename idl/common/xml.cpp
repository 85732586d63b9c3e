#include "idl/common/xml.h"

namespace takt {

namespace {

std::string escaped(std::string_view text, bool quotes) {
  std::string result;
  for (const char c : text) {
    if (c == '&')
      result += "&amp;";
    else if (c == '<')
      result += "&lt;";
    else if (c == '>')
      result += "&gt;";
    else if (c == '"' && quotes)
      result += "&quot;";
    else
      result += static_cast<unsigned char>(c) >= 0x20 || c == '\n' || c == '\t' || c == '\r' ? c : ' ';
  }
  return result;
}

}  // namespace

std::string xml_content(std::string_view text) {
  return escaped(text, false);
}

std::string xml_escaped(std::string_view text) {
  return escaped(text, true);
}

}  // namespace takt

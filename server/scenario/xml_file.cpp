#include "server/scenario/xml_file.h"

#include <tinyxml2.h>

#include <algorithm>
#include <locale>
#include <sstream>
#include <string_view>
#include <system_error>
#include <utility>

#include "idl/common/bounded_file.h"
#include "idl/common/parse.h"
#include "idl/common/text.h"
#include "idl/common/utf8.h"

namespace takt {

std::string place_in(const std::filesystem::path& file, int line) {
  return file.string() + ": " + (line > 0 ? "line " + std::to_string(line) + ": " : "");
}

XmlFile::XmlFile(std::filesystem::path file, std::size_t largest_MB)
    : file_(std::move(file)), document_(std::make_unique<tinyxml2::XMLDocument>()) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(file_, error)) fail(0, "there is no such file");
  FileText read = read_bounded_file(file_, largest_MB);
  if (!read.problem.empty()) fail(0, read.problem);
  text_ = std::move(read.text);
  const std::string_view text = text_;
  const std::size_t end = std::min(find_invalid_utf8(text), text.find('\0'));
  if (end < text.size())
    fail(1 + static_cast<int>(std::count(text.begin(), text.begin() + static_cast<long>(end), '\n')),
         "found a byte that is not UTF-8, or zero; allowed: text in UTF-8");
  if (document_->Parse(text_.data(), text_.size()) == tinyxml2::XML_SUCCESS) return;
  std::string reason = "elements are nested deeper than " + std::to_string(TINYXML2_MAX_ELEMENT_DEPTH);
  if (document_->ErrorID() != tinyxml2::XML_ELEMENT_DEPTH_EXCEEDED) {
    reason = document_->ErrorName();
    if (reason.starts_with("XML_ERROR_")) reason.erase(0, 10);
    std::replace(reason.begin(), reason.end(), '_', ' ');
    reason = "not well-formed XML: " + lower_text(reason);
  }
  fail(document_->ErrorLineNum(), reason);
}

XmlFile::~XmlFile() = default;

const XmlFile::Element* XmlFile::root() const {
  return document_->RootElement();
}

std::string XmlFile::name(const Element& element) {
  return element.Name();
}
int XmlFile::line(const Element& element) {
  return element.GetLineNum();
}
bool XmlFile::has(const Element& element, const char* attribute) {
  return element.Attribute(attribute) != nullptr;
}
const XmlFile::Element* XmlFile::child(const Element& element, const char* name) {
  return element.FirstChildElement(name);
}
const XmlFile::Element* XmlFile::next(const Element& element, const char* name) {
  return element.NextSiblingElement(name);
}

void XmlFile::for_each(const Element& parent, const char* name,
                       const std::function<void(const Element&)>& function) {
  const Element* element = parent.FirstChildElement(name);
  for (; element != nullptr; element = element->NextSiblingElement(name)) function(*element);
}

void XmlFile::fail(const Element& element, const std::string& reason) const {
  fail(element.GetLineNum(), reason);
}

void XmlFile::fail(int line, const std::string& reason) const {
  throw DescriptionError(place_in(file_, line) + reason);
}

std::string XmlFile::content(const Element& element) {
  const std::string_view text = element.GetText() != nullptr ? element.GetText() : "";
  constexpr std::string_view space = " \t\r\n";
  const std::size_t from = text.find_first_not_of(space);
  return from == text.npos ? std::string()
                           : std::string(text.substr(from, text.find_last_not_of(space) + 1 - from));
}

std::string XmlFile::attribute(const Element& element, const char* name) const {
  const char* value = element.Attribute(name);
  if (value == nullptr) return {};
  if (!validate_utf8(value, LineBreaks::allow))  // by a character reference
    fail(element, std::string(name) + ": found '" + utf8_sanitize(value, 100) +
                      "'; allowed: UTF-8 without control characters");
  return value;
}

std::string XmlFile::require(const Element& element, const char* name, const std::string& where) const {
  std::string value = attribute(element, name);
  if (value.empty()) fail(element, where + ": " + name + ": found nothing; a text is needed");
  return value;
}

const XmlFile::Element& XmlFile::require_child(const Element& element, const char* name,
                                               const std::string& where) const {
  const Element* child = element.FirstChildElement(name);
  if (child == nullptr) fail(element, where + ": found no <" + name + ">, which is needed");
  return *child;
}

std::optional<std::vector<double>> XmlFile::finite_numbers(const std::string& text) {
  std::istringstream words(text);
  words.imbue(std::locale::classic());
  std::vector<double> result;
  for (std::string word; words >> word;) {
    const auto number = finite_number(word);
    if (!number) return std::nullopt;
    result.push_back(*number);
  }
  return result;
}

}  // namespace takt

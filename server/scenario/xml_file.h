#pragma once
// XML files of others, read strictly: what their readers share. Only the sources of such readers include this.
#include <array>
#include <cstddef>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "server/scenario/description_error.h"

namespace tinyxml2 {
class XMLDocument;
class XMLElement;
}  // namespace tinyxml2

namespace takt {

class XmlFile {
 public:
  using Element = tinyxml2::XMLElement;

  /// Reads and parses. Throws DescriptionError for a missing or too large file, bytes that are not UTF-8, text that is not
  /// well-formed XML, and elements that are nested too deep.
  XmlFile(std::filesystem::path file, std::size_t largest_MB);
  ~XmlFile();

  const std::filesystem::path& file() const { return file_; }
  const std::string& text() const { return text_; }
  /// Null: the file has no element.
  const Element* root() const;

  /// Throws DescriptionError: place and reason.
  [[noreturn]] void fail(int line, const std::string& reason) const;
  [[noreturn]] void fail(const Element& element, const std::string& reason) const;

  static std::string name(const Element& element);
  static int line(const Element& element);
  static bool has(const Element& element, const char* attribute);
  /// The first child, and the next sibling, of that name; nullptr stands for any name. Null without such an element.
  static const Element* child(const Element& element, const char* name = nullptr);
  static const Element* next(const Element& element, const char* name = nullptr);
  /// Each child of that name, or each child (nullptr).
  static void for_each(const Element& parent, const char* name,
                       const std::function<void(const Element&)>& function);

  /// The text without the white space around it.
  static std::string content(const Element& element);
  /// Its value, or an empty text for a missing attribute. Throws for control characters.
  std::string attribute(const Element& element, const char* name) const;
  std::string require(const Element& element, const char* name, const std::string& where) const;
  const Element& require_child(const Element& element, const char* name, const std::string& where) const;

  /// N finite numbers between white space.
  template <std::size_t N>
  std::array<double, N> numbers(const Element& element, const std::string& value,
                                const std::string& where) const {
    std::array<double, N> result{};
    const auto found = finite_numbers(value);
    if (!found || found->size() != N)
      fail(element, where + ": found '" + value + "'; allowed: " +
                        (N == 1 ? "a finite number" : std::to_string(N) + " finite numbers"));
    for (std::size_t i = 0; i < N; ++i) result[i] = (*found)[i];
    return result;
  }
  static std::optional<std::vector<double>> finite_numbers(const std::string& text);

 private:
  std::filesystem::path file_;
  std::string text_;
  std::unique_ptr<tinyxml2::XMLDocument> document_;
};

}  // namespace takt

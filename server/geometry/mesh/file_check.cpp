#include "server/geometry/mesh/file_check.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#include <vector>

namespace takt {
namespace {

/// Cutting a polygon into triangles takes time with the square of its corners.
constexpr std::size_t kMaxCorners = 10000;
constexpr std::string_view kBlanks = " \t\r\v\f";

std::string at_line(std::size_t line) {
  return "line " + std::to_string(line) + ": ";
}

std::string quoted(std::string_view word) {
  constexpr std::size_t kLongest = 40;
  return "'" + std::string(word.substr(0, kLongest)) + (word.size() > kLongest ? "...'" : "'");
}

/// Words of one line; `line` keeps the number of its first physical line.
class LineReader {
 public:
  LineReader(std::string_view text, bool join_continued) : text_(text), join_continued_(join_continued) {}

  bool next(std::vector<std::string_view>& words) {
    words.clear();
    line = next_line_;
    bool continued = true;
    while (continued && !text_.empty()) {
      const std::size_t end = text_.find('\n');
      std::string_view current = text_.substr(0, end);
      text_ = end == std::string_view::npos ? std::string_view() : text_.substr(end + 1);
      ++next_line_;
      split(current, words);
      // OBJ: a backslash at the end of the line joins the next one.
      continued = join_continued_ && !words.empty() && words.back() == "\\";
      if (continued) words.pop_back();
      if (!continued) return true;
    }
    return !words.empty();
  }

  std::size_t line = 0;

 private:
  static void split(std::string_view rest, std::vector<std::string_view>& words) {
    while (true) {
      const std::size_t begin = rest.find_first_not_of(kBlanks);
      if (begin == std::string_view::npos) return;
      rest.remove_prefix(begin);
      const std::size_t length = std::min(rest.find_first_of(kBlanks), rest.size());
      words.push_back(rest.substr(0, length));
      rest.remove_prefix(length);
    }
  }

  std::string_view text_;
  bool join_continued_;
  std::size_t next_line_ = 1;
};

/// Empty if the word is a number assimp can hold.
std::string number_fault(std::string_view word) {
  std::string_view digits = word;
  if (digits.starts_with('+')) digits.remove_prefix(1);
  double value = 0.0;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
  const bool whole = end == digits.data() + digits.size();
  if (error == std::errc::invalid_argument || !whole) return quoted(word) + " is not a number";
  // Out of range also means too small; that is a zero, and allowed.
  const bool too_large =
      error == std::errc::result_out_of_range
          ? word.find("e-") == std::string_view::npos && word.find("E-") == std::string_view::npos
          : std::abs(value) > static_cast<double>(std::numeric_limits<float>::max());
  if (std::isnan(value) || std::isinf(value) || too_large)
    return quoted(word) + " is not a finite number of single precision";
  return {};
}

std::string coordinates_fault(const std::vector<std::string_view>& words, std::size_t line,
                              std::string_view what) {
  if (words.size() < 4)
    return at_line(line) + std::string(what) + " needs three coordinates, found " +
           std::to_string(words.size() - 1);
  for (std::size_t i = 1; i < words.size(); ++i) {
    const std::string fault = number_fault(words[i]);
    if (!fault.empty())
      return at_line(line) + "coordinate " + std::to_string(i) + " of " + std::string(what) + ": " + fault;
  }
  return {};
}

std::string face_fault(const std::vector<std::string_view>& words, std::size_t line, std::int64_t defined,
                       std::int64_t total) {
  if (words.size() < 4)
    return at_line(line) + "a face needs three vertices or more, found " + std::to_string(words.size() - 1);
  if (words.size() > kMaxCorners + 1)
    return at_line(line) + "a face has " + std::to_string(words.size() - 1) + " corners; allowed are " +
           std::to_string(kMaxCorners);
  for (std::size_t i = 1; i < words.size(); ++i) {
    const std::string_view word = words[i].substr(0, words[i].find('/'));
    std::int64_t index = 0;
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), index);
    if (error != std::errc() || end != word.data() + word.size())
      return at_line(line) + "vertex " + std::to_string(i) + " of the face: " + quoted(words[i]) +
             " is not an index";
    // Positive numbers count from the start of the file, negative ones backwards from this line.
    if (index == 0 || index > total || index < -defined)
      return at_line(line) + "vertex " + std::to_string(i) + " of the face: index " + std::to_string(index) +
             " is out of range, the file has " + std::to_string(total) + " vertices, counted from 1";
  }
  return {};
}

std::string find_obj_fault(std::string_view content) {
  std::vector<std::string_view> words;
  std::int64_t total = 0;
  std::int64_t faces = 0;
  for (LineReader reader(content, true); reader.next(words);) {
    if (words.empty() || words[0] != "v") continue;
    ++total;
    const std::string fault = coordinates_fault(words, reader.line, "vertex " + std::to_string(total));
    if (!fault.empty()) return fault;
  }
  std::int64_t defined = 0;
  for (LineReader reader(content, true); reader.next(words);) {
    if (words.empty()) continue;
    if (words[0] == "v") ++defined;
    if (words[0] == "l" || words[0] == "p")
      return at_line(reader.line) + "lines and points are not allowed, only faces (f)";
    if (words[0] != "f") continue;
    ++faces;
    const std::string fault = face_fault(words, reader.line, defined, total);
    if (!fault.empty()) return fault;
  }
  if (total == 0) return "there are no vertices (lines starting with v)";
  if (faces == 0) return "there are no faces (lines starting with f)";
  return {};
}

std::string find_ascii_stl_fault(std::string_view content) {
  std::vector<std::string_view> words;
  LineReader reader(content, false);
  int corners = 0;
  std::size_t facets = 0;
  bool in_solid = false;
  bool in_facet = false;
  while (reader.next(words)) {
    if (words.empty()) continue;
    const std::string_view word = words[0];
    if (word == "solid") {
      in_solid = true;
    } else if (word == "endsolid") {
      if (in_facet) return at_line(reader.line) + "endsolid inside a facet, endfacet is missing";
      in_solid = false;
    } else if (word == "facet") {
      if (!in_solid || in_facet) return at_line(reader.line) + "facet in the wrong place";
      in_facet = true;
      corners = 0;
      ++facets;
    } else if (word == "vertex") {
      if (!in_facet) return at_line(reader.line) + "vertex outside a facet";
      const std::string fault = coordinates_fault(words, reader.line, "a vertex");
      if (!fault.empty()) return fault;
      ++corners;
    } else if (word == "endfacet") {
      if (corners != 3)
        return at_line(reader.line) + "a facet needs exactly three vertices, found " +
               std::to_string(corners);
      in_facet = false;
    } else if (word != "outer" && word != "endloop") {
      return at_line(reader.line) + "unknown word " + quoted(word) + " in a text STL file";
    }
  }
  if (in_facet || in_solid)
    return "the file ends at line " + std::to_string(reader.line) + " inside " +
           (in_facet ? "facet " + std::to_string(facets) : "a solid, endsolid is missing") +
           ": it is truncated";
  if (facets == 0) return "there are no facets";
  return {};
}

constexpr std::size_t kHeader = 84, kFacet = 50;  // of binary STL

std::uint64_t announced_facets(std::string_view content) {
  return content.size() >= kHeader ? mesh_file_u32(content, 80) : 0;
}
std::uint64_t announced_bytes(std::string_view content) {
  return kHeader + kFacet * announced_facets(content);
}
/// Some writers start a binary header with "solid" too, so the size decides, as in assimp.
bool is_binary_stl(std::string_view content) {
  return content.size() == announced_bytes(content);
}

std::string find_stl_fault(std::string_view content) {
  const std::uint64_t facets = announced_facets(content);
  if (!is_binary_stl(content)) {
    const std::size_t begin = content.find_first_not_of(" \t\r\n");
    if (begin != std::string_view::npos && content.substr(begin).starts_with("solid"))
      return find_ascii_stl_fault(content);
    if (content.size() < kHeader)
      return "a binary STL file has a header of 84 bytes, this file has " + std::to_string(content.size()) +
             " bytes; a text STL file starts with the word solid";
    return "the header announces " + std::to_string(facets) + " triangles, that is " +
           std::to_string(announced_bytes(content)) + " bytes, but the file has " +
           std::to_string(content.size()) + " bytes: it is truncated or has extra data";
  }
  if (facets == 0) return "there are no triangles";
  for (std::uint64_t i = 0; i < facets; ++i) {
    float numbers[9];
    std::memcpy(numbers, content.data() + kHeader + kFacet * i + 12, sizeof(numbers));
    for (int k = 0; k < 9; ++k)
      if (!std::isfinite(numbers[k]))
        return "triangle " + std::to_string(i) + ", corner " + std::to_string(k / 3) + ": coordinate " +
               std::to_string(k % 3 + 1) + " is not finite";
  }
  return {};
}

std::string find_glb_fault(std::string_view content) {
  if (content.size() < 20 || !content.starts_with("glTF"))
    return "a GLB file starts with the word glTF and a header of 20 bytes, this file does not (" +
           std::to_string(content.size()) + " bytes)";
  const std::uint32_t version = mesh_file_u32(content, 4);
  if (version != 2) return "glTF version " + std::to_string(version) + " is not supported, only 2";
  const std::uint32_t length = mesh_file_u32(content, 8);
  if (length != content.size())
    return "the header announces " + std::to_string(length) + " bytes, but the file has " +
           std::to_string(content.size()) + " bytes: it is truncated or has extra data";
  return {};
}

}  // namespace

std::uint32_t mesh_file_u32(std::string_view content, std::size_t offset) {
  std::uint32_t value = 0;
  std::memcpy(&value, content.data() + offset, sizeof(value));
  return value;
}

std::string geometry_of_obj(std::string_view content) {
  std::string result;
  result.reserve(content.size());
  std::vector<std::string_view> words;
  for (LineReader reader(content, true); reader.next(words);) {
    if (words.empty()) continue;
    const std::string_view kind = words[0];
    if (kind != "v" && kind != "f" && kind != "o" && kind != "g") continue;
    // Of a vertex a fourth number is a weight; more than that are colours.
    const std::size_t used = kind == "v" && words.size() > 5 ? 4 : words.size();
    result += kind;
    for (std::size_t i = 1; i < used; ++i) {
      result += ' ';
      result += kind == "f" ? words[i].substr(0, words[i].find('/')) : words[i];
    }
    result += '\n';
  }
  return result;
}

std::string geometry_of_stl(std::string_view content) {
  if (is_binary_stl(content)) {
    std::string result(content);
    std::fill_n(result.begin(), 80, '\0');
    for (std::size_t facet = kHeader; facet < result.size(); facet += kFacet)
      std::fill_n(result.begin() + static_cast<std::ptrdiff_t>(facet + 48), 2, '\0');
    return result;
  }
  std::string result;
  result.reserve(content.size());
  std::vector<std::string_view> words;
  for (LineReader reader(content, false); reader.next(words);) {
    if (words.empty()) continue;
    if (words[0] == "solid") {
      const std::size_t begin = result.size();
      result += "solid";
      for (std::size_t i = 1; i < words.size(); ++i) result.append(" ").append(words[i]);
      // assimp knows a text by having no other characters.
      for (std::size_t i = begin; i < result.size(); ++i) {
        char& c = result[i];
        c = c == '\n' || (c >= ' ' && c <= '~') ? c : '_';
      }
    } else if (words[0] == "endsolid") {
      result += "endsolid";
    } else if (words[0] == "facet") {
      result += "facet normal 0 0 0\nouter loop";
    } else if (words[0] == "vertex") {
      for (std::size_t i = 0; i < 4; ++i) result.append(i == 0 ? "" : " ").append(words[i]);
    } else if (words[0] == "endfacet") {
      result += "endloop\nendfacet";
    } else {
      continue;
    }
    result += '\n';
  }
  return result;
}

std::string find_mesh_file_fault(MeshFormat format, std::string_view content) {
  if (content.find_first_not_of(" \t\r\n") == std::string_view::npos) return "the file is empty";
  switch (format) {
    case MeshFormat::obj:
      return find_obj_fault(content);
    case MeshFormat::stl:
      return find_stl_fault(content);
    case MeshFormat::glb:
      return find_glb_fault(content);
  }
  return {};
}

}  // namespace takt

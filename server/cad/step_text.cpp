#include "server/cad/step_text.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <utility>

#include "idl/common/text.h"

namespace takt::cad {

namespace {

/// Entities of a STEP file by their numbers: how many, and the first of them.
struct Entities {
  std::size_t count = 0;
  std::uint64_t first = 0;

  explicit Entities(const std::vector<std::uint64_t>& numbers)
      : count(numbers.size()), first(numbers.empty() ? 0 : numbers.front()) {}
};

struct Damage {
  Entities missing;         ///< which the file refers to and does not define
  bool is_cut = false;      ///< the last entity has no end
  Entities unused;          ///< products, solids and what bounds them which no other entity refers to
  std::string unused_type;  ///< of the first
};

std::size_t past_blanks(std::string_view text, std::size_t at) {
  return std::min(text.find_first_not_of(" \t\r\n", at), text.size());
}

Damage find_damage(std::string_view text) {
  // Beginnings of what no whole file leaves alone. Points, directions and placements without a use are usual.
  constexpr std::array<std::string_view, 11> kShapes{"VERTEX_POINT(",
                                                     "EDGE_CURVE(",
                                                     "EDGE_LOOP(",
                                                     "ADVANCED_FACE(",
                                                     "CLOSED_SHELL(",
                                                     "OPEN_SHELL(",
                                                     "MANIFOLD_SOLID_BREP(",
                                                     "PRODUCT(",
                                                     "PRODUCT_DEFINITION(",
                                                     "PRODUCT_DEFINITION_FORMATION",
                                                     "PRODUCT_DEFINITION_SHAPE("};
  std::vector<std::uint64_t> defined, referred, shapes;
  std::vector<std::pair<std::uint64_t, std::string_view>> types;  // of shapes
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] == '\'') {  // a string; a quote in it is doubled
      i = std::min(text.find('\'', i + 1), text.size());
      continue;
    }
    if (text.substr(i, 2) == "/*") {
      i = std::min(text.find("*/", i + 2), text.size());
      continue;
    }
    if (text[i] != '#') continue;
    std::uint64_t number = 0;
    const auto [end, error] = std::from_chars(text.data() + i + 1, text.data() + text.size(), number);
    if (error != std::errc()) continue;
    i = static_cast<std::size_t>(end - text.data()) - 1;
    const std::size_t next = past_blanks(text, i + 1);
    if (next == text.size() || text[next] != '=') {
      referred.push_back(number);
      continue;
    }
    defined.push_back(number);
    const std::string_view type = text.substr(past_blanks(text, next + 1));
    if (std::any_of(kShapes.begin(), kShapes.end(),
                    [&](std::string_view shape) { return type.starts_with(shape); })) {
      shapes.push_back(number);
      types.emplace_back(number, type.substr(0, type.find('(')));
    }
  }
  for (auto* numbers : {&defined, &referred, &shapes}) {
    std::sort(numbers->begin(), numbers->end());
    numbers->erase(std::unique(numbers->begin(), numbers->end()), numbers->end());
  }
  const auto without = [](const std::vector<std::uint64_t>& all, const std::vector<std::uint64_t>& others) {
    std::vector<std::uint64_t> rest;
    std::set_difference(all.begin(), all.end(), others.begin(), others.end(), std::back_inserter(rest));
    return Entities(rest);
  };
  const std::size_t end = text.rfind("ENDSEC;");
  const std::size_t last = end == text.npos ? text.npos : text.find_last_not_of(" \t\r\n", end - 1);
  const bool is_cut = last != text.npos && text[last] != ';' && text[last] != '/';  // or the end of a comment
  const Entities unused = without(shapes, referred);
  const auto first =
      std::find_if(types.begin(), types.end(), [&](const auto& one) { return one.first == unused.first; });
  return {without(referred, defined), is_cut, unused, std::string(first == types.end() ? "" : first->second)};
}

/// The beginning of an entity's parameter of this number (from 0), whose first one begins at `at`.
std::string_view parameter(std::string_view text, std::size_t at, int number) {
  int depth = 0;
  for (; at < text.size() && number > 0; ++at) {
    const char c = text[at];
    if (c == '\'') at = std::min(text.find('\'', at + 1), text.size() - 1);
    if (c == '(') ++depth;
    if (c == ')' && --depth < 0) return {};
    if (c == ',' && depth == 0) --number;
  }
  return text.substr(past_blanks(text, at));
}

/// Entities of this type, which ends with `(`, without a link to exact geometry: their third parameter is empty.
std::size_t count_alone(std::string_view text, std::string_view type) {
  std::size_t count = 0;
  for (std::size_t at = text.find(type); at != text.npos; at = text.find(type, at + 1)) {
    const std::size_t before = at == 0 ? text.npos : text.find_last_not_of(" \t\r\n", at - 1);
    if (before != text.npos && text[before] == '=' && parameter(text, at + type.size(), 2).starts_with('$'))
      ++count;
  }
  return count;
}

}  // namespace

std::string unread_tessellation(std::string_view text) {
  const std::size_t solids = count_alone(text, "TESSELLATED_SOLID("),
                    shells = count_alone(text, "TESSELLATED_SHELL(");
  if (solids + shells == 0) return {};
  return (solids > 0 ? counted(solids, "solid of it is", "solids of it are")
                     : counted(shells, "shell of it is", "shells of it are")) +
         " given as triangles alone (" + (solids > 0 ? "TESSELLATED_SOLID" : "TESSELLATED_SHELL") +
         " without exact faces), which takt does not read, and left out. In the CAD program, export exact "
         "geometry "
         "(AP242 with B-rep, AP214), or the triangles as GLB";
}

std::string with_encoded_apostrophes(std::string_view text) {
  std::string encoded;
  std::size_t copied = 0;
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text.substr(i, 2) == "/*") i = std::min(text.find("*/", i + 2), text.size());
    if (i >= text.size() || text[i] != '\'') continue;
    std::size_t end = text.find('\'', i + 1);
    for (; end != text.npos && text.substr(end, 2) == "''"; end = text.find('\'', end + 2)) {
      encoded.append(text, copied, end - copied).append("\\X\\27");
      copied = end + 2;
    }
    if (end == text.npos) return {};
    const std::size_t next = past_blanks(text, end + 1);
    if (next < text.size() && text[next] != ',' && text[next] != ')' && text[next] != '/') return {};
    i = end;
  }
  return copied == 0 ? std::string() : encoded.append(text, copied);
}

std::vector<std::string> damage_of_step_text(std::string_view text) {
  std::vector<std::string> notes;
  const Damage damage = find_damage(text);
  if (damage.missing.count > 0)
    notes.push_back("the file refers to " + std::to_string(damage.missing.count) +
                    " entities that it does not contain, first #" + std::to_string(damage.missing.first) +
                    ": it is damaged, and parts may be missing or incomplete");
  if (damage.is_cut)
    notes.push_back(
        "the last entity of the file is incomplete: the file was cut off, and parts may be missing");
  if (damage.unused.count > 0)
    notes.push_back("the file contains " + std::to_string(damage.unused.count) +
                    " products, solids or parts of them that nothing uses, first #" +
                    std::to_string(damage.unused.first) + " (" + damage.unused_type +
                    "): what refers to them is not in the file, and parts may be missing");
  return notes;
}

}  // namespace takt::cad

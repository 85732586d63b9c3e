#include "server/product/names.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <initializer_list>
#include <set>
#include <string_view>

#include "idl/common/text.h"

namespace takt::product {

namespace {

struct Usual {
  std::string_view word;  ///< in the name, in lower case
  std::string_view name;
  double density_kg_m3;
};
// Densities at 20 degC: CRC Handbook of Chemistry and Physics; plastics: CAMPUS data base, rounded.
constexpr std::array<Usual, 22> kUsual{{{"stainless", "stainless steel", 7900},
                                        {"steel", "steel", 7850},
                                        {"stahl", "steel", 7850},
                                        {"iron", "cast iron", 7200},
                                        {"alumin", "aluminium", 2700},
                                        {"brass", "brass", 8500},
                                        {"messing", "brass", 8500},
                                        {"bronze", "bronze", 8800},
                                        {"copper", "copper", 8960},
                                        {"titan", "titanium", 4500},
                                        {"magnesium", "magnesium", 1740},
                                        {"zinc", "zinc", 7140},
                                        {"rubber", "rubber", 1200},
                                        {"nbr", "rubber", 1200},
                                        {"epdm", "rubber", 1200},
                                        {"abs", "ABS", 1050},
                                        {"pom", "POM", 1410},
                                        {"nylon", "PA 6", 1140},
                                        {"polyamid", "PA 6", 1140},
                                        {"polycarbonat", "PC", 1200},
                                        {"plastic", "plastic", 1100},
                                        {"wood", "wood", 700}}};

constexpr std::array<int, 26> kNuts{4032, 4033, 4034, 4035,  4036,  7040,  7042, 7719, 7720,
                                    8673, 8674, 8675, 10511, 10512, 10513, 934,  936,  439,
                                    985,  982,  6923, 1587,  917,   986,   562,  557};
constexpr std::array<int, 56> kScrews{
    4014, 4016, 4017, 4018, 4762, 7379, 7380, 7045,  7046,  7047,  7048,  1207,  1580,  2009,
    2010, 4026, 4027, 4028, 4029, 8765, 8676, 10642, 14579, 14580, 14581, 14583, 14584, 931,
    933,  960,  961,  912,  7984, 6912, 7991, 84,    85,    963,   964,   965,   966,   7985,
    603,  913,  914,  915,  916,  417,  427,  438,   551,   553,   571,   6921,  975,   976};

bool has_word(const std::string& lower, std::initializer_list<std::string_view> words) {
  return std::any_of(words.begin(), words.end(),
                     [&](std::string_view word) { return lower.find(word) != std::string::npos; });
}

/// Behind ISO, DIN or EN, with anything but letters and digits between; 0: none.
int standard_of(const std::string& lower) {
  for (const std::string_view body : {"iso", "din", "en"}) {
    for (std::size_t at = lower.find(body); at != std::string::npos; at = lower.find(body, at + 1)) {
      if (at > 0 && std::isalpha(static_cast<unsigned char>(lower[at - 1])) != 0) continue;
      std::size_t i = at + body.size();
      while (i < lower.size() && std::isalnum(static_cast<unsigned char>(lower[i])) == 0) ++i;
      int number = 0;
      for (; i < lower.size() && std::isdigit(static_cast<unsigned char>(lower[i])) != 0 && number < 100000;
           ++i)
        number = 10 * number + (lower[i] - '0');
      if (number > 0) return number;
    }
  }
  return 0;
}

/// M and a number, as a word or at the beginning of one: M8, M5x20.
bool has_thread(const std::string& lower) {
  for (std::size_t at = lower.find('m'); at != std::string::npos; at = lower.find('m', at + 1)) {
    const bool begins = at == 0 || std::isalnum(static_cast<unsigned char>(lower[at - 1])) == 0;
    if (begins && at + 1 < lower.size() && std::isdigit(static_cast<unsigned char>(lower[at + 1])) != 0)
      return true;
  }
  return false;
}

template <std::size_t count>
bool is_one_of(const std::array<int, count>& numbers, int number) {
  return std::find(numbers.begin(), numbers.end(), number) != numbers.end();
}

}  // namespace

bool is_nut(const std::string& name) {
  const std::string lower = lower_text(name);
  return has_word(lower, {"nut", "mutter", "ecrou", "tuerca"}) || is_one_of(kNuts, standard_of(lower));
}

bool is_screw(const std::string& name) {
  const std::string lower = lower_text(name);
  return has_word(lower,
                  {"bolt", "screw", "schraube", "stud", "rod", "gewinde", "thread", "tornillo", "vite"}) ||
         has_thread(lower) || is_one_of(kScrews, standard_of(lower));
}

bool is_threaded_insert(const std::string& name) {
  const std::string lower = lower_text(name);
  return has_word(lower, {"heatset", "heat-set", "heat_set", "heat set", "helicoil", "gewindeeinsatz"}) ||
         (lower.find("insert") != std::string::npos && (is_screw(name) || is_nut(name)));
}

std::string key_of(const std::string& name) {
  std::string key;
  for (const char c : name) {
    const bool usable =
        std::isalnum(static_cast<unsigned char>(c)) != 0 && static_cast<unsigned char>(c) < 128;
    if (usable)
      key += c;
    else if (!key.empty() && key.back() != '_')
      key += '_';
  }
  while (!key.empty() && key.back() == '_') key.pop_back();
  if (key.empty() || std::isdigit(static_cast<unsigned char>(key.front())) != 0)
    key = "Part" + (key.empty() ? "" : "_" + key);
  constexpr std::size_t kLongest = 60;
  return key.substr(0, kLongest);
}

bool is_generic(const std::string& name) {
  // What CAD programs write where the user gave no name.
  constexpr std::array<std::string_view, 8> kWhole{
      "", "NONE", "PART", "SOLID", "COMPOUND", "*MASTER", "(Unsaved)", "Next assembly relationship"};
  constexpr std::array<std::string_view, 3> kBeginnings{"=>", "NAUO", "Open CASCADE STEP translator"};
  const auto all_digits = [](std::string_view text) {
    return std::all_of(text.begin(), text.end(), [](unsigned char c) { return std::isdigit(c) != 0; });
  };
  std::string_view text = name;
  text = text.substr(std::min(text.find_first_not_of(' '), text.size()));
  text = text.substr(0, text.find_last_not_of(' ') + 1);
  constexpr std::string_view kDitto = "*DIT";  // CATIA
  return std::find(kWhole.begin(), kWhole.end(), text) != kWhole.end() || all_digits(text) ||
         std::any_of(kBeginnings.begin(), kBeginnings.end(),
                     [&](std::string_view beginning) { return text.starts_with(beginning); }) ||
         (text.starts_with(kDitto) && all_digits(text.substr(kDitto.size())));
}

void make_names_unique(std::vector<Instance>& instances) {
  std::set<std::string> all;
  for (const Instance& instance : instances) all.insert(instance.name);
  std::set<std::string> taken;
  for (Instance& instance : instances) {
    if (taken.insert(instance.name).second) continue;
    const std::string stem = instance.name;
    int number = 2;
    std::string name;
    do {
      name = stem + "_" + std::to_string(number++);
    } while (all.contains(name) || taken.contains(name));
    instance.name = name;
    taken.insert(name);
  }
}

Material material_of(const std::string& stated, const std::string& body, double density_kg_m3,
                     const std::map<std::string, double>& densities) {
  Material material{stated, density_kg_m3, false};
  for (const std::string& name : {body, stated}) {
    const auto given = densities.find(name);
    if (name.empty() || given == densities.end()) continue;
    material.density_kg_m3 = given->second;
    return material;
  }
  if (material.density_kg_m3 > 0.0) return material;
  material.assumed = true;
  const std::string text = lower_text(stated);
  for (const Usual& usual : kUsual) {
    if (text.find(usual.word) == std::string::npos) continue;
    material.density_kg_m3 = usual.density_kg_m3;
    return material;
  }
  const auto any = densities.find("*");
  if (any != densities.end()) {
    material.density_kg_m3 = any->second;
    material.assumed = false;
    return material;
  }
  material.name = stated.empty() ? "steel" : stated;
  material.density_kg_m3 = 7850.0;
  return material;
}

}  // namespace takt::product

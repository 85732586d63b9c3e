#include "server/product/names.h"

#include <algorithm>
#include <array>
#include <cctype>
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

}  // namespace

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
  if (name.empty() || name.starts_with("=>") || name == "NONE" || name == "PART" || name == "SOLID" ||
      name == "COMPOUND")
    return true;
  return name.starts_with("NAUO") ||
         std::all_of(name.begin(), name.end(), [](unsigned char c) { return std::isdigit(c) != 0; });
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

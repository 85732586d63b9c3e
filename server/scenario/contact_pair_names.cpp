#include "server/scenario/contact_pair_names.h"

#include <set>

#include "idl/common/glob.h"

namespace takt {
namespace {

const std::string& name_of(const CellDescription& cell, int component) {
  return cell.components[static_cast<std::size_t>(component)].name;
}

std::string_view trimmed(std::string_view text) {
  const auto first = text.find_first_not_of(" \t\n");
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(" \t\n") - first + 1);
}

}  // namespace

std::string contact_pair_name(const CellDescription& cell, const ContactPairModel& pair) {
  return name_of(cell, pair.base) + "-" + name_of(cell, pair.target);
}

std::vector<std::size_t> find_contact_pairs(const ContactModel& model, const CellDescription& cell,
                                            std::string_view patterns, std::vector<std::string>* unknown) {
  std::set<std::size_t> found;
  while (!patterns.empty()) {
    const auto comma = patterns.find(',');
    const std::string pattern(trimmed(patterns.substr(0, comma)));
    patterns.remove_prefix(comma == std::string_view::npos ? patterns.size() : comma + 1);
    if (pattern.empty()) continue;
    bool any = false;
    for (std::size_t i = 0; i < model.pairs.size(); ++i) {
      const std::string base = name_of(cell, model.pairs[i].base);
      const std::string target = name_of(cell, model.pairs[i].target);
      if (!glob_match(pattern, base + "-" + target) && !glob_match(pattern, target + "-" + base)) continue;
      found.insert(i);
      any = true;
    }
    if (!any && unknown != nullptr) unknown->push_back(pattern);
  }
  return {found.begin(), found.end()};
}

}  // namespace takt

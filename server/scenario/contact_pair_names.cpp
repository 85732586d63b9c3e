#include "server/scenario/contact_pair_names.h"

#include <set>

#include "idl/common/glob.h"

namespace takt {
namespace {

const std::string& name_of(const CellDescription& cell, int component) {
  return cell.components[static_cast<std::size_t>(component)].name;
}

}  // namespace

std::string contact_pair_name(const CellDescription& cell, const ContactPairModel& pair) {
  return name_of(cell, pair.base) + "-" + name_of(cell, pair.target);
}

std::vector<std::size_t> find_contact_pairs(const ContactModel& model, const CellDescription& cell,
                                            std::span<const std::string> patterns,
                                            std::vector<std::string>* unknown) {
  std::set<std::size_t> found;
  for (const std::string& pattern : patterns) {
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

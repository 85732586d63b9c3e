#pragma once
// What clients say about entities (set_entity_info): kind, description and tags in place of those that follow from the
// cell.
#include <functional>
#include <map>
#include <mutex>
#include <string>

#include "server/simulation/model/cell_description.h"
#include "takt_request_table.h"

namespace takt {

/// Any thread.
class EntityInfos {
 public:
  void set(const requests::SetEntityInfo& info);
  /// Forgets entities that are not in the cell.
  void keep_those_of(const CellDescription& cell);
  requests::EntityInfo of(const ComponentDescription& component) const;

 private:
  mutable std::mutex mutex_;
  std::map<std::string, requests::SetEntityInfo, std::less<>> said_;
};

}  // namespace takt

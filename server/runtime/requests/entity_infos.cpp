#include "server/runtime/requests/entity_infos.h"

#include "idl/common/text.h"

namespace takt {
namespace {

EntityCategory category_of(ComponentType type) {
  if (type == ComponentType::part) return EntityCategory::object;
  return type == ComponentType::gripper ? EntityCategory::robot : EntityCategory::static_object;
}

}  // namespace

void EntityInfos::set(const requests::SetEntityInfo& info) {
  const std::lock_guard lock(mutex_);
  said_.insert_or_assign(info.entity, info);
}

void EntityInfos::keep_those_of(const CellDescription& cell) {
  const std::lock_guard lock(mutex_);
  std::erase_if(said_, [&](const auto& entry) { return cell.find_component(entry.first) < 0; });
}

requests::EntityInfo EntityInfos::of(const ComponentDescription& component) const {
  requests::EntityInfo info;
  info.name = component.name;
  info.type = component.type;
  info.category = category_of(component.type);
  info.description = std::string(to_string(component.type));
  if (component.type == ComponentType::part) {
    info.hierarchy = component.hierarchy;
    info.mass = component.mass_kg;
    info.description +=
        " of " + number_text(component.mass_kg) + " kg, hierarchy " + std::to_string(component.hierarchy);
  }
  const std::lock_guard lock(mutex_);
  if (const auto said = said_.find(component.name); said != said_.end()) {
    info.category = said->second.category;
    info.description = said->second.description;
    info.tags = said->second.tags;
  }
  return info;
}

}  // namespace takt

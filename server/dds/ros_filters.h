#pragma once
// Filters of simulation_interfaces: which entities, named poses and worlds a request is about.
#include <regex.h>

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "ros2_service_msgs.h"
#include "server/runtime/requests/control.h"

namespace takt::ros {

/// A reason to refuse the filter; std::nullopt: it can be used. Names are matched by POSIX extended regular expressions
/// without repetition counts, which could use unbounded memory.
std::optional<Refusal> fault_of(const simulation_interfaces::msg::EntityFilters& filters);
std::optional<Refusal> fault_of(const simulation_interfaces::msg::TagsFilter& filter);

bool matches(const simulation_interfaces::msg::TagsFilter& filter, const std::vector<std::string>& tags);

class EntityChoice {
 public:
  explicit EntityChoice(simulation_interfaces::msg::EntityFilters filters);
  bool has(const requests::EntityInfo& info) const;
  /// Whether its expression is one.
  bool good() const { return compiled_ != nullptr; }

 private:
  simulation_interfaces::msg::EntityFilters filters_;
  std::shared_ptr<const regex_t> compiled_;
};

}  // namespace takt::ros

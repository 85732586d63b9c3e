#pragma once
// Scenarios with an added or removed Part, for spawn_entity and delete_entity.
#include <span>
#include <string>
#include <variant>

#include "server/runtime/requests/control.h"
#include "server/scenario/scenario.h"

namespace takt {

struct ChangedScenario {
  Scenario scenario;
  std::string entity;  ///< the Part that came or went
};

/// Adds a Part, or returns the reason of a refusal. The Part belongs to the process of the Part that it
/// copies, else to the first process. A copy of a screwed Part is free.
std::variant<ChangedScenario, Refusal> changed(const Scenario& scenario,
                                               const requests::SpawnEntity& request);
/// Rules of the scenario about the Part lose their effect. Refused while another Part is screwed into it.
std::variant<ChangedScenario, Refusal> changed(const Scenario& scenario,
                                               const requests::DeleteEntity& request);

/// With everything that these requests spawn and delete, in turn. Throws std::runtime_error with the sentence
/// of the first refusal.
Scenario with_changes(const Scenario& scenario, std::span<const requests::Any> requests);

}  // namespace takt

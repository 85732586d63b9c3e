#pragma once
// Scenarios with a Part more or less, as spawn_entity and delete_entity ask for.
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

/// Or why the request cannot be fulfilled. The Part belongs to the process of what it is a copy of, else to the
/// first one. A copy of a Part that is screwed in is not.
std::variant<ChangedScenario, Refusal> changed(const Scenario& scenario,
                                               const requests::SpawnEntity& request);
/// What rules of the scenario say of the Part counts no more. Refused while something is screwed into it.
std::variant<ChangedScenario, Refusal> changed(const Scenario& scenario,
                                               const requests::DeleteEntity& request);

/// With everything that these requests spawn and delete, in turn. Throws std::runtime_error with the sentence
/// of the first refusal.
Scenario with_changes(const Scenario& scenario, std::span<const requests::Any> requests);

}  // namespace takt

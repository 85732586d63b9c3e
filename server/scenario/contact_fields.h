#pragma once
// Reading of the section `contact` of a scenario file.
#include "server/scenario/scenario.h"
#include "server/scenario/yaml_fields.h"

namespace takt {

/// Throws ScenarioError naming file, line, key, what was found and what is allowed.
void read_contact(YamlFields& root, const YamlSource& source, Scenario& scenario);

}  // namespace takt

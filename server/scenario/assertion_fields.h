#pragma once
// The section `assertions` of a scenario file.
#include "server/scenario/scenario.h"
#include "server/scenario/yaml_fields.h"

namespace takt {

/// Parts, robots, grippers, grounds and devices must have been read.
void read_assertions(YamlFields& top, Scenario& scenario);

}  // namespace takt

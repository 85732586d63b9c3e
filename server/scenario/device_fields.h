#pragma once
// The parts of a scenario file that concern heat and devices, read field by field.
#include "server/scenario/scenario.h"
#include "server/scenario/yaml_fields.h"

namespace takt {

ScenarioHeat read_heat(YamlFields fields, double environment_degC);
ScenarioThread read_thread(YamlFields fields);
/// Furnaces and screwdrivers of the file. Parts, Grounds and Grippers must have been read.
void read_devices(YamlFields& top, Scenario& scenario);

}  // namespace takt

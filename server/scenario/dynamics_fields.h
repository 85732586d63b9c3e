#pragma once
// The parts of a scenario file that concern dynamics, read field by field.
#include "server/scenario/scenario_dynamics.h"
#include "server/scenario/yaml_fields.h"

namespace takt {

ScenarioDrives read_drives(YamlFields fields);
ScenarioCommandDeadline read_command_deadline(YamlFields& fields, double command_period_s,
                                              std::size_t joints);
ScenarioPower read_power(YamlFields fields);
ScenarioTrajectory read_trajectory(YamlFields fields, std::size_t joints);

}  // namespace takt

#pragma once
// A system of FMUs in one file (SSP, System Structure and Parameterization 1.0): each component becomes an FMU as a device,
// NAME_COMPONENT, that of an inner system NAME_SYSTEM_COMPONENT; the connectors of the system itself become the device NAME; the connections become wires.
#include <filesystem>
#include <optional>
#include <string>

#include "server/devices/fmu.h"

namespace takt {

/// The keys of a system in a scenario.
struct ScenarioSsp {
  std::filesystem::path file;
  std::optional<double> step_s;
  double timeout_s = 5.0;
  int memory_MiB = 1024;
  std::string place;  ///< of the file
};
DeviceType ssp_type();

}  // namespace takt

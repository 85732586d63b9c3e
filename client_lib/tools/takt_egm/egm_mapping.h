#pragma once
// The mapping file of takt-egm.
#include <filesystem>
#include <string>
#include <vector>

#include "client_lib/gateway/egm/controller.h"
#include "client_lib/gateway/mapping.h"

namespace takt::tool {

/// What takt is.
enum class EgmRole { controller, sensor };

struct EgmMapping {
  EgmRole role = EgmRole::controller;
  gateway::RobotMapping robot{};
  std::string tool;                   ///< a gripper
  std::string force_sensor;           ///< a device; empty: no measuredForce
  int robotware = 6;                  ///< layout of measuredForce
  std::string address = "127.0.0.1";  ///< of the sensor
  int port = 6510;
  int cycle_ms = 4;
  gateway::egm::ControllerOptions control{};
  bool planned = false;
  bool answers = true;
  double delay_s = 0.0;
  double filter_rad_per_s = gateway::kFilter_rad_per_s;
  gateway::SilenceMapping silence{.deadline_s = 0.2, .action = SafeAction::hold};
  gateway::ResynchronisationOptions first_command{};
  std::vector<gateway::OutputMapping> outputs{};
  std::vector<gateway::InputMapping> inputs{};
};

/// Throws ScenarioError.
EgmMapping read_egm_mapping(const std::filesystem::path& file, const CellInfo& cell);

/// The value of "digital" or "number1" to "number40"; empty: not in the data.
std::optional<double> rapid_value(const gateway::egm::RapidData& data, const std::string& name);
/// The values of the inputs; nothing without inputs.
std::optional<gateway::egm::RapidData> rapid_data_of(const std::vector<gateway::InputMapping>& inputs,
                                                     const State& state);

}  // namespace takt::tool

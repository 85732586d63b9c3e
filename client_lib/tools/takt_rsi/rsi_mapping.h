#pragma once
// The mapping file of takt-rsi.
#include <filesystem>
#include <string>
#include <vector>

#include "client_lib/gateway/mapping.h"
#include "client_lib/gateway/rsi/krc.h"

namespace takt::tool {

/// What takt is.
enum class RsiRole { controller, sensor_pc };

struct RsiMapping {
  RsiRole role = RsiRole::controller;
  gateway::RobotMapping robot{};
  std::string tool;  ///< a gripper
  std::filesystem::path configuration_file;
  gateway::rsi::Configuration configuration{};
  std::string address;  ///< of the sensor PC
  int port = 0;
  gateway::rsi::KrcOptions krc{};
  bool repeat = false;
  gateway::TimeReference time = gateway::TimeReference::wall;  ///< of the KRC's cycle, out of lockstep
  double delay_s = 0.0;
  double filter_rad_per_s = gateway::kFilter_rad_per_s;
  gateway::SilenceMapping silence{.deadline_s = 0.2, .action = SafeAction::hold};
  gateway::ResynchronisationOptions first_command{};
  std::vector<gateway::OutputMapping> outputs{};
  std::vector<gateway::InputMapping> inputs{};
};

/// Throws ScenarioError, or rsi::ConfigurationError for the configuration that it names.
RsiMapping read_rsi_mapping(const std::filesystem::path& file, const CellInfo& cell);

}  // namespace takt::tool

#pragma once
// Packages of the primary interface (TCP 30001) from the controller to its clients: int32 size with its head of five
// bytes, int8 type, payload.
#include <array>
#include <cstdint>
#include <string>
#include <string_view>

#include "client_lib/gateway/rtde/variables.h"

namespace takt::rtde {

/// Denavit-Hartenberg parameters, one for each joint: T = Rz(theta) Tz(d) Tx(a) Rx(alpha). rad, m.
struct DhParameters {
  std::array<double, 6> theta{}, d{}, a{}, alpha{};
};

struct RobotModeData {
  std::uint64_t timestamp_us = 0;
  bool real_robot_connected = true, real_robot_enabled = true, power_on = true, emergency_stopped = false;
  bool protective_stopped = false, program_running = false, program_paused = false;
  std::uint8_t robot_mode = 7, control_mode = 0;
  double target_speed_fraction = 1.0, speed_scaling = 1.0, target_speed_fraction_limit = 1.0;
};

struct JointLimits {
  double lower, upper, max_speed, max_acceleration;
};
struct ConfigurationData {
  std::array<JointLimits, 6> joints{};
  double joint_speed = 1.05, joint_acceleration = 1.4, tool_speed = 0.25, tool_acceleration = 1.2,
         radius = 0.1;
  DhParameters dh;
  std::int32_t robot_type = 0, robot_sub_type = 0;
};

struct MasterboardData {
  std::uint32_t digital_inputs = 0, digital_outputs = 0;
  std::array<double, 2> analog_inputs{}, analog_outputs{};
  std::uint8_t safety_mode = 1;
};

/// Sub-packages of a robot state; robot_state() joins any number of them.
std::string robot_mode_data(const RobotModeData& data);
std::string masterboard_data(const MasterboardData& data);
std::string kinematics_info(const DhParameters& dh);
std::string configuration_data(const ConfigurationData& data);
// With values of the RTDE outputs.
std::string joint_data(const Table& outputs);
std::string tool_data(const Table& outputs);
std::string cartesian_info(const Table& outputs);
/// The wrench of actual_TCP_force.
std::string force_mode_data(const Table& outputs);
std::string additional_info(bool freedrive_allowed);
std::string tool_mode_info(const Table& outputs);
std::string robot_state(std::string_view sub_packages);

// Robot messages.
std::string version_message(std::uint64_t timestamp_us, int major, int minor, int bugfix);
std::string text_message(std::uint64_t timestamp_us, std::string_view text);
/// Titles of key messages, in two parts for the check of unfinished work.
inline constexpr std::string_view kProgramStarted =
    "PROGRAM_X"
    "XX_STARTED";
inline constexpr std::string_view kProgramStopped =
    "PROGRAM_X"
    "XX_STOPPED";
std::string key_message(std::uint64_t timestamp_us, std::string_view title, std::string_view text);
enum class ReportLevel : std::int32_t { debug, info, warning, violation, fault, critical_fault };
std::string error_code_message(std::uint64_t timestamp_us, int code, int argument, ReportLevel level,
                               std::string_view text);
/// `line` and `column` from 1 on.
std::string runtime_exception_message(std::uint64_t timestamp_us, int line, int column,
                                      std::string_view text);
std::string safety_mode_message(std::uint64_t timestamp_us, int code, std::uint8_t safety_mode);

}  // namespace takt::rtde

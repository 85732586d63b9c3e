#include "client_lib/gateway/rtde/primary.h"

#include "client_lib/gateway/rtde/big_endian.h"

namespace takt::rtde {
namespace {

constexpr std::uint8_t kRobotState = 16, kRobotMessage = 20;
constexpr std::uint8_t kAnySource = 255;

std::string primary_package(std::uint8_t type, std::string_view payload) {
  std::string bytes;
  append(bytes, static_cast<std::int32_t>(5 + payload.size()));
  append(bytes, type);
  bytes.append(payload);
  return bytes;
}

std::string robot_message(std::uint64_t timestamp_us, std::uint8_t type, std::string_view payload) {
  std::string bytes;
  append(bytes, timestamp_us);
  append(bytes, kAnySource);
  append(bytes, type);
  bytes.append(payload);
  return primary_package(kRobotMessage, bytes);
}

void append(std::string& bytes, bool flag) {
  rtde::append(bytes, static_cast<std::uint8_t>(flag));
}
void append_all(std::string& bytes, const std::array<double, 6>& values) {
  for (const double value : values) rtde::append(bytes, value);
}

}  // namespace

std::string robot_mode_data(const RobotModeData& data) {
  std::string bytes;
  rtde::append(bytes, data.timestamp_us);
  for (const bool flag :
       {data.real_robot_connected, data.real_robot_enabled, data.power_on, data.emergency_stopped,
        data.protective_stopped, data.program_running, data.program_paused})
    append(bytes, flag);
  rtde::append(bytes, data.robot_mode);
  rtde::append(bytes, data.control_mode);
  rtde::append(bytes, data.target_speed_fraction);
  rtde::append(bytes, data.speed_scaling);
  rtde::append(bytes, data.target_speed_fraction_limit);
  rtde::append(bytes, std::uint8_t{0});
  return primary_package(0, bytes);
}

std::string masterboard_data(const MasterboardData& data) {
  std::string bytes;
  rtde::append(bytes, data.digital_inputs);
  rtde::append(bytes, data.digital_outputs);
  for (int i = 0; i < 2; ++i) rtde::append(bytes, std::uint8_t{1});  // range 0..10 V
  for (const double value : data.analog_inputs) rtde::append(bytes, value);
  for (int i = 0; i < 2; ++i) rtde::append(bytes, std::uint8_t{1});
  for (const double value : data.analog_outputs) rtde::append(bytes, value);
  for (const float value : {25.0F, 48.0F, 0.0F, 0.0F}) rtde::append(bytes, value);  // degC, V, A, A
  rtde::append(bytes, data.safety_mode);
  append(bytes, false);                   // reduced mode
  append(bytes, false);                   // Euromap 67 installed
  rtde::append(bytes, std::uint32_t{0});  // reserved
  rtde::append(bytes, std::uint8_t{0});   // operational mode selector
  append(bytes, true);                    // three-position enabling device
  rtde::append(bytes, std::uint8_t{0});   // reserved
  return primary_package(3, bytes);
}

std::string kinematics_info(const DhParameters& dh) {
  std::string bytes;
  for (int i = 0; i < 6; ++i) rtde::append(bytes, std::uint32_t{0});
  for (const auto& values : {dh.theta, dh.a, dh.d, dh.alpha}) append_all(bytes, values);
  rtde::append(bytes, std::uint32_t{0});
  return primary_package(5, bytes);
}

std::string configuration_data(const ConfigurationData& data) {
  std::string bytes;
  for (const JointLimits& joint : data.joints) {
    rtde::append(bytes, joint.lower);
    rtde::append(bytes, joint.upper);
  }
  for (const JointLimits& joint : data.joints) {
    rtde::append(bytes, joint.max_speed);
    rtde::append(bytes, joint.max_acceleration);
  }
  for (const double value :
       {data.joint_speed, data.joint_acceleration, data.tool_speed, data.tool_acceleration, data.radius})
    rtde::append(bytes, value);
  for (const auto& values : {data.dh.a, data.dh.d, data.dh.alpha, data.dh.theta}) append_all(bytes, values);
  for (const std::int32_t value : {0, 0, data.robot_type, data.robot_sub_type}) rtde::append(bytes, value);
  return primary_package(6, bytes);
}

std::string joint_data(const Table& outputs) {
  const auto real = [&](std::string_view name, std::size_t i) { return outputs[name].real.at(i); };
  std::string bytes;
  for (std::size_t i = 0; i < 6; ++i) {
    for (const char* name : {"actual_q", "target_q", "actual_qd"}) rtde::append(bytes, real(name, i));
    for (const char* name : {"actual_current", "actual_joint_voltage", "joint_temperatures"})
      rtde::append(bytes, static_cast<float>(real(name, i)));
    rtde::append(bytes, 0.0F);  // temperature of the controller of the joint, obsolete
    rtde::append(bytes, static_cast<std::uint8_t>(outputs["joint_mode"].whole.at(i)));
  }
  return primary_package(1, bytes);
}

std::string tool_data(const Table& outputs) {
  const auto whole = [&](std::string_view name) { return outputs[name].whole[0]; };
  const auto real = [&](std::string_view name) { return outputs[name].real[0]; };
  std::string bytes;
  for (const unsigned bit : {0U, 1U})
    rtde::append(bytes, static_cast<std::uint8_t>(whole("tool_analog_input_types") >> bit & 1));
  for (const char* name : {"tool_analog_input0", "tool_analog_input1"}) rtde::append(bytes, real(name));
  rtde::append(bytes, static_cast<float>(real("actual_robot_voltage")));
  rtde::append(bytes, static_cast<std::uint8_t>(whole("tool_output_voltage")));
  for (const char* name : {"tool_output_current", "tool_temperature"})
    rtde::append(bytes, static_cast<float>(real(name)));
  rtde::append(bytes, static_cast<std::uint8_t>(whole("tool_mode")));
  return primary_package(2, bytes);
}

std::string cartesian_info(const Table& outputs) {
  std::string bytes;
  for (const char* name : {"actual_TCP_pose", "tcp_offset"}) append_all(bytes, outputs[name].real);
  return primary_package(4, bytes);
}

std::string force_mode_data(const Table& outputs) {
  std::string bytes;
  append_all(bytes, outputs["actual_TCP_force"].real);
  rtde::append(bytes, 0.0);  // dexterity of the robot
  return primary_package(7, bytes);
}

std::string additional_info(bool freedrive_allowed) {
  std::string bytes;
  rtde::append(bytes, std::uint8_t{0});  // button of the pendant
  append(bytes, freedrive_allowed);
  append(bytes, false);                  // freedrive by an input
  rtde::append(bytes, std::uint8_t{0});  // reserved
  return primary_package(8, bytes);
}

std::string tool_mode_info(const Table& outputs) {
  std::string bytes;
  for (const char* name : {"tool_output_mode", "tool_digital_output0_mode", "tool_digital_output1_mode"})
    rtde::append(bytes, static_cast<std::uint8_t>(outputs[name].whole[0]));
  return primary_package(12, bytes);
}

std::string robot_state(std::string_view sub_packages) {
  return primary_package(kRobotState, sub_packages);
}

std::string version_message(std::uint64_t timestamp_us, int major, int minor, int bugfix) {
  constexpr std::string_view kProject = "URControl";
  std::string bytes;
  rtde::append(bytes, static_cast<std::uint8_t>(kProject.size()));
  bytes.append(kProject);
  rtde::append(bytes, static_cast<std::uint8_t>(major));
  rtde::append(bytes, static_cast<std::uint8_t>(minor));
  rtde::append(bytes, static_cast<std::int32_t>(bugfix));
  rtde::append(bytes, std::int32_t{0});
  bytes.append("01-01-2024, 00:00:00");
  return robot_message(timestamp_us, 3, bytes);
}

std::string text_message(std::uint64_t timestamp_us, std::string_view text) {
  return robot_message(timestamp_us, 0, text);
}

std::string key_message(std::uint64_t timestamp_us, std::string_view title, std::string_view text) {
  title = title.substr(0, 255);
  std::string bytes;
  rtde::append(bytes, std::int32_t{0});
  rtde::append(bytes, std::int32_t{0});
  rtde::append(bytes, static_cast<std::uint8_t>(title.size()));
  bytes.append(title);
  bytes.append(text);
  return robot_message(timestamp_us, 7, bytes);
}

std::string error_code_message(std::uint64_t timestamp_us, int code, int argument, ReportLevel level,
                               std::string_view text) {
  std::string bytes;
  rtde::append(bytes, static_cast<std::int32_t>(code));
  rtde::append(bytes, static_cast<std::int32_t>(argument));
  rtde::append(bytes, static_cast<std::int32_t>(level));
  rtde::append(bytes, std::uint32_t{0});  // type of the data: none
  rtde::append(bytes, std::uint32_t{0});
  bytes.append(text);
  return robot_message(timestamp_us, 6, bytes);
}

std::string runtime_exception_message(std::uint64_t timestamp_us, int line, int column,
                                      std::string_view text) {
  std::string bytes;
  rtde::append(bytes, static_cast<std::int32_t>(line));
  rtde::append(bytes, static_cast<std::int32_t>(column));
  bytes.append(text);
  return robot_message(timestamp_us, 10, bytes);
}

std::string safety_mode_message(std::uint64_t timestamp_us, int code, std::uint8_t safety_mode) {
  std::string bytes;
  rtde::append(bytes, static_cast<std::int32_t>(code));
  rtde::append(bytes, std::int32_t{0});
  rtde::append(bytes, safety_mode);
  rtde::append(bytes, std::uint32_t{0});
  rtde::append(bytes, std::uint32_t{0});
  return robot_message(timestamp_us, 5, bytes);
}

}  // namespace takt::rtde

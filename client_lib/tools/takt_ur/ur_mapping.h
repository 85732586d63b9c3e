#pragma once
// The mapping file of takt-ur (docs/controllers.md): what belongs to the controller that takt shows.
#include <filesystem>
#include <string>
#include <vector>

#include "client_lib/gateway/mapping.h"

namespace takt::ur {

/// A program that the dashboard's `load` finds.
struct NamedProgram {
  std::string name;
  std::filesystem::path script{};  ///< URScript; empty: the external control program, which a driver serves
  std::string host{};              ///< of that driver; empty: the client that sends `play`
  int port = 50002;
};

struct UrMapping {
  gateway::RobotMapping robot;
  std::string tool;          ///< gripper at the flange: TCP and forces; empty: none
  std::string robotiq;       ///< gripper that clients of Robotiq's URCap command; empty: its port is closed
  std::string force_sensor;  ///< device on the flange that measures forces; empty: contact forces of `tool`
  Pose base_frame;           ///< X_RB: the protocol's base in the robot's base
  std::string address = "127.0.0.1";
  int rtde_port = 30004, primary_port = 30001, secondary_port = 30002, realtime_port = 30003,
      dashboard_port = 29999, robotiq_port = 63352;
  std::string model = "UR10e", serial_number = "20000000001", version = "5.21.0";
  bool remote_control = true, powered = true;
  gateway::TimeReference time = gateway::TimeReference::wall;
  double filter_rad_per_s = gateway::kFilter_rad_per_s;
  double contact_force_N = 5.0;  ///< at which tool contact is detected
  std::vector<gateway::OutputMapping> outputs;
  std::vector<gateway::InputMapping> inputs;
  std::vector<NamedProgram> programs;
  std::string reports;  ///< directory of flight reports; empty: none are written

  // Role takt-ur follow.
  struct Follow {
    double frequency_Hz = 125.0;
    bool uses_target = false;  ///< target_q in place of actual_q
    gateway::SilenceMapping silence{};
    gateway::ResynchronisationOptions first_command{};
  } follow;

  /// Where a program of the controller finds `host`: the controller itself at localhost, which may have another address here.
  std::string address_of(const std::string& host, int port) const;
  /// 3 of 5.21.0.
  std::array<int, 3> version_numbers() const;
  /// Of ConfigurationData: 1 UR5, 2 UR10, 3 UR3, ...; 0 unknown.
  int robot_type() const;
};

/// Elements of the protocol that the mapping may name.
bool is_ur_output(const std::string& name);
bool is_ur_input(const std::string& name);

/// Reads and checks a mapping against the cell. Without a file: the cell's only robot with six joints, and no signals.
/// Throws ScenarioError.
UrMapping read_ur_mapping(const std::filesystem::path& file, const CellInfo& cell);
UrMapping default_ur_mapping(const CellInfo& cell, const std::string& robot);

}  // namespace takt::ur

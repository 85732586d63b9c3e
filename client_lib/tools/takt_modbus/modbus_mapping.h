#pragma once
// The mapping file of takt-modbus (docs/plc.md).
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "client_lib/gateway/mapping.h"
#include "client_lib/gateway/modbus/table.h"

namespace takt::tool {

/// What takt is.
enum class ModbusRole { server, client };

/// What the number of an element is besides a signal or a gripper.
enum class ModbusSpecial {
  none,
  allow_step,  ///< coil: the PLC writes 1, takt writes 0 when the period is over
  step,        ///< steps since the last reset, modulo 2^32
  time_ms,     ///< simulated time, modulo 2^32 ms
  playing,     ///< the cell plays
  joint,       ///< position of a joint, rad or m
};

struct ModbusElement {
  std::string name;  ///< the address, as text
  gateway::modbus::Element place{};
  bool to_cell = false;  ///< the PLC writes it
  gateway::OutputMapping output{};
  gateway::InputMapping input{};
  ModbusSpecial special = ModbusSpecial::none;
  std::string robot, joint;
  std::size_t joint_index = 0;
  std::optional<double> substitute{};  ///< value in the cell's place of the PLC's while that is silent
};

struct ModbusMapping {
  ModbusRole role = ModbusRole::server;
  std::string address = "127.0.0.1";  ///< server: where it listens; client: the PLC
  int port = 5020;
  int unit = 0;  ///< server: 0: any
  int most_clients = 64;
  int poll_ms = 20;
  bool function_23 = false;
  double period_s = 0.01;  ///< of one step that the PLC allows
  gateway::modbus::WordOrder word_order = gateway::modbus::WordOrder::high_first;
  double deadline_s = 1.0;
  std::vector<ModbusElement> elements{};

  std::vector<gateway::modbus::Element> places() const;
  /// Grippers and devices that the PLC commands, once each.
  std::vector<std::string> targets() const;
  /// The number of an element that takt writes, at an instant.
  static double number_of(const ModbusElement& element, const State& state, bool playing);
  /// The number that stands for the present value of a place that the PLC commands.
  static double present_of(const ModbusElement& element, const State& state);
  /// Sends a number of the PLC to the cell. `commands`: a CommandSender or a LockstepController.
  template <class Commands>
  static void write(const ModbusElement& element, double number, Commands& commands) {
    if (element.special == ModbusSpecial::none) gateway::write_output(element.output, number, commands);
  }
};

/// Throws ScenarioError.
ModbusMapping read_modbus_mapping(const std::filesystem::path& file, const CellInfo& cell);

}  // namespace takt::tool

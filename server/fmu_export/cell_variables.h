#pragma once
// What a cell offers as variables of an FMU: names, types, limits, and their values in a snapshot.
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "server/simulation/model/cell_description.h"
#include "server/simulation/model/cell_model.h"
#include "server/simulation/model/snapshot.h"

namespace takt {

struct CellVariable {
  enum class Kind : std::uint8_t {
    joint_target,    ///< ROBOT.q_set[i]: input
    gripper_closed,  ///< GRIPPER.close: input
    signal_value,    ///< DEVICE.SIGNAL, a commanded one: input
    joint_position,  ///< ROBOT.q[i]
    joint_velocity,  ///< ROBOT.qd[i]
    joint_torque,    ///< ROBOT.torque[i]; 0 at level of detail 1
    gripper_width,   ///< GRIPPER.width
    gripper_force,   ///< GRIPPER.force
    part_position,   ///< PART.position[i] of frame B in W
    part_rotation,   ///< PART.quaternion[i]: x, y, z, w
    part_holder,     ///< PART.holder: number of the component, or -1
    signal,          ///< DEVICE.SIGNAL
    state_hash       ///< state_hash[1], [2]: its lower and upper 32 bits
  };
  Kind kind = Kind::signal;
  std::string name, unit, description;
  SignalType type = SignalType::real;
  bool is_input = false;
  int object = -1, element = 0;
  double lower = 0.0, upper = 0.0;  ///< of inputs
};

/// All inputs, then all outputs.
std::vector<CellVariable> cell_variables(const CellDescription& cell);
/// Value of an output, or what an input has at the start.
double value_of(const CellVariable& variable, const Snapshot& snapshot);

/// The chosen variables of an exported cell, in the order of their value references, as a file beside the scenario.
struct CellInterface {
  std::string token;
  std::vector<std::string> inputs, outputs;
};
inline constexpr const char* kInterfaceFile = "interface.txt";
inline constexpr const char* kExportedScenario = "cell.yaml";
inline constexpr const char* kExportedCache = "cache";
void write_interface(const CellInterface& interface, const std::filesystem::path& file);
/// Throws std::runtime_error.
CellInterface read_interface(const std::filesystem::path& file);

}  // namespace takt

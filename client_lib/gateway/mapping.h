#pragma once
// The mapping file of a gateway: which robot, gripper or signal of the cell belongs to which register, digital output or
// element of a protocol. Files are YAML, checked as scenario files are: an error names file, line, key, what was found
// and what is allowed. Names are checked against the cell, so that a mapping is read after the client has connected.
//
// This header has the parts that every protocol uses; each protocol describes its own file with them:
//
//   void describe(Fields& f, RsiMapping& m, const CellInfo& cell) {
//     describe_robot(f, m.robot, cell);
//     describe_silence(f, m.silence);
//     describe_outputs(f, m.outputs, cell, is_output_of_rsi, "DiO, ...");
//   }
#include <algorithm>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "client_lib/client.h"
#include "client_lib/gateway/command_sender.h"
#include "client_lib/gateway/resynchronisation.h"
#include "server/fields/fields.h"

namespace takt::gateway {

/// A robot, and how the protocol's joints belong to its own: protocol = sign * cell + offset.
struct RobotMapping {
  std::string robot;
  std::vector<std::string> order;    ///< names of the cell's joints in the protocol's order
  std::vector<double> sign, offset;  ///< of each joint of the protocol; offset in rad or m
  std::vector<std::size_t> index{};  ///< of each joint of the protocol: the cell's joint

  std::vector<double> to_protocol(std::span<const double> cell_positions) const;
  std::vector<double> to_cell(std::span<const double> protocol_positions) const;
  /// Velocities and torques: without the offset.
  std::vector<double> rates_to_protocol(std::span<const double> cell_rates) const;
  std::vector<double> rates_to_cell(std::span<const double> protocol_rates) const;
};

enum class TimeReference : std::uint8_t {
  wall,       ///< the controller's own clock, as with a real robot
  simulated,  ///< the cell's: deadlines count simulated time, so that a slow cell does not miss them
};

/// What happens when the outside controller sends nothing.
struct SilenceMapping {
  double deadline_s = 0.1;
  SafeAction action = SafeAction::stop;
};

/// An element that the outside controller writes.
struct OutputMapping {
  std::string name;                     ///< of the protocol
  std::string gripper, device, signal;  ///< a gripper, or a signal of a device
  bool sets_width = false, inverted = false;
  double scale = 1.0, offset = 0.0;
};
/// An element that it reads.
struct InputMapping {
  enum class Measure : std::uint8_t { closed, holding, in_position, moving, width, force };
  std::string name;
  std::string gripper, device, signal;
  Measure measure = Measure::holding;
  bool inverted = false;
  double scale = 1.0, offset = 0.0, threshold = 0.5;
  std::optional<double> value;  ///< a fixed one, in place of gripper and device
};

/// Keys robot, joints: order, sign, offset. Joints that are not mapped otherwise are in the cell's order. `count` 0: any
/// number of joints. When reading, the mapping is complete afterwards.
void describe_robot(Fields& f, RobotMapping& m, const CellInfo& cell, std::size_t count);
void describe_silence(Fields& f, SilenceMapping& m);
void describe_resynchronisation(Fields& f, ResynchronisationOptions& m);
void describe_time(Fields& f, TimeReference& m);
/// Key `filter_rad_per_s`: CellLinkOptions::filter_rad_per_s.
void describe_filter(Fields& f, double& filter_rad_per_s);
inline constexpr double kFilter_rad_per_s = 60.0;

/// Whether the protocol has an element of this name.
using IsElement = std::function<bool(const std::string&)>;
/// Section `outputs` / `inputs`: elements by name. `allowed` names the protocol's elements in errors.
void describe_outputs(Fields& f, std::vector<OutputMapping>& outputs, const CellInfo& cell,
                      const IsElement& is_element, const char* allowed);
void describe_inputs(Fields& f, std::vector<InputMapping>& inputs, const CellInfo& cell,
                     const IsElement& is_element, const char* allowed);

/// One element. `others`: keys that may stand in place of gripper and device.
void describe_output(Fields& f, OutputMapping& output, const CellInfo& cell,
                     const std::vector<std::string>& others = {});
void describe_input(Fields& f, InputMapping& input, const CellInfo& cell,
                    const std::vector<std::string>& others = {});

/// Sends a value that the controller has written: 0 and 1 of a digital element. `commands` is a CommandSender or a
/// LockstepController.
template <class Commands>
void write_output(const OutputMapping& output, double value, Commands& commands) {
  const bool on = (value != 0.0) != output.inverted;
  if (!output.gripper.empty() && output.sets_width)
    commands.grip(output.gripper, GripperAction::width, std::max(0.0, output.scale * value + output.offset));
  else if (!output.gripper.empty())
    commands.grip(output.gripper, on ? GripperAction::close : GripperAction::open);
  else
    commands.set_signals(
        output.device,
        {{output.signal, output.scale * (output.inverted ? (on ? 1.0 : 0.0) : value) + output.offset}});
}
/// The value of an input at an instant.
double number_of(const InputMapping& input, const State& state);
bool digital(const InputMapping& input, const State& state);

/// Names of robots, grippers and devices that the mappings command, once each. `robot` empty: none.
std::vector<std::string> targets_of(const std::string& robot, const std::vector<OutputMapping>& outputs);

}  // namespace takt::gateway

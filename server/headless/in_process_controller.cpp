#include "server/headless/in_process_controller.h"

#include <stdexcept>

#include "idl/common/lockstep.h"
#include "server/messages/description_message.h"

namespace takt {

InProcessController::InProcessController(const std::string& program_file, const Simulation& simulation,
                                         const controller::Parameters& parameters)
    : description_(to_message(simulation.description(), "")),
      controller_(program_file, description_, parameters),
      view_(simulation),
      step_s_(simulation.description().step_s) {
  commands_.reserve(controller_.driven_robots().size() + controller_.driven_grippers().size() +
                    controller_.driven_devices().size());
  for (const int device : controller_.driven_devices()) device_commands_.push_back({{device, {}, {}}, {}});
}

DeviceCommand InProcessController::validated(const controller::DeviceSetPoint& set_point,
                                             const CellDescription& cell) const {
  DeviceCommand command;
  command.device = set_point.device;
  for (std::size_t i = 0; i < set_point.signals.size(); ++i) {
    if (const auto rejection = add_signal(cell, command, set_point.signals[i], set_point.values[i]))
      throw std::runtime_error("the program's command for " + rejection->subject + ": " + rejection->message);
  }
  return command;
}

std::span<const Command> InProcessController::commands(const Simulation& simulation) {
  commands_.clear();
  if (simulation.step_index() != period_boundary_step(boundary_, controller_.period_s(), step_s_))
    return commands_;
  const auto stamp = SimTime::from_seconds(static_cast<double>(boundary_) * controller_.period_s());
  // A period shorter than the step: several boundaries fall on one step, the program runs once.
  while (period_boundary_step(boundary_, controller_.period_s(), step_s_) <= simulation.step_index())
    ++boundary_;
  view_.look_at(simulation);
  const controller::Output& output = controller_.update(view_);
  finished_ = output.finished;
  for (const controller::JointSetPoint& set_point : output.joints) {
    JointCommand command;
    command.robot = set_point.robot;
    command.stamp = stamp;
    command.period_s = controller_.period_s();
    command.has_velocity = true;
    command.position = set_point.position;
    command.velocity = set_point.velocity;
    commands_.emplace_back(command);
  }
  for (const controller::GripperSetPoint& set_point : output.grippers) {
    commands_.emplace_back(
        GripperCommand{set_point.gripper, stamp, set_point.verb, set_point.width_m, set_point.max_force_N});
  }
  for (std::size_t i = 0; i < output.devices.size(); ++i) {
    const controller::DeviceSetPoint& set_point = output.devices[i];
    auto& [checked, command] = device_commands_[i];
    if (checked.signals != set_point.signals || checked.values != set_point.values) {
      command = validated(set_point, simulation.description());
      checked = set_point;
    }
    command.device = set_point.device;
    command.stamp = stamp;
    commands_.emplace_back(command);
  }
  return commands_;
}

}  // namespace takt

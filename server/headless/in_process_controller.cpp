#include "server/headless/in_process_controller.h"

#include <stdexcept>

namespace takt {

controller::CellInfo controller_cell_info(const CellDescription& cell) {
  controller::CellInfo info;
  for (const RobotDescription& robot : cell.robots)
    info.robots.push_back({robot.name, robot.arm, robot.X_WR});
  for (const GripperDescription& gripper : cell.grippers) {
    info.grippers.push_back(
        {gripper.name, gripper.robot, gripper.X_FG * gripper.X_GT, gripper.max_width_m, gripper.max_force_N});
  }
  for (const DeviceDescription& device : cell.devices) {
    controller::DeviceInfo& added = info.devices.emplace_back();
    added.name = device.name;
    for (const SignalDescription& signal : device.signals) added.signals.push_back(signal.name);
  }
  for (const ComponentDescription& component : cell.components) info.components.push_back(component.name);
  return info;
}

void fill_controller_input(const Snapshot& snapshot, controller::Input& input) {
  input.time_s = snapshot.time_s;
  input.robots.resize(snapshot.robots.size());
  input.grippers.resize(snapshot.grippers.size());
  input.components.resize(snapshot.components.size());
  for (std::size_t i = 0; i < snapshot.robots.size(); ++i) {
    input.robots[i] = {snapshot.robots[i].position, snapshot.robots[i].velocity};
  }
  for (std::size_t i = 0; i < snapshot.grippers.size(); ++i) {
    const GripperSample& sample = snapshot.grippers[i];
    input.grippers[i] = {sample.width_m,     sample.closed, sample.moving,
                         sample.in_position, sample.part,   sample.force_N};
  }
  for (std::size_t i = 0; i < snapshot.components.size(); ++i) {
    const ComponentSample& sample = snapshot.components[i];
    input.components[i] = {sample.p_WB, sample.q_WB, sample.partner};
  }
  input.devices.resize(snapshot.devices.size());
  for (std::size_t i = 0; i < snapshot.devices.size(); ++i)
    input.devices[i].assign(snapshot.devices[i].signals.begin(), snapshot.devices[i].signals.end());
}

InProcessController::InProcessController(const std::string& program_file, const Simulation& simulation,
                                         const controller::Parameters& parameters)
    : controller_(program_file, controller_cell_info(simulation.description()), parameters),
      step_s_(simulation.description().step_s),
      snapshot_(simulation.make_snapshot()) {
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
  simulation.read_snapshot(snapshot_);
  fill_controller_input(snapshot_, input_);
  const controller::Output& output = controller_.update(input_);
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

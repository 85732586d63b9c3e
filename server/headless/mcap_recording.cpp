#include "server/headless/mcap_recording.h"

#include <algorithm>
#include <stdexcept>

#include "idl/common/cdr.h"
#include "idl/common/lockstep.h"
#include "idl/common/stamp.h"
#include "server/messages/description_message.h"
#include "server/messages/status_messages.h"
#include "server/scenario/contact_pair_names.h"
#include "server/simulation/model/cell_model.h"

namespace takt {
namespace {

constexpr double kFrames_s = 0.02, kStatus_s = 0.1;

}  // namespace

McapRecording::McapRecording(const std::filesystem::path& file, const Simulation& simulation,
                             McapRecordingOptions options)
    : writer_(file, options.version, options.compression),
      cell_(simulation.description().cell.empty() ? "cell" : simulation.description().cell),
      options_(std::move(options)),
      instant_(simulation.description()),
      frames_(simulation.description()),
      elements_(simulation.model().contact) {
  const CellDescription& cell = simulation.description();
  std::vector<std::string> unknown;
  pressure_pairs_ = find_contact_pairs(simulation.model().contact, cell, options_.pressures, &unknown);
  if (!unknown.empty())
    throw std::invalid_argument(
        "no pair in surface contact is called '" + unknown.front() +
        "'; names are BASE-TARGET as takt contacts lists them, * stands for any characters");
  takt_msgs::msg::CellDescription description = to_message(cell, options_.version);
  description.cell = cell_;
  write(add_channel(topics::description), description);
  instant_.for_each([&](const auto& topic, const auto&, bool) {
    // Others from their first content on.
    instant_channels_.push_back(topic.id == topics::state.id ? add_channel(topic) : std::uint16_t{0});
  });
  event_channel_ = add_channel(topics::event);
  status_channel_ = add_channel(topics::status);
  tf_channel_ = add_channel(topics::tf);
  tf_static_channel_ = add_channel(topics::tf_static);
  if (!pressure_pairs_.empty()) pressures_channel_ = add_channel(topics::contact_pressures);
  for (const RobotDescription& robot : cell.robots) {
    joint_channels_.push_back(add_channel(topics::joint_states, robot.name));
    joints_.push_back(make_joint_states_message(robot));
  }
  for (std::size_t device = 0; device < cell.devices.size(); ++device)
    if (has_wrench(cell.devices[device]))
      wrenches_.push_back({device, add_channel(topics::wrench, cell.devices[device].name), {}});
}

template <typename Type>
std::uint16_t McapRecording::add_channel(const Topic<Type>& topic, std::string_view element) {
  return writer_.add_channel("/" + topic.name(cell_, element), recording::known_types(),
                             std::string(topic.type->name), recording::offered_qos(topic));
}

template <typename Type>
void McapRecording::write(std::uint16_t channel, const Type& message) {
  if (!cdr::write(message, sample_))
    throw recording::RecordingError("A sample of " + std::string(message_info<Type>().name) +
                                    " is longer than its type allows.");
  writer_.write(channel, now_ns_, now_ns_, sample_);
}

void McapRecording::record(const Simulation& simulation) {
  const CellDescription& cell = simulation.description();
  const auto due = [&](std::uint64_t& next, double period_s) {
    if (simulation.step_index() < period_boundary_step(next, period_s, cell.step_s)) return false;
    while (simulation.step_index() >= period_boundary_step(next, period_s, cell.step_s)) ++next;
    return true;
  };
  if (!due(next_, options_.period_s)) return;
  const bool first = now_ns_ == 0 && next_frames_ == 0;
  snapshot_ = simulation.make_snapshot();
  now_ns_ = static_cast<std::uint64_t>(to_nanoseconds(snapshot_.time_s));
  if (first) write(tf_static_channel_, to_message(static_frames(cell, snapshot_), snapshot_.time_s));
  instant_.fill(snapshot_);
  std::size_t index = 0;
  instant_.for_each([&](const auto& topic, const auto& message, bool sent) {
    std::uint16_t& channel = instant_channels_[index++];
    if (!sent) return;
    if (channel == 0) channel = add_channel(topic);
    write(channel, message);
  });
  for (std::size_t robot = 0; robot < joints_.size(); ++robot) {
    fill(joints_[robot], snapshot_, robot);
    write(joint_channels_[robot], joints_[robot]);
  }
  for (WrenchChannel& sensor : wrenches_) {
    fill(sensor.message, cell, snapshot_, sensor.device);
    write(sensor.channel, sensor.message);
  }
  if (!pressure_pairs_.empty()) {
    fill(pressures_, cell, snapshot_, elements_.read(snapshot_, pressure_pairs_));
    write(pressures_channel_, pressures_);
  }
  if (due(next_frames_, kFrames_s)) write(tf_channel_, frames_.fill(snapshot_));
  if (due(next_status_, kStatus_s)) write_status(simulation, times_.now());
}

/// A run has no schedule: lag, overruns and latencies are zero, and a rejected command ends it.
void McapRecording::write_status(const Simulation& simulation, const RunTimes& times) {
  LoopStatus status;
  fill(status, simulation);
  status.state = SimulationState::playing;
  status.pace = options_.pace;
  status.pace_factor = options_.factor;
  status.wall_time_s = times.wall_s;
  status.real_time_factor = times.real_time_factor(simulation.time_s());
  status.computation_ratio = times.computation_ratio(simulation.time_s());
  for (const auto& applied : instant_.state().applied) status.commands_applied += applied.count;
  status.fault.assign(simulation.fault());
  status.contact_pairs =
      static_cast<std::uint32_t>(snapshot_.contacts.pressing().size() + snapshot_.contacts.omitted);
  write(status_channel_, to_message(status, simulation.description()));
}

void McapRecording::close(const Simulation& simulation, const RunTimes& times) {
  now_ns_ = static_cast<std::uint64_t>(to_nanoseconds(simulation.time_s()));
  write_status(simulation, times);
  writer_.close();
}

void McapRecording::record(takt_msgs::msg::Event event) {
  now_ns_ = static_cast<std::uint64_t>(nanoseconds_of(event.stamp));
  event.sequence_number = ++events_;
  write(event_channel_, event);
}

}  // namespace takt

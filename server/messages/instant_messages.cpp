#include "server/messages/instant_messages.h"

#include <algorithm>

#include "idl/common/eigen_messages.h"
#include "idl/common/stamp.h"
#include "server/runtime/requests/control.h"

namespace takt {
namespace {

/// The common header of all messages of an instant.
template <typename Type>
void fill_header(Type& message, const Snapshot& snapshot) {
  message.stamp = to_time(snapshot.time_s);
  message.time = snapshot.time_s;
  message.step = snapshot.step;
  message.epoch = snapshot.epoch;
}

void fill_devices(takt_msgs::msg::CellState& message, const CellDescription& cell, const Snapshot& snapshot) {
  for (std::size_t i = 0; i < snapshot.devices.size(); ++i) {
    const DeviceSample& sample = snapshot.devices[i];
    auto& signals = message.devices[i].signals;
    std::copy_n(sample.signals.begin(), signals.size(), signals.begin());
    message.devices[i].forced = sample.forced;
    auto& applied = message.applied[cell.robots.size() + cell.grippers.size() + i];
    applied.count = sample.commands_applied;
    applied.newest_stamp = to_stamp(std::max(sample.newest_stamp.ns, std::int64_t{0}));
  }
}

}  // namespace

takt_msgs::msg::CellState make_state_message(const CellDescription& cell) {
  takt_msgs::msg::CellState message;
  message.scenario_generation = cell.scenario_generation;
  message.components.resize(cell.components.size());
  message.robots.resize(cell.robots.size());
  message.grippers.resize(cell.grippers.size());
  message.devices.resize(cell.devices.size());
  for (std::size_t i = 0; i < cell.devices.size(); ++i)
    message.devices[i].signals.resize(cell.devices[i].signals.size());
  for (std::size_t i = 0; i < cell.robots.size(); ++i) {
    const auto joints = static_cast<std::size_t>(cell.robots[i].arm.joint_count());
    message.robots[i].position.resize(joints);
    message.robots[i].velocity.resize(joints);
    message.robots[i].effort.resize(joints);
    message.robots[i].motor_power.reserve(joints);
  }
  const auto append_targets = [&](const auto& targets) {
    for (const auto& target : targets) message.applied.emplace_back().target = target.name;
  };
  append_targets(cell.robots);
  append_targets(cell.grippers);
  append_targets(cell.devices);
  return message;
}

void fill_instant(takt_msgs::msg::CellState& message, const Snapshot& snapshot) {
  fill_header(message, snapshot);
  message.state_hash = snapshot.state_hash;
}

void fill(takt_msgs::msg::ComponentState& message, const ComponentSample& sample) {
  message.position = to_vector(sample.p_WB);
  message.orientation = to_quaternion(sample.q_WB);
  message.linear_velocity = to_vector(sample.V_WB.v);
  message.angular_velocity = to_vector(sample.V_WB.w);
  message.force = to_vector(sample.F_Bo_W.f);
  message.torque = to_vector(sample.F_Bo_W.t);
  message.state = sample.state;
  message.partner = sample.partner;
}

void fill(takt_msgs::msg::CellState& message, const CellDescription& cell, const Snapshot& snapshot) {
  fill_instant(message, snapshot);
  for (std::size_t i = 0; i < snapshot.components.size(); ++i)
    fill(message.components[i], snapshot.components[i]);
  fill_machines(message, cell, snapshot);
}

void fill_machines(takt_msgs::msg::CellState& message, const CellDescription& cell,
                   const Snapshot& snapshot) {
  for (std::size_t i = 0; i < snapshot.robots.size(); ++i) {
    const RobotSample& sample = snapshot.robots[i];
    auto& robot = message.robots[i];
    std::copy_n(sample.position.begin(), robot.position.size(), robot.position.begin());
    std::copy_n(sample.velocity.begin(), robot.velocity.size(), robot.velocity.begin());
    std::copy_n(sample.effort.begin(), robot.effort.size(), robot.effort.begin());
    robot.motor_power.resize(sample.level_of_detail > 1 ? robot.position.size() : 0);
    std::copy_n(sample.power.mechanical_W.begin(), robot.motor_power.size(), robot.motor_power.begin());
    message.applied[i].count = sample.commands_applied;
    message.applied[i].newest_stamp = to_stamp(std::max(sample.newest_stamp.ns, std::int64_t{0}));
  }
  for (std::size_t i = 0; i < snapshot.grippers.size(); ++i) {
    const GripperSample& sample = snapshot.grippers[i];
    auto& gripper = message.grippers[i];
    gripper.width = sample.width_m;
    gripper.force = sample.force_N;
    gripper.closed = sample.closed;
    gripper.moving = sample.moving;
    gripper.in_position = sample.in_position;
    gripper.part = sample.part;
    gripper.forced = sample.forced;
    auto& applied = message.applied[cell.robots.size() + i];
    applied.count = sample.commands_applied;
    applied.newest_stamp = to_stamp(std::max(sample.newest_stamp.ns, std::int64_t{0}));
  }
  fill_devices(message, cell, snapshot);
}

namespace {

std::size_t count_consumers(const CellDescription& cell, const Snapshot& snapshot) {
  std::size_t count = 0;
  for (const RobotSample& sample : snapshot.robots) count += sample.level_of_detail > 1 ? 1U : 0U;
  for (const DeviceDescription& device : cell.devices) count += device.meter() ? 1U : 0U;
  return count;
}

}  // namespace

bool has_content(const takt_msgs::msg::CellState&, const CellDescription&, const Snapshot&) {
  return true;
}

bool has_content(const takt_msgs::msg::Power&, const CellDescription& cell, const Snapshot& snapshot) {
  return count_consumers(cell, snapshot) > 0;
}

bool has_content(const takt_msgs::msg::Contacts&, const CellDescription&, const Snapshot& snapshot) {
  return snapshot.contacts.acting;
}

void fill(takt_msgs::msg::Power& message, const CellDescription& cell, const Snapshot& snapshot) {
  fill_header(message, snapshot);
  message.consumers.resize(count_consumers(cell, snapshot));
  std::size_t place = 0;
  for (std::size_t i = 0; i < snapshot.robots.size(); ++i) {
    const RobotSample& sample = snapshot.robots[i];
    if (sample.level_of_detail <= 1) continue;
    takt_msgs::msg::PowerConsumer& consumer = message.consumers[place++];
    consumer.name = cell.robots[i].name;
    std::size_t joints = cell.robots[i].arm.joints.size();
    for (const GripperDescription& gripper : cell.grippers)
      if (gripper.robot == static_cast<int>(i)) joints += 2;
    consumer.mechanical_power.resize(joints);
    std::copy_n(sample.power.mechanical_W.begin(), joints, consumer.mechanical_power.begin());
    consumer.mechanical_total = sample.power.mechanical_total_W;
    consumer.electrical_power = sample.power.electrical_W;
    consumer.mechanical_energy = sample.power.mechanical_energy_J;
    consumer.electrical_energy = sample.power.electrical_energy_J;
  }
  for (std::size_t i = 0; i < cell.devices.size(); ++i) {
    const auto meter = cell.devices[i].meter();
    if (!meter) continue;
    takt_msgs::msg::PowerConsumer& consumer = message.consumers[place++];
    consumer.name = cell.devices[i].name;
    consumer.mechanical_power.clear();
    consumer.mechanical_total = 0.0;
    consumer.electrical_power = snapshot.devices[i].signals[meter->power];
    consumer.mechanical_energy = 0.0;
    consumer.electrical_energy = snapshot.devices[i].signals[meter->energy];
  }
}

takt_msgs::msg::Contact to_message(const ContactSample& sample) {
  return {resultant_of(sample, 1.0), sample.base, sample.target};
}

void fill(takt_msgs::msg::Contacts& message, const CellDescription& cell, const Snapshot& snapshot) {
  fill_header(message, snapshot);
  message.scenario_generation = cell.scenario_generation;
  const std::span<const ContactSample> pressing = snapshot.contacts.pressing();
  message.contacts.resize(pressing.size());
  for (std::size_t i = 0; i < pressing.size(); ++i) message.contacts[i] = to_message(pressing[i]);
  message.omitted = snapshot.contacts.omitted;
}

InstantMessages::InstantMessages(const CellDescription& cell, std::size_t contact_capacity)
    : cell_(cell), all_({topics::state, make_state_message(cell)}, {topics::power}, {topics::contacts}) {
  std::get<1>(all_).message.consumers.reserve(cell.robots.size() + cell.devices.size());
  std::get<2>(all_).message.contacts.resize(contact_capacity);
}

void InstantMessages::fill(const Snapshot& snapshot) {
  for_each([&](const auto&, auto& message, bool& sent) {
    sent = sent || has_content(message, cell_, snapshot);
    takt::fill(message, cell_, snapshot);
  });
}

sensor_msgs::msg::JointState make_joint_states_message(const RobotDescription& robot) {
  sensor_msgs::msg::JointState message;
  message.header.frame_id = base_frame(robot);
  for (const auto& joint : robot.arm.joints) message.name.push_back(joint.name);
  message.position.resize(robot.arm.joints.size());
  message.velocity.resize(robot.arm.joints.size());
  message.effort.resize(robot.arm.joints.size());
  return message;
}

void fill(sensor_msgs::msg::JointState& message, const Snapshot& snapshot, std::size_t robot) {
  const RobotSample& sample = snapshot.robots[robot];
  message.header.stamp = to_time(snapshot.time_s);
  std::copy_n(sample.position.begin(), message.position.size(), message.position.begin());
  std::copy_n(sample.velocity.begin(), message.velocity.size(), message.velocity.begin());
  std::copy_n(sample.effort.begin(), message.effort.size(), message.effort.begin());
}

bool has_wrench(const DeviceDescription& device) {
  return device.type == "force_torque_sensors";
}

void fill(geometry_msgs::msg::WrenchStamped& message, const CellDescription& cell, const Snapshot& snapshot,
          std::size_t device) {
  const auto& values = snapshot.devices[device].signals;
  message.header.stamp = to_time(snapshot.time_s);
  if (message.header.frame_id.empty()) message.header.frame_id = cell.devices[device].name;
  message.wrench.force = {values[0], values[1], values[2]};
  message.wrench.torque = {values[3], values[4], values[5]};
}

void fill(takt_msgs::msg::ContactPressures& message, const CellDescription& cell, const Snapshot& snapshot,
          const std::vector<PressedPair>& pairs) {
  fill_header(message, snapshot);
  message.scenario_generation = cell.scenario_generation;
  message.pairs.resize(pairs.size());
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    takt_msgs::msg::ContactPressure& pair = message.pairs[i];
    pair.base = pairs[i].base;
    pair.target = pairs[i].target;
    pair.largest_pressure = pairs[i].largest_pressure_Pa;
    pair.omitted = static_cast<std::uint32_t>(pairs[i].omitted);
    pair.corners.clear();
    pair.pressures.clear();
    for (const PressedElement& element : pairs[i].elements) {
      for (const Vec3& corner : element.corner_B)
        for (const double value : corner) pair.corners.push_back(static_cast<float>(value));
      pair.pressures.push_back(static_cast<float>(element.pressure_Pa));
    }
  }
}

namespace {

void place(geometry_msgs::msg::TransformStamped& message, const CellFrame& frame,
           const builtin_interfaces::msg::Time& stamp) {
  message.header.stamp = stamp;
  auto& transform = message.transform;
  transform.translation = {frame.p.x(), frame.p.y(), frame.p.z()};
  transform.rotation = {frame.q.x(), frame.q.y(), frame.q.z(), frame.q.w()};
}

}  // namespace

tf2_msgs::msg::TFMessage to_message(const std::vector<CellFrame>& frames, double time_s) {
  tf2_msgs::msg::TFMessage message;
  for (const CellFrame& frame : frames) {
    auto& transform = message.transforms.emplace_back();
    transform.header.frame_id = frame.parent;
    transform.child_frame_id = frame.name;
    place(transform, frame, to_time(time_s));
  }
  return message;
}

MovingFramesMessage::MovingFramesMessage(const CellDescription& cell)
    : frames_(cell), message_(to_message(frames_.frames(), 0.0)) {}

tf2_msgs::msg::TFMessage& MovingFramesMessage::fill(const Snapshot& snapshot) {
  const std::vector<CellFrame>& frames = frames_.fill(snapshot);
  const builtin_interfaces::msg::Time stamp = to_time(snapshot.time_s);
  for (std::size_t i = 0; i < frames.size(); ++i) place(message_.transforms[i], frames[i], stamp);
  return message_;
}

}  // namespace takt

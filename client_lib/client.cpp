#include "client_lib/client.h"

#include <cmath>
#include <cstdlib>

#include "client_lib/client_impl.h"
#include "idl/common/stamp.h"
#include "idl/common/text.h"
#include "idl/transport/rtps_guard/packet_cork.h"

namespace takt {
namespace {

void require_finite(double value, const std::string& what) {
  if (!std::isfinite(value))
    throw ClientError(ClientError::Kind::invalid,
                      what + " is " + exact_text(value) + "; it must be a finite number.");
}

builtin_interfaces::msg::Time stamp(std::optional<double> stamp_s) {
  if (!stamp_s) return {};
  if (!(*stamp_s >= 0.0 && *stamp_s <= 2147483647.0))
    throw ClientError(ClientError::Kind::invalid,
                      "The stamp " + exact_text(*stamp_s) + " s is not a time between 0 and 2147483647 s.");
  return to_stamp(to_nanoseconds(*stamp_s));
}

}  // namespace

std::string ClientOptions::default_cell() {
  const char* name = std::getenv("TAKT_CELL");
  return name != nullptr && *name != '\0' ? name : "cell";
}

std::string ClientOptions::default_secure_directory() {
  const char* directory = std::getenv("TAKT_SECURE");
  return directory != nullptr ? directory : "";
}

int ClientOptions::default_domain() {
  const char* domain = std::getenv("TAKT_DOMAIN");
  if (domain == nullptr || *domain == '\0') return 0;
  char* end = nullptr;
  const long value = std::strtol(domain, &end, 10);
  if (*end != '\0' || value < 0 || value > 232)
    throw ClientError(ClientError::Kind::invalid, std::string("The environment variable TAKT_DOMAIN is '") +
                                                      domain + "'; allowed is a number from 0 to 232.");
  return static_cast<int>(value);
}

// With lost packets Fast DDS 2.9.1 may lose the announcements of a server's endpoints for good; a new participant gets them.
Client::Client(ClientOptions options) {
  const auto deadline = Impl::deadline_after(options.timeout);
  Clock::duration patience = std::chrono::seconds(8);
  for (bool connected = false; !connected; patience *= 2) {
    impl_.reset();  // ahead of the next one: a participant is a place in the domain
    impl_ = std::make_unique<Impl>(options);
    connected = impl_->connect(deadline, patience);
  }
}
Client::~Client() = default;

const std::string& Client::client_id() const {
  return impl_->id;
}

std::shared_ptr<const CellInfo> Client::cell() const {
  const std::lock_guard lock(impl_->mutex);
  return impl_->cell;
}

Client::Clock::time_point Client::deadline_after(std::optional<Seconds> timeout) const {
  return Impl::deadline_after(timeout.value_or(impl_->options.timeout));
}

State Client::state() const {
  std::unique_lock lock(impl_->mutex);
  if (!impl_->wait(lock, deadline_after({}), [&] { return impl_->state->newest() != nullptr; }))
    throw ClientError(ClientError::Kind::timeout,
                      impl_->where() + " has not sent a state" +
                          (impl_->cell->scenario.empty() ? ": no scenario is loaded." : "."));
  return *impl_->state->newest();
}

Status Client::status() const {
  std::unique_lock lock(impl_->mutex);
  if (!impl_->wait(lock, deadline_after({}), [&] { return impl_->status->newest() != nullptr; }))
    throw ClientError(ClientError::Kind::timeout, impl_->where() + " has not sent its status.");
  return *impl_->status->newest();
}

bool Client::connected() const {
  const std::lock_guard lock(impl_->mutex);
  return !impl_->gone && !impl_->silent(Clock::now());
}

std::string Client::dropped_packets() const {
  return impl_->link.guard().summary();
}

bool Client::wait_for_connection(Seconds timeout) const {
  impl_->require_own_process();
  const auto deadline = Impl::deadline_after(timeout);
  std::unique_lock lock(impl_->mutex);
  for (;;) {
    if (!impl_->gone && impl_->status->newest() != nullptr && !impl_->silent(Clock::now())) return true;
    if (Clock::now() >= deadline) return false;
    impl_->changed.wait_until(lock, std::min(deadline, Clock::now() + std::chrono::milliseconds{200}));
    if (!impl_->options.while_waiting) continue;
    lock.unlock();
    impl_->options.while_waiting();
    lock.lock();
  }
}

void Client::send_joint_command(const std::string& robot, const std::vector<double>& positions,
                                const std::vector<double>& velocities, std::optional<double> stamp_s,
                                const std::vector<double>& efforts) {
  const auto known = cell();
  const auto& joints = known->robots[require_by_name("robot", known->robots, robot)].joints;
  const auto none_or_all = [&](const std::vector<double>& values) {
    return values.empty() || values.size() == joints.size();
  };
  if (positions.size() != joints.size() || !none_or_all(velocities) || !none_or_all(efforts))
    throw ClientError(ClientError::Kind::invalid,
                      "Robot '" + robot + "' has " + std::to_string(joints.size()) + " joints (" +
                          list_names(joints) + "); the command has " + std::to_string(positions.size()) +
                          " positions, " + std::to_string(velocities.size()) + " velocities and " +
                          std::to_string(efforts.size()) +
                          " efforts (of the latter two none, or one for each joint).");
  for (std::size_t i = 0; i < joints.size(); ++i) {
    require_finite(positions[i], "The position of joint '" + joints[i].name + "' of robot '" + robot + "'");
    if (!velocities.empty())
      require_finite(velocities[i],
                     "The velocity of joint '" + joints[i].name + "' of robot '" + robot + "'");
    if (!efforts.empty())
      require_finite(efforts[i], "The effort of joint '" + joints[i].name + "' of robot '" + robot + "'");
  }
  sensor_msgs::msg::JointState sample;
  sample.header.stamp = stamp(stamp_s);
  for (const auto& joint : joints) sample.name.push_back(joint.name);
  sample.position = positions;
  sample.velocity = velocities;
  sample.effort = efforts;
  impl_->command(topics::joint_commands, robot, std::move(sample));
}

void Client::send_joint_torques(const std::string& robot, const std::vector<double>& torques,
                                std::optional<double> stamp_s) {
  const auto known = cell();
  const auto& joints = known->robots[require_by_name("robot", known->robots, robot)].joints;
  if (torques.size() != joints.size())
    throw ClientError(ClientError::Kind::invalid, "Robot '" + robot + "' has " +
                                                      std::to_string(joints.size()) + " joints (" +
                                                      list_names(joints) + "); the command has " +
                                                      std::to_string(torques.size()) + " torques.");
  sensor_msgs::msg::JointState sample;
  sample.header.stamp = stamp(stamp_s);
  for (std::size_t i = 0; i < joints.size(); ++i) {
    require_finite(torques[i], "The torque of joint '" + joints[i].name + "' of robot '" + robot + "'");
    sample.name.push_back(joints[i].name);
  }
  sample.effort = torques;
  impl_->command(topics::joint_commands, robot, std::move(sample));
}

void Client::send_trajectory(const std::string& robot, const std::vector<TrajectoryPoint>& points,
                             std::optional<double> start_s) {
  const auto known = cell();
  const auto& joints = known->robots[require_by_name("robot", known->robots, robot)].joints;
  trajectory_msgs::msg::JointTrajectory sample;
  sample.header.stamp = stamp(start_s);
  for (const auto& joint : joints) sample.joint_names.push_back(joint.name);
  for (const TrajectoryPoint& point : points) {
    const std::string where = "point " + std::to_string(sample.points.size() + 1) + " for '" + robot + "'";
    if (!(point.time_s >= 0.0 && point.time_s <= 2147483647.0))
      throw ClientError(ClientError::Kind::invalid, "The time of " + where + ", " + exact_text(point.time_s) +
                                                        " s, is not between 0 and 2147483647 s.");
    for (const auto* values : {&point.positions, &point.velocities, &point.accelerations, &point.efforts}) {
      if (values->size() != joints.size() && !(values->empty() && values != &point.positions))
        throw ClientError(ClientError::Kind::invalid,
                          "Robot '" + robot + "' has " + std::to_string(joints.size()) + " joints (" +
                              list_names(joints) + "); " + where + " has " + std::to_string(values->size()) +
                              " positions, velocities, accelerations or efforts.");
      for (const double value : *values) require_finite(value, "A value of " + where);
    }
    auto& sent = sample.points.emplace_back();
    const auto time = to_stamp(to_nanoseconds(point.time_s));
    sent.time_from_start = {time.sec, time.nanosec};
    sent.positions = point.positions;
    sent.velocities = point.velocities;
    sent.accelerations = point.accelerations;
    sent.effort = point.efforts;
  }
  impl_->send(topics::joint_trajectory, robot, sample);
}

void Client::set_signals(const std::string& device, const std::map<std::string, double>& signals,
                         std::optional<double> stamp_s) {
  (void)require_by_name("device", cell()->devices, device);
  takt_msgs::msg::DeviceCommand sample;
  sample.stamp = stamp(stamp_s);
  for (const auto& [name, value] : signals) {
    require_finite(value, "The signal '" + name.substr(0, 100) + "' for device '" + device + "'");
    if (name.size() > 128 || sample.signals.size() == 32)
      throw ClientError(ClientError::Kind::invalid, "Device '" + device +
                                                        "' takes at most 32 signals at once, with names of "
                                                        "at most 128 characters.");
    sample.signals.emplace_back(name);
    sample.values.push_back(value);
  }
  impl_->command(topics::device_command, device, std::move(sample));
}

void Client::set_gripper(const std::string& gripper, GripperAction action, double width_m, double max_force_N,
                         std::optional<double> stamp_s) {
  (void)require_by_name("gripper", cell()->grippers, gripper);
  require_finite(width_m, "The width for gripper '" + gripper + "'");
  require_finite(max_force_N, "The force for gripper '" + gripper + "'");
  takt_msgs::msg::GripperCommand sample;
  sample.stamp = stamp(stamp_s);
  sample.action = action;
  sample.width = width_m;
  sample.max_force = max_force_N;
  impl_->command(topics::gripper_command, gripper, std::move(sample));
}

void Client::send_together(const std::function<void()>& send) {
  Impl::CommandBatch batch(*impl_);
  send();
  batch.send();
}

void Client::publish(const std::string& robot, const takt_msgs::msg::Program& program) {
  impl_->publish(topics::program, robot, program);
}

void Client::publish(const std::string& robot, const takt_msgs::msg::ProgramSteps& steps) {
  impl_->publish(topics::program_steps, robot, steps);
}

}  // namespace takt

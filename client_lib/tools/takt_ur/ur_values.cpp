// Inputs, outputs and published values of UrController.
#include <algorithm>
#include <cmath>

#include "client_lib/kinematics/arm.h"
#include "client_lib/tools/takt_ur/ur_controller.h"

namespace takt::ur {
namespace {

constexpr double kFullScale_V = 10.0;

// Values of joint_mode.
constexpr std::int64_t kJointPowerOff = 239, kJointBooting = 247, kJointRunning = 253, kJointIdle = 255;

std::int64_t joint_mode(RobotMode mode) {
  switch (mode) {
    case RobotMode::power_off:
      return kJointPowerOff;
    case RobotMode::power_on:
      return kJointBooting;
    case RobotMode::idle:  // the brakes hold
      return kJointIdle;
    case RobotMode::running:
      break;
  }
  return kJointRunning;
}

Vec3 vec(const takt_msgs::msg::Vector3& v) {
  return {v.x, v.y, v.z};
}

}  // namespace

void UrController::write_element(const std::string& name, double value) {
  for (const gateway::OutputMapping& output : mapping_.outputs)
    if (output.name == name) gateway::write_output(output, value, link_.sender());
}

void UrController::set_digital_output(int number, bool value) {
  if (number < 0 || number > 17) return;
  const std::uint64_t bit = std::uint64_t{1} << static_cast<unsigned>(number);
  if (((digital_outputs_ & bit) != 0) == value) return;  // a command is sent for a change alone
  digital_outputs_ = value ? digital_outputs_ | bit : digital_outputs_ & ~bit;
  const char* stem = number < 8    ? "standard_digital_output_"
                     : number < 16 ? "configurable_digital_output_"
                                   : "tool_digital_output_";
  write_element(stem + std::to_string(number < 16 ? number % 8 : number - 16), value ? 1.0 : 0.0);
}

std::string UrController::robotiq_answer(std::string_view line) {
  const CellInfo& cell = *link_.cell();
  const auto& info = cell.grippers.at(static_cast<std::size_t>(cell.find_gripper(mapping_.robotiq)));
  const GripperState& state = state_->gripper(mapping_.robotiq);
  const auto answer = robotiq_.answer(
      line, {state.width, info.max_width, info.max_force, state.moving, state.part >= 0}, time_s());
  if (answer.command)
    link_.sender().grip(mapping_.robotiq, GripperAction::width, answer.command->width_m,
                        answer.command->force_N);
  return answer.bytes;
}

void UrController::set_analog_output(int number, double fraction) {
  if (number < 0 || number > 1) return;
  analog_outputs_.at(static_cast<std::size_t>(number)) = kFullScale_V * std::clamp(fraction, 0.0, 1.0);
  write_element("standard_analog_output_" + std::to_string(number), fraction);
}

void UrController::set_tcp(const Vector6& offset) {
  tcp_offset_ = offset;
  motion_.set_tool(pose_of(offset));
  restart_force_mode(target_q_);
}

void UrController::set_payload(const Payload& payload) {
  payload_ = payload;
  measure_force();
  zero_force_sensor();
}

void UrController::set_driver_sensor(const DriverSensor& sensor) {
  constexpr double kLongest_s = 0.1;
  driver_sensor_ = sensor;
  std::erase_if(watchdogs_, [](const Watchdog& one) { return one.of_sensor; });
  if (!sensor.enabled || !watchdogs_.empty()) return;
  set_watchdog("external_force_torque", kLongest_s, false);
  watchdogs_.back().of_sensor = true;
}

void UrController::set_flag(int number, bool value) {
  const std::uint32_t bit = std::uint32_t{1} << static_cast<unsigned>(number);
  flags_ = value ? flags_ | bit : flags_ & ~bit;
}

void UrController::zero_force_sensor() {
  force_bias_ = measured_force_;
  sensor_zero_F_ = sensed_F_;
}

bool UrController::measures_force() const {
  return force_sensor_ || driver_sensor_.enabled || !mapping_.tool.empty();
}

// Contact wrench on the tool's components, about the TCP, in the protocol's base.
Vector6 UrController::summed_contact_force(const Pose& X_RT) const {
  if (mapping_.tool.empty()) return {};
  const auto& cell = *link_.cell();
  const auto& gripper = cell.grippers.at(static_cast<std::size_t>(cell.find_gripper(mapping_.tool)));
  const auto& robot = cell.robots.at(static_cast<std::size_t>(gripper.robot));
  const Pose X_RW = base_pose(robot, *state_).inverse();
  Vec3 force = Vec3::Zero(), torque = Vec3::Zero();
  for (const int index : {gripper.palm, gripper.left_jaw, gripper.right_jaw}) {
    if (index < 0) continue;
    const ComponentState& component = state_->components.at(static_cast<std::size_t>(index));
    const Vec3 f = X_RW.R * vec(component.force), at = X_RW * vec(component.position);
    force += f;
    torque += X_RW.R * vec(component.torque) + (at - X_RT.p).cross(f);
  }
  return turned({force.x(), force.y(), force.z(), torque.x(), torque.y(), torque.z()}, true);
}

Wrench UrController::sensor_wrench_F() const {
  if (!driver_sensor_.enabled) return force_sensor_->wrench_F(*state_);
  const auto& v = inputs_.value(*inputs_.find("external_force_torque")).real;
  const Vec3 force(v[0], v[1], v[2]);
  return {force, Vec3(v[3], v[4], v[5]) + driver_sensor_.origin_F.cross(force)};
}

// set_gravity() gives the acceleration of a robot that rests: away from the earth.
Wrench UrController::weight_F(const Pose& X_RF, double mass_kg, const Vec3& center_F) const {
  const Vec3 up_R = mapping_.base_frame.R * Vec3(gravity_[0], gravity_[1], gravity_[2]);
  const Vec3 weight = X_RF.R.transpose() * (-mass_kg * up_R);
  return {weight, center_F.cross(weight)};
}

void UrController::measure_force() {
  const Pose X_RT = motion_.tool_pose(actual_q_);
  if (!force_sensor_ && !driver_sensor_.enabled) {
    measured_force_ = raw_wrench_ = summed_contact_force(X_RT);
    for (std::size_t i = 0; i < 6; ++i) contact_force_.at(i) = measured_force_.at(i) - force_bias_.at(i);
    return;
  }
  const Pose X_RF = X_RT * motion_.tool().inverse();
  const Wrench raw = sensor_wrench_F();
  const auto& cog = payload_.center_of_gravity_m;
  const Wrench payload = weight_F(X_RF, payload_.mass_kg, Vec3(cog[0], cog[1], cog[2])),
               own = driver_sensor_.enabled
                         ? weight_F(X_RF, driver_sensor_.mass_kg, driver_sensor_.center_of_gravity_F)
                         : Wrench{};
  sensed_F_ = {raw.f - payload.f - own.f, raw.t - payload.t - own.t};
  const Vec3 force = X_RF.R * (sensed_F_.f - sensor_zero_F_.f);
  const Vec3 torque = X_RF.R * (sensed_F_.t - sensor_zero_F_.t) + (X_RF.p - X_RT.p).cross(force);
  contact_force_ = turned({force.x(), force.y(), force.z(), torque.x(), torque.y(), torque.z()}, true);
  raw_wrench_ = {raw.f.x(), raw.f.y(), raw.f.z(), raw.t.x(), raw.t.y(), raw.t.z()};
}

// --- force mode ---

void UrController::start_force_mode(const ForceModeOptions& options) {
  if (const std::string problem = problem_of(options); !problem.empty())
    throw urscript::ScriptError(1, 1, problem);
  if (!measures_force())
    throw urscript::ScriptError(
        1, 1, "force_mode: nothing measures a force; the mapping needs the key tool or force_sensor");
  if (force_mode_ && force_mode_->options() == options) return;  // programs repeat it in each cycle
  end_force_mode();
  force_mode_.emplace(options, motion_.tool_pose(target_q_));
}

void UrController::start_freedrive(const std::array<bool, 6>& axes, const Pose& X_RK) {
  if (!measures_force()) {
    text("Freedrive: nothing measures a force; the robot stands.");
    return;
  }
  constexpr double kDamping = 0.05, kFastest_m_per_s = 0.5, kFastest_rad_per_s = 1.0;
  ForceModeOptions options;
  options.compliant = axes;
  options.X_RK = X_RK;
  options.damping = kDamping;
  for (std::size_t i = 0; i < 6; ++i)
    options.speed_limit.at(i) = i < 3 ? kFastest_m_per_s : kFastest_rad_per_s;
  start_force_mode(options);
}

void UrController::end_force_mode() {
  if (!force_mode_) return;
  force_mode_.reset();
  motion_.relocate(target_q_);
}

void UrController::restart_force_mode(const Vector6& q) {
  if (!force_mode_) return;
  const ForceModeOptions options = force_mode_->options();
  force_mode_.emplace(options, motion_.tool_pose(q));
}

bool UrController::follow_force() {
  if (!force_mode_) {
    target_q_ = motion_.position();
    target_qd_ = motion_.velocity();
    return true;
  }
  if (paused_) {
    target_qd_ = {};
    return true;
  }
  const Vector6 w = turned(contact_force_, false);
  const Pose& X_RT = force_mode_->advance(motion_.tool_pose(motion_.position()),
                                          {Vec3(w[0], w[1], w[2]), Vec3(w[3], w[4], w[5])}, kCycle_s);
  const auto q = motion_.inverse_kinematics(X_RT, target_q_);
  if (!q) return false;
  Vector6 qd{};
  for (std::size_t i = 0; i < qd.size(); ++i) {
    qd.at(i) = (q->at(i) - target_q_.at(i)) / kCycle_s;
    if (std::abs(qd.at(i)) > arm_.joints[i].max_velocity) return false;
  }
  target_q_ = *q;
  target_qd_ = qd;
  return true;
}

void UrController::write_output_double(int number, double value) {
  if (number >= 0 && number < 48) outputs_.set("output_double_register_" + std::to_string(number), value);
}

void UrController::write_output_int(int number, std::int64_t value) {
  if (number >= 0 && number < 48) outputs_.set_whole("output_int_register_" + std::to_string(number), value);
}

void UrController::write_output_bit(int number, bool value) {
  if (number < 0 || number > 127) return;
  if (number >= 64) {
    outputs_.set_whole("output_bit_register_" + std::to_string(number), value ? 1 : 0);
    return;
  }
  std::int64_t& bits =
      outputs_[number < 32 ? "output_bit_registers0_to_31" : "output_bit_registers32_to_63"].whole[0];
  const std::int64_t bit = std::int64_t{1} << (number % 32);
  bits = value ? bits | bit : bits & ~bit;
}

void UrController::take_inputs(const std::vector<rtde::ServerSession::Written>& written) {
  std::uint64_t standard_mask = 0, configurable_mask = 0, tool_mask = 0, slider_mask = 0, analog_mask = 0;
  for (const auto& one : written) {
    const rtde::Variable& variable = inputs_.variables()[one.variable];
    const rtde::Value before = inputs_.value(one.variable);
    inputs_.value(one.variable) = one.value;
    written_cycles_[one.variable] = cycle_;
    const std::string& name = variable.name;
    const auto whole = static_cast<std::uint64_t>(one.value.whole[0]);
    if (name == "standard_digital_output_mask")
      standard_mask = whole;
    else if (name == "configurable_digital_output_mask")
      configurable_mask = whole;
    else if (name == "tool_digital_output_mask")
      tool_mask = whole;
    else if (name == "speed_slider_mask")
      slider_mask = whole;
    else if (name == "standard_analog_output_mask")
      analog_mask = whole;
    // The controller shows the registers of its clients.
    if (const auto shown = outputs_.find(name)) {
      outputs_.value(*shown) = one.value;
      const bool is_real = variable.type == rtde::Type::real;
      const double value = is_real ? one.value.real[0] : static_cast<double>(one.value.whole[0]);
      if (value != (is_real ? before.real[0] : static_cast<double>(before.whole[0])))
        write_element(name, value);
    }
  }
  const auto whole = [this](const char* name) { return static_cast<std::uint64_t>(inputs_[name].whole[0]); };
  for (int i = 0; i < 8; ++i) {
    const std::uint64_t bit = std::uint64_t{1} << static_cast<unsigned>(i);
    if ((standard_mask & bit) != 0) set_digital_output(i, (whole("standard_digital_output") & bit) != 0);
    if ((configurable_mask & bit) != 0)
      set_digital_output(8 + i, (whole("configurable_digital_output") & bit) != 0);
    if (i < 2 && (tool_mask & bit) != 0)
      set_digital_output(16 + i, (whole("tool_digital_output") & bit) != 0);
    if (i < 2 && (analog_mask & bit) != 0)
      set_analog_output(i, inputs_[i == 0 ? "standard_analog_output_0" : "standard_analog_output_1"].real[0]);
  }
  if (slider_mask != 0) speed_slider_ = std::clamp(inputs_["speed_slider_fraction"].real[0], 0.0, 1.0);
}

void UrController::fill_outputs() {
  const bool running = program_ != nullptr && !paused_;
  const bool powered = robot_mode_ == RobotMode::running || robot_mode_ == RobotMode::idle;
  const bool stopped = safety_mode_ != SafetyMode::normal;

  const Pose X_RT = motion_.tool_pose(actual_q_);
  const double force_size = std::hypot(contact_force_[0], contact_force_[1], contact_force_[2]);

  rtde::Table& o = outputs_;
  const std::uint64_t us = timestamp_us();
  o.set("timestamp", time_s());
  o.set_whole("control_step", static_cast<std::int64_t>(us / 2000));
  o.set("target_execution_time", 0.0);
  o.set("speed_scaling", speed_slider_);
  o.set("target_speed_fraction", speed_slider_);
  o.set("actual_main_voltage", 48.0);
  o.set("actual_robot_voltage", powered ? 48.0 : 0.0);
  o.set("tool_temperature", 25.0);
  o.set("tcp_force_scalar", force_size);
  o.set("payload", payload_.mass_kg);
  for (std::size_t i = 0; i < 2; ++i) {
    const std::string n = std::to_string(i);
    o.set("standard_analog_input" + n, analog_inputs_.at(i));
    o.set("standard_analog_output" + n, analog_outputs_.at(i));
    o.set("tool_analog_input" + n, tool_analog_inputs_.at(i));
  }
  o.set_vector("target_q", target_q_);
  o.set_vector("target_qd", target_qd_);
  o.set_vector("target_qdd", motion_.acceleration());
  o.set_vector("actual_q", actual_q_);
  o.set_vector("actual_qd", actual_qd_);
  o.set_vector("target_moment", actual_effort_);
  o.set_vector("actual_current_as_torque", actual_effort_);
  o.set_vector("actual_TCP_pose", vector_of(to_base(X_RT)));
  o.set_vector("target_TCP_pose", vector_of(to_base(motion_.tool_pose(target_q_))));
  o.set_vector("actual_TCP_speed", turned(motion_.tool_speed(actual_q_, actual_qd_), true));
  o.set_vector("target_TCP_speed", turned(motion_.tool_speed(target_q_, target_qd_), true));
  o.set_vector("actual_TCP_force", contact_force_);
  o.set_vector("ft_raw_wrench", raw_wrench_);
  o.set_vector("tcp_offset", tcp_offset_);
  o.set_vector("payload_cog", payload_.center_of_gravity_m);
  o.set_vector("payload_inertia", payload_.inertia_kg_m2);
  o.set_vector("target_gravity", gravity_);
  for (std::int64_t& mode : o["joint_mode"].whole) mode = joint_mode(robot_mode_);
  o.set_whole("actual_digital_input_bits", static_cast<std::int64_t>(digital_inputs_));
  o.set_whole("actual_digital_output_bits", static_cast<std::int64_t>(digital_outputs_));
  o.set_whole("actual_configurable_digital_input_bits",
              static_cast<std::int64_t>((digital_inputs_ >> 8U) & 0xffU));
  o.set_whole("actual_configurable_digital_output_bits",
              static_cast<std::int64_t>((digital_outputs_ >> 8U) & 0xffU));
  o.set_whole("runtime_state", !program_ ? 1 : paused_ ? 4 : 2);
  o.set_whole("robot_status_bits", (powered ? 1 : 0) | (running ? 2 : 0));
  o.set_whole("safety_status_bits", stopped ? (1 << 2) | (1 << 10) : 1);
  o.set_whole("analog_io_types", 0xf);
  o.set_whole("tool_mode", 253);
  o.set_whole("robot_mode", static_cast<std::int64_t>(robot_mode_));
  o.set_whole("safety_mode", static_cast<std::int64_t>(safety_mode_));
  o.set_whole("safety_status", static_cast<std::int64_t>(safety_mode_));
  o.set_whole("tool_output_voltage", tool_voltage_);
}

std::string UrController::primary_version() const {
  const auto [major, minor, bugfix] = mapping_.version_numbers();
  return rtde::version_message(timestamp_us(), major, minor, bugfix);
}

std::string UrController::primary_state() const {
  rtde::RobotModeData mode;
  mode.timestamp_us = timestamp_us();
  mode.power_on = robot_mode_ != RobotMode::power_off;
  mode.protective_stopped = safety_mode_ == SafetyMode::protective_stop;
  mode.program_running = program_ != nullptr && !paused_;
  mode.program_paused = program_ != nullptr && paused_;
  mode.robot_mode = static_cast<std::uint8_t>(robot_mode_);
  mode.target_speed_fraction = mode.speed_scaling = speed_slider_;
  rtde::MasterboardData board;
  board.digital_inputs = static_cast<std::uint32_t>(digital_inputs_);
  board.digital_outputs = static_cast<std::uint32_t>(digital_outputs_);
  board.analog_inputs = analog_inputs_;
  board.analog_outputs = analog_outputs_;
  board.safety_mode = static_cast<std::uint8_t>(safety_mode_);
  rtde::ConfigurationData configuration;
  for (std::size_t i = 0; i < 6; ++i) {
    const JointModel& joint = arm_.joints[i];
    configuration.joints.at(i) = {joint.lower, joint.upper, joint.max_velocity, 15.0};
  }
  configuration.dh = dh_;
  configuration.robot_type = mapping_.robot_type();
  configuration.robot_sub_type = 1;
  return rtde::robot_state(rtde::robot_mode_data(mode) + rtde::joint_data(outputs_) +
                           rtde::tool_data(outputs_) + rtde::masterboard_data(board) +
                           rtde::cartesian_info(outputs_) + rtde::kinematics_info(dh_) +
                           rtde::configuration_data(configuration) + rtde::force_mode_data(outputs_) +
                           rtde::additional_info(program_ == nullptr) + rtde::tool_mode_info(outputs_));
}

}  // namespace takt::ur

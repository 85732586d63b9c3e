#include "client_lib/tools/takt_ur/ur_controller.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <string_view>

#include "client_lib/gateway/cell_link.h"
#include "client_lib/gateway/ur/dh.h"
#include "client_lib/kinematics/arm.h"
#include "client_lib/tools/takt_ur/external_program.h"
#include "client_lib/tools/takt_ur/script_run.h"
#include "client_lib/tools/takt_ur/statement_queue.h"
#include "idl/common/text.h"

namespace takt::ur {
namespace {

/// From one power state to the next.
constexpr double kPowerChange_s = 0.2;
/// Set-points are sent for this long after the robot has come to rest.
constexpr double kRestTime_s = 0.1;
constexpr int kProtectiveStopCode = 209;
constexpr std::size_t kMostLogLines = 500;
/// Commands of the controller that change nothing here: a program that was sent runs; modes as python-urx sets them; parameters as
/// Hirebotics' urscript-tools confirms them.
constexpr std::string_view kWithoutEffect[] = {"run program", "set sim", "set real",
                                               "confirm user safety parameters"};

std::uint64_t cycles(double seconds) {
  return static_cast<std::uint64_t>(std::ceil(seconds / UrController::kCycle_s));
}

}  // namespace

const takt_msgs::msg::RobotDescription& UrController::description() const {
  const int robot = link_.cell()->find_robot(mapping_.robot.robot);
  return link_.cell()->robots.at(static_cast<std::size_t>(robot));
}

ArmModel UrController::protocol_arm() const {
  ArmModel arm = arm_model(description());
  for (std::size_t i = 0; i < arm.joints.size(); ++i) {
    JointModel& joint = arm.joints[i];
    if (arm.joints.size() != 6 || joint.type != JointType::revolute || mapping_.robot.index[i] != i)
      throw ScenarioError(mapping_.robot.robot +
                          ": allowed: a robot with six revolute joints, in their order from the base");
    // cell = sign * (protocol - offset): the axis turns, and its zero.
    const double sign = mapping_.robot.sign[i], offset = mapping_.robot.offset[i];
    joint.axis *= sign;
    joint.X_PJ.R = joint.X_PJ.R * Eigen::AngleAxisd(-offset, joint.axis).toRotationMatrix();
    const double a = sign * joint.lower + offset, b = sign * joint.upper + offset;
    joint.lower = std::min(a, b);
    joint.upper = std::max(a, b);
  }
  return arm;
}

UrController::UrController(gateway::EventLoop& loop, gateway::RobotCell& link, const UrMapping& mapping)
    : loop_(loop),
      link_(link),
      mapping_(mapping),
      arm_(protocol_arm()),
      dynamics_(description().urdf, arm_),
      dh_(dh_parameters(arm_).parameters),
      motion_(arm_, kCycle_s),
      outputs_(rtde::output_table()),
      inputs_(rtde::input_table()),
      written_cycles_(inputs_.variables().size()),
      history_(kHistory) {
  if (!mapping.powered) robot_mode_ = wanted_mode_ = RobotMode::power_off;
  if (const int tool = mapping.tool.empty() ? -1 : link.cell()->find_gripper(mapping.tool); tool >= 0) {
    const auto& gripper = link.cell()->grippers.at(static_cast<std::size_t>(tool));
    set_tcp(vector_of(takt::pose_of(gripper.mount) * takt::pose_of(gripper.tool_center_point)));
  }
  if (!mapping.force_sensor.empty()) force_sensor_.emplace(*link.cell(), mapping.force_sensor);
  read_cell();
  motion_.reset(actual_q_);
  target_q_ = actual_q_;
  measure_force();
  fill_outputs();
}

UrController::~UrController() = default;

Vector6 UrController::vector(const std::vector<double>& values) const {
  Vector6 result{};
  std::copy_n(values.begin(), std::min(values.size(), result.size()), result.begin());
  return result;
}

Vector6 UrController::turned(const Vector6& values, bool to_protocol) const {
  const Mat3 R = to_protocol ? Mat3(mapping_.base_frame.R.transpose()) : mapping_.base_frame.R;
  const Vec3 a = R * Vec3(values[0], values[1], values[2]), b = R * Vec3(values[3], values[4], values[5]);
  return {a.x(), a.y(), a.z(), b.x(), b.y(), b.z()};
}

void UrController::advance() {
  ++cycle_;
  const bool plays = read_cell();
  measure_force();
  history_[cycle_ % kHistory] = {actual_q_, {contact_force_[0], contact_force_[1], contact_force_[2]}};
  change_power();
  modbus_.advance();
  // A robot that another client moves, or that was reset, or stands still with its cell: the target is where it is.
  if (!drives_ || !plays || robot_mode_ != RobotMode::running) {
    // A program that runs beside a cell that stands keeps its mode, since drivers do not send it again.
    if (drives_ && robot_mode_ == RobotMode::running)
      motion_.relocate(actual_q_);
    else
      motion_.reset(actual_q_);
    restart_force_mode(actual_q_);
    target_q_ = actual_q_;
  }
  advance_program();
  if (plays && robot_mode_ == RobotMode::running && !apply_torques()) {
    const bool feasible = motion_.advance(speed_slider_) && follow_force();
    if (!feasible) {
      protective_stop("the path leaves the robot's reach or passes a singularity");
      error_code(204, rtde::ReportLevel::violation,
                 "Path sanity check failed: the path leaves the robot\'s reach.");
    }
    drive();
  }
  if (std::any_of(target_qd_.begin(), target_qd_.end(), [](double v) { return v != 0.0; }))
    moved_cycle_ = cycle_;
  fill_outputs();
}

bool UrController::read_cell() {
  const auto previous = state_;
  state_ = link_.state();
  const RobotState& robot = state_->robot(mapping_.robot.robot);
  actual_q_ = vector(mapping_.robot.to_protocol(robot.position));
  actual_qd_ = vector(mapping_.robot.rates_to_protocol(robot.velocity));
  actual_effort_ = vector(mapping_.robot.rates_to_protocol(robot.effort));
  if (previous && previous->epoch != state_->epoch) {
    end_program("The cell was reset.");
    sensor_zero_F_ = {};
    force_bias_ = {};
    motion_.reset(actual_q_);
    drives_ = false;
  }
  digital_inputs_ = 0;
  for (const gateway::InputMapping& input : mapping_.inputs) {
    const auto number = [&](std::string_view stem) {
      return static_cast<unsigned>(std::stoi(input.name.substr(stem.size())));
    };
    const auto starts = [&](std::string_view stem) { return input.name.substr(0, stem.size()) == stem; };
    const auto bit = [&](unsigned n) {
      digital_inputs_ |= std::uint64_t{gateway::digital(input, *state_)} << n;
    };
    if (starts("standard_digital_input_"))
      bit(number("standard_digital_input_"));
    else if (starts("configurable_digital_input_"))
      bit(8 + number("configurable_digital_input_"));
    else if (starts("tool_digital_input_"))
      bit(16 + number("tool_digital_input_"));
    else if (starts("standard_analog_input"))
      analog_inputs_.at(number("standard_analog_input")) = gateway::number_of(input, *state_);
    else if (starts("tool_analog_input"))
      tool_analog_inputs_.at(number("tool_analog_input")) = gateway::number_of(input, *state_);
    else if (starts("output_bit_register_"))
      outputs_.set_whole(input.name, gateway::digital(input, *state_));
    else if (starts("output_int_register_"))
      outputs_.set_whole(input.name, std::llround(std::clamp(gateway::number_of(input, *state_),
                                                             -2147483648.0, 2147483647.0)));
    else if (starts("output_double_register_"))
      outputs_.set(input.name, gateway::number_of(input, *state_));
  }
  return link_.plays();
}

bool UrController::can_move() const {
  return !paused_ && robot_mode_ == RobotMode::running && safety_mode_ == SafetyMode::normal && link_.plays();
}

void UrController::change_power() {
  if (robot_mode_ == wanted_mode_ || cycle_ < mode_since_ + cycles(kPowerChange_s)) return;
  mode_since_ = cycle_;
  switch (robot_mode_) {
    case RobotMode::power_off:
      robot_mode_ = RobotMode::power_on;
      break;
    case RobotMode::power_on:
      robot_mode_ = RobotMode::idle;
      break;
    default:
      robot_mode_ = wanted_mode_;
  }
}

void UrController::advance_program() {
  constexpr std::ptrdiff_t kMostAtOnce = 10;  // others begin when one ends
  const auto first_waiting =
      secondary_.begin() + std::min(kMostAtOnce, static_cast<std::ptrdiff_t>(secondary_.size()));
  secondary_.erase(std::remove_if(secondary_.begin(), first_waiting,
                                  [this](const auto& one) { return !advance_secondary(*one); }),
                   first_waiting);
  if (!program_ || paused_ || robot_mode_ != RobotMode::running || !check_watchdogs()) return;
  bool goes_on = false;
  try {
    goes_on = program_->advance();
  } catch (const urscript::ScriptError& error) {
    fail(program_->name(), error);
  }
  if (!goes_on) end_program("");
}

bool UrController::advance_secondary(RunningProgram& program) {
  try {
    return program.advance();
  } catch (const urscript::ScriptError& error) {
    fail(program.name(), error);
    return false;
  }
}

void UrController::set_watchdog(const std::string& input, double longest_s, bool ends) {
  std::erase_if(watchdogs_, [&](const Watchdog& one) { return one.input == input; });
  if (longest_s > 0.0)
    watchdogs_.push_back(
        {input, static_cast<std::uint64_t>(std::ceil(std::min(longest_s, 1e6) / kCycle_s)), cycle_, ends});
}

bool UrController::check_watchdogs() {
  for (Watchdog& one : watchdogs_) {
    const std::uint64_t last = std::max(one.begun_cycle, written_cycles_.at(*inputs_.find(one.input)));
    if (cycle_ <= last + one.longest_cycles) continue;
    text("RTDE watchdog: " + one.input + " is not written often enough. The program " +
         (one.ends ? "ends." : "is paused."));
    one.begun_cycle = cycle_;
    if (one.ends)
      end_program("Its watchdog ends it.");
    else
      pause();
    return false;
  }
  return true;
}

const Vector6& UrController::position_before(std::size_t cycles) const {
  const std::size_t known = std::min({static_cast<std::size_t>(cycle_) - 1, kHistory - 1, cycles});
  return history_[(cycle_ - known) % kHistory].position;
}

int UrController::contact_cycles(const Vec3& direction) const {
  int count = 0;
  for (const std::size_t most = std::min<std::size_t>(cycle_, kHistory - 1);
       static_cast<std::size_t>(count) < most; ++count) {
    const Vec3& force = history_[(cycle_ - static_cast<std::size_t>(count)) % kHistory].force;
    const double against = direction.norm() > 0.0 ? -force.dot(direction.normalized()) : force.norm();
    if (!(against >= mapping_.contact_force_N)) break;
  }
  return count;
}

void UrController::drive() {
  const bool busy = program_ != nullptr || !motion_.at_rest() || motion_.follows() || force_mode_;
  if (busy) at_rest_since_ = cycle_;
  if (busy && !drives_) {
    drives_ = true;
  } else if (drives_ && cycle_ > at_rest_since_ + cycles(kRestTime_s)) {
    drives_ = false;
    link_.sender().stop(mapping_.robot.robot);  // ends the stream, so that no deadline is missed
    return;
  }
  if (drives_)
    link_.sender().move(mapping_.robot.robot, mapping_.robot.to_cell(target_q_),
                        mapping_.robot.rates_to_cell(target_qd_));
}

std::string UrController::command_torques(const Vector6& torques) {
  if (state_->robot(mapping_.robot.robot).motor_power.empty())
    return "direct_torque: " + mapping_.robot.robot +
           " has no drives at level of detail 1; allowed: level of detail 2 and 3";
  if (force_mode_) return "direct_torque: allowed: after end_force_mode()";
  torques_ = {torques, cycle_};
  return {};
}

bool UrController::apply_torques() {
  if (torques_ && torques_->cycle != cycle_) torques_.reset();
  if (!torques_ || safety_mode_ != SafetyMode::normal) return false;
  motion_.follow(actual_q_, actual_qd_);
  target_q_ = actual_q_;
  target_qd_ = actual_qd_;
  drives_ = true;
  at_rest_since_ = cycle_;
  link_.sender().apply_torques(mapping_.robot.robot, mapping_.robot.rates_to_cell(torques_->values));
  return true;
}

// --- programs ---

void UrController::take_script(const std::string& script) {
  const std::size_t begin = script.find_first_not_of(" \t\r"), end = script.find_last_not_of(" \t\r");
  const std::string text = begin == std::string::npos ? "" : script.substr(begin, end - begin + 1);
  // Commands of the controller, as drivers send them beside programs.
  std::string reason;
  if (text == "stop program") {
    stop();
  } else if (text == "pause program") {
    pause();
  } else if (text == "power on") {
    power_on(reason);
  } else if (text == "power off") {
    power_off(reason);
  } else if (text == "set robotmode run") {
    release_brakes(reason);
  } else if (text == "set unlock protective stop") {
    unlock_protective_stop(reason);
  } else if (std::find(std::begin(kWithoutEffect), std::end(kWithoutEffect), text) ==
             std::end(kWithoutEffect)) {
    run(text);
  }
}

std::string RunningProgram::interpret(std::string_view line) {
  return discarded(line, "the program has no interpreter mode");
}

std::string UrController::interpret(std::string_view line) {
  return program_ ? program_->interpret(line) : discarded(line, "no program runs");
}

void UrController::run(const std::string& text) {
  urscript::Program program;
  try {
    program = urscript::parse_program(text);
  } catch (const urscript::ScriptError& error) {
    fail("", error);
    return;
  }
  if (program.code.is_empty() && !program.external) return;
  const bool secondary = program.secondary || program.name.empty();
  if (program.name.empty()) program.name = "unnamed";
  if (secondary && !program.code.moves) {
    run_secondary(std::move(program));
    return;
  }
  if (robot_mode_ != RobotMode::running || safety_mode_ != SafetyMode::normal) {
    log("The program " + program.name + " does not start: the robot is not running.");
    return;
  }
  end_program("Another program starts.");
  if (program.external)
    start(std::make_unique<ExternalProgram>(*this, program));
  else
    start(std::make_unique<ScriptRun>(*this, program.name, std::move(program.code)));
}

void UrController::run_secondary(urscript::Program program) {
  constexpr std::size_t kMostSecondary = 1000;
  if (secondary_.size() >= kMostSecondary)
    text("The secondary program " + program.name + " is refused: " + std::to_string(kMostSecondary) +
         " of them run or wait; \"stop program\" ends them.");
  else
    secondary_.push_back(std::make_unique<ScriptRun>(*this, program.name, std::move(program.code)));
}

void UrController::start(std::unique_ptr<RunningProgram> program) {
  if (!drives_) motion_.reset(actual_q_);
  drives_ = true;
  at_rest_since_ = cycle_;
  paused_ = false;
  log("The program " + program->name() + " starts.");
  on_primary_message(rtde::key_message(timestamp_us(), rtde::kProgramStarted, program->name()));
  next_force_mode_ = {};
  watchdogs_.clear();
  program_ = std::move(program);
}

void UrController::end_program(const char* why) {
  paused_ = false;
  if (!program_) return;
  const std::string name = program_->name();
  program_.reset();
  end_force_mode();
  motion_.stop();
  log("The program " + name + " has ended. " + why);
  on_primary_message(rtde::key_message(timestamp_us(), rtde::kProgramStopped, name));
}

void UrController::fail(const std::string& name, const urscript::ScriptError& error) {
  log("The program " + name + " failed at line " + std::to_string(error.line()) + ", column " +
      std::to_string(error.column()) + ": " + error.what());
  on_primary_message(
      rtde::runtime_exception_message(timestamp_us(), error.line(), error.column(), error.what()));
}

void UrController::text(const std::string& message) {
  log(message);
  on_primary_message(rtde::text_message(timestamp_us(), message));
}

void UrController::error_code(int code, rtde::ReportLevel level, const std::string& message) {
  log("C" + std::to_string(code) + ": " + message);
  on_primary_message(rtde::error_code_message(timestamp_us(), code, 0, level, message));
}

void UrController::protective_stop(const std::string& why) {
  if (safety_mode_ == SafetyMode::protective_stop) return;
  safety_mode_ = SafetyMode::protective_stop;
  end_force_mode();
  motion_.stop(15.0);
  if (program_) paused_ = true;
  // A client that reads the error has the state and the safety mode, so that what it does next finds them.
  on_primary_message(primary_state());
  on_primary_message(rtde::safety_mode_message(timestamp_us(), 0, static_cast<std::uint8_t>(safety_mode_)));
  error_code(kProtectiveStopCode, rtde::ReportLevel::warning,
             "A protective stop was triggered: " + why + ".");
}

void UrController::begin(const Move& move) {
  if (motion_.begin(move)) return;
  protective_stop("the target is out of reach");
  error_code(204, rtde::ReportLevel::violation, "Path sanity check failed: the target is out of reach.");
}

bool UrController::blend_into(const Move& next) {
  switch (motion_.blend_into(next)) {
    case Motion::BlendOutcome::blended:
      return true;
    case Motion::BlendOutcome::overlapping:
      text("Overlapping Blends: a blend radius meets another waypoint or its blend. The blend is skipped.");
      return false;
    case Motion::BlendOutcome::impossible:
      text("A blend is skipped: the next move came too late, or the joints cannot follow the blend.");
      return false;
  }
  return false;
}

// --- dashboard ---

std::string UrController::robot_mode() const {
  switch (robot_mode_) {
    case RobotMode::power_off:
      return "POWER_OFF";
    case RobotMode::power_on:
      return "POWER_ON";
    case RobotMode::idle:
      return "IDLE";
    case RobotMode::running:
      return "RUNNING";
  }
  return "NO_CONTROLLER";
}

std::string UrController::safety_mode() const {
  return safety_mode_ == SafetyMode::normal ? "NORMAL" : "PROTECTIVE_STOP";
}

std::string UrController::program_state() const {
  return !program_ ? "STOPPED" : paused_ ? "PAUSED" : "PLAYING";
}

bool UrController::power_on(std::string&) {
  if (robot_mode_ == RobotMode::power_off || wanted_mode_ == RobotMode::power_off) {
    wanted_mode_ = RobotMode::idle;
    mode_since_ = cycle_;
  }
  return true;
}

bool UrController::power_off(std::string&) {
  end_program("The power is off.");
  wanted_mode_ = RobotMode::power_off;
  // Motors stop at once; the robot stands by its brakes.
  if (drives_) link_.sender().stop(mapping_.robot.robot);
  drives_ = false;
  if (robot_mode_ == RobotMode::running || robot_mode_ == RobotMode::idle) mode_since_ = cycle_;
  return true;
}

bool UrController::release_brakes(std::string&) {
  if (wanted_mode_ != RobotMode::running) mode_since_ = cycle_;
  wanted_mode_ = RobotMode::running;
  return true;
}

bool UrController::unlock_protective_stop(std::string&) {
  if (safety_mode_ != SafetyMode::normal) {
    safety_mode_ = SafetyMode::normal;
    on_primary_message(rtde::safety_mode_message(timestamp_us(), 0, static_cast<std::uint8_t>(safety_mode_)));
  }
  return true;
}

bool UrController::load_program(const std::string& name) {
  const std::string base = name.substr(name.find_last_of('/') + 1);
  for (const NamedProgram& program : mapping_.programs) {
    if (program.name != base) continue;
    end_program("Another program is loaded.");
    loaded_ = base;
    return true;
  }
  return false;
}

bool UrController::play(const std::string& dashboard_client) {
  if (robot_mode_ != RobotMode::running || safety_mode_ != SafetyMode::normal) return false;
  if (program_) {
    paused_ = false;
    return true;
  }
  for (const NamedProgram& program : mapping_.programs) {
    if (program.name != loaded_) continue;
    if (!program.script.empty()) {
      try {
        start(
            std::make_unique<ScriptRun>(*this, program.name, read_script(program.script, program.name).code));
      } catch (const urscript::ScriptError& error) {
        fail(program.name, error);
        return false;
      }
    } else {
      start(std::make_unique<RequestedProgram>(*this, program.name,
                                               program.host.empty() ? dashboard_client : program.host,
                                               static_cast<std::uint16_t>(program.port)));
    }
    return true;
  }
  return false;
}

bool UrController::pause() {
  if (!program_) return false;
  paused_ = true;
  motion_.stop();
  return true;
}

bool UrController::stop() {
  secondary_.clear();
  end_program("It was stopped.");
  return true;
}

void UrController::log(const std::string& text) {
  gateway::report("takt-ur " + mapping_.robot.robot, text);
  log_.push_back(number_text(time_s()) + " s " + text);
  if (log_.size() > kMostLogLines) log_.pop_front();
}

}  // namespace takt::ur

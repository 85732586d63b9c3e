#include "client_lib/tools/takt_ur/register_program.h"

#include <algorithm>
#include <cmath>

namespace takt::ur {
namespace {

using urscript::Value;

/// No value of a robot is larger.
constexpr double kLargest = 1e6;
constexpr int kReady = 1, kDone = 2, kStopProgram = 255;
/// Positions that get_actual_joint_positions_history() knows, and the most cycles of a contact.
constexpr std::size_t kHistory = 500;
// The text sets both before its loop.
constexpr double kForceGain = 0.5, kForceDamping = 0.025;
constexpr double kContactDeceleration = 3.0, kMoveDeceleration = 4.0, kJogDeceleration = 1.2,
                 kForceDeceleration = 10.0;

std::vector<double> list(const Vector6& values) {
  return {values.begin(), values.end()};
}
Value pose_literal(const Vector6& values) {
  return Value::pose(list(values));
}

}  // namespace

RegisterProgram::RegisterProgram(UrController& controller, const urscript::Program& program)
    : RunningProgram(program.name), controller_(controller), registers_(*program.registers) {
  controller_.next_force_mode().gain = kForceGain;
  controller_.next_force_mode().damping = kForceDamping;
  signal_async_end();
  controller_.write_output_int(registers_.first_int, kReady);
}

double RegisterProgram::real(int number) const {
  const std::string name = "input_double_register_" + std::to_string(registers_.first_double + number);
  const double value = controller_.inputs()[name].real[0];
  if (!(std::abs(value) <= kLargest))
    throw urscript::ScriptError(1, 1, name + ": allowed: numbers from -1e6 to 1e6");
  return value;
}

int RegisterProgram::whole(int number) const {
  const auto& inputs = controller_.inputs();
  return static_cast<int>(
      inputs["input_int_register_" + std::to_string(registers_.first_int + number)].whole[0]);
}

Vector6 RegisterProgram::six(int first) const {
  Vector6 values;
  for (std::size_t i = 0; i < values.size(); ++i) values.at(i) = real(first + static_cast<int>(i));
  return values;
}

Pose RegisterProgram::pose(int first) const {
  return controller_.from_base(pose_of(six(first)));
}

void RegisterProgram::answer(int first, const Vector6& values) {
  for (std::size_t i = 0; i < values.size(); ++i)
    controller_.write_output_double(registers_.first_double + first + static_cast<int>(i), values.at(i));
}

void RegisterProgram::answer(int number) {
  controller_.write_output_int(registers_.first_int + 1, number);
}

void RegisterProgram::signal_async_end() {
  async_end_ = async_end_ == -1 ? -2 : -1;  // so that a client sees each end
  controller_.write_output_int(2, async_end_);
}

bool RegisterProgram::advance() {
  history_.push_front(controller_.outputs()["actual_q"].real);
  if (history_.size() > kHistory) history_.pop_back();
  const std::string command_register = "input_int_register_" + std::to_string(registers_.first_int);
  if (watchdog_cycles_ > 0 &&
      controller_.cycle() > controller_.written_cycle(command_register) + watchdog_cycles_) {
    controller_.text("RTDE watchdog: " + command_register +
                     " is not written often enough. The program ends.");
    return false;
  }
  if (async_run_ && !async_run_->advance()) {
    async_run_.reset();
    signal_async_end();
  }
  advance_control();
  if (run_) {
    if (run_->advance()) return true;
    run_.reset();
    controller_.write_output_int(registers_.first_int, kDone);
  }
  if (approach_) {
    advance_approach();
    return true;
  }
  const int command = whole(0);
  const auto& realtime = registers_.realtime_commands;
  if (command == 0) {
    executing_ = false;
    controller_.write_output_int(registers_.first_int, kReady);
  } else if (std::find(realtime.begin(), realtime.end(), command) != realtime.end()) {
    execute(command);
    controller_.write_output_int(registers_.first_int, kReady);
  } else if (!executing_) {
    if (command == kStopProgram) return false;
    executing_ = true;
    execute(command);
    if (!run_ && !approach_) controller_.write_output_int(registers_.first_int, kDone);
  }
  return true;
}

void RegisterProgram::begin(urscript::Code code, bool async) {
  (async ? async_run_ : run_) = std::make_unique<ScriptRun>(controller_, name(), std::move(code));
  if (async) controller_.write_output_int(2, 0);
}

void RegisterProgram::call(const char* function, std::vector<Value> arguments,
                           std::map<std::string, Value> named) {
  begin(urscript::compile({{function, std::move(arguments), std::move(named)}}), false);
}

void RegisterProgram::begin_move(const char* function, std::vector<Value> arguments, int options,
                                 double blend_m) {
  begin_control(Control::none);
  // A move begins at rest; one that it replaces brakes.
  const std::vector<urscript::Call> calls{
      {"stopj", {kMoveDeceleration}, {}},
      {function, std::move(arguments), {{"v", real(options)}, {"a", real(options + 1)}, {"r", blend_m}}}};
  async_run_.reset();
  const std::string f = function;
  begin(urscript::compile(calls), f != "movec" && f != "movep" && whole(1) == 1);
}

void RegisterProgram::begin_control(Control control) {
  if (control_ != Control::none && control_ != control)
    throw urscript::ScriptError(1, 1, "Another thread is already controlling the robot");
  if (control == Control::none) return;
  if (async_run_) throw urscript::ScriptError(1, 1, "Another thread is already controlling the robot");
  if (control_ == control) return;
  control_ = control;
  if (control == Control::servo) controller_.motion().begin_servo();
}

void RegisterProgram::stop(const char* function, double deceleration) {
  control_ = Control::none;
  call(function, {deceleration});
}

void RegisterProgram::execute(int command) {
  Motion& motion = controller_.motion();
  const auto joints = [&] { return Value(list(six(0))); };
  const auto position = [&] { return Value(pose_literal(six(0))); };
  const auto actual_q = [&] { return controller_.outputs()["actual_q"].real; };
  switch (command) {
    case 1:
      return begin_move("movej", {joints()}, 6);
    case 2:
      return begin_move("movej", {position()}, 6);
    case 3:
      return begin_move("movel", {position()}, 6);
    case 4:
      return begin_move("movel", {joints()}, 6);
    case 5:
      return begin_move("movec", {position(), pose_literal(six(6))}, 12, real(14));
    case 6:
      return force_mode();
    case 7:
      force_command_.clear();
      controller_.end_force_mode();
      return stop("stopl", kForceDeceleration);
    case 8:
      return controller_.zero_force_sensor();
    case 9:
    case 10:
      begin_control(Control::speed);
      if (command == 9)
        motion.speed(six(0), std::max(0.01, real(6)));
      else
        motion.tool_speed_command(controller_.turned(six(0), false), std::max(0.01, real(6)));
      return;
    case 11:
    case 24: {
      target_ = six(0);
      if (command == 24) {
        const auto q = motion.inverse_kinematics(pose(0), motion.position());
        if (!q) throw urscript::ScriptError(1, 1, "getInverseKin: unable to find solution!");
        target_ = *q;
      }
      lookahead_s_ = std::clamp(real(9), 0.03, 0.2);
      return begin_control(Control::servo);
    }
    case 12:
      target_ = six(0);
      speed_ = std::max(0.0, real(6));
      acceleration_ = std::max(0.01, real(7));
      return begin_control(Control::servo_line);
    case 15:
      return stop("stopj", std::max(0.1, real(0)));
    case 16:
      return stop("stopl", std::max(0.1, real(0)));
    case 17: {
      Payload payload{real(0), {real(1), real(2), real(3)}, {}};
      if (payload.center_of_gravity_m == std::array<double, 3>{})
        payload.center_of_gravity_m = controller_.payload().center_of_gravity_m;
      return controller_.set_payload(payload);
    }
    case 18:
      return controller_.start_freedrive();
    case 19:
      return controller_.end_force_mode();
    case 20:
      return call("force_mode_set_damping", {real(0)});
    case 21:
      return call("force_mode_set_gain_scaling", {real(0)});
    case 25:
      return answer(contact_cycles(six(0)));
    case 26:
      return controller_.write_output_double(registers_.first_double, UrController::kCycle_s);
    case 27:
      return answer(0, position_before(whole(1)));
    case 28:
      return answer(0, vector_of(controller_.to_base(motion.tool_pose(motion.end()))));
    case 29:
      return controller_.set_tcp(six(0));
    case 30:
      return inverse_kinematics(six(6));
    case 31:
      return call("protective_stop", {});
    case 32:
      return begin_move("movep", {position()}, 6, real(8));
    case 33:
    case 34:
      async_run_.reset();
      return call(command == 33 ? "stopl" : "stopj", {std::max(0.1, real(0))});
    case 35:
      watchdog_cycles_ = real(0) > 0.0 ? static_cast<std::uint64_t>(std::ceil(
                                             1.0 / (std::max(1e-3, real(0)) * UrController::kCycle_s)))
                                       : 0;
      return;
    case 36: {
      const auto q = motion.inverse_kinematics(pose(0), actual_q());
      return answer(q && motion.within_limits(*q) ? 1 : 0);
    }
    case 37:
      return answer(motion.within_limits(six(0)) ? 1 : 0);
    case 38:
      return answer(0, controller_.outputs()["actual_current_as_torque"].real);
    case 39:
      return answer(0, vector_of(pose_of(six(0)) * pose_of(six(6))));
    case 40:
      return answer(0, controller_.tcp_offset());
    case 41: {
      begin_control(Control::jog);
      Vector6 twist = six(0);
      if (real(6) == 1.0) {  // in the axes of the tool
        const Mat3 R_BT = controller_.to_base(motion.tool_pose(motion.position())).R;
        const Vec3 v = R_BT * Vec3(twist[0], twist[1], twist[2]),
                   w = R_BT * Vec3(twist[3], twist[4], twist[5]);
        twist = {v.x(), v.y(), v.z(), w.x(), w.y(), w.z()};
      }
      return motion.tool_speed_command(controller_.turned(twist, false));
    }
    case 42:
      return stop("stopl", kJogDeceleration);
    case 43:
      return forward_kinematics(actual_q(), motion.tool());
    case 44:
      return forward_kinematics(six(0), pose_of(six(6)));
    case 45:
      begin_control(Control::none);
      async_run_.reset();
      return begin(registers_.path, whole(1) == 1);
    case 46:
      return inverse_kinematics(actual_q());
    case 47:
      return answer(motion.at_rest() && !motion.follows() ? 1 : 0);
    case 51:
      begin_control(Control::none);
      approach_ = Approach{six(0), six(6), std::max(0.01, real(12))};
      contact_cycles_ = 0;
      return;
    default:
      controller_.text("Command " + std::to_string(command) + " of ur_rtde has no effect in takt.");
  }
}

void RegisterProgram::force_mode() {
  std::vector<double> values;
  for (int i = 1; i < 8; ++i) values.push_back(whole(i));
  for (int i = 0; i < 18; ++i) values.push_back(real(i));
  if (values == force_command_) return;
  force_command_ = values;
  ForceModeOptions options = controller_.next_force_mode();
  options.type = force_mode_type(values[0]);
  options.X_RK = pose(0);
  for (std::size_t i = 0; i < 6; ++i) {
    options.compliant.at(i) = values.at(1 + i) != 0.0;
    options.wrench.at(i) = values.at(13 + i);
    options.speed_limit.at(i) = values.at(19 + i);
  }
  controller_.start_force_mode(options);
}

void RegisterProgram::forward_kinematics(const Vector6& q, const Pose& X_FT) {
  const Motion& motion = controller_.motion();
  const Pose X_RF = motion.tool_pose(q) * motion.tool().inverse();
  answer(0, vector_of(controller_.to_base(X_RF * X_FT)));
}

void RegisterProgram::inverse_kinematics(const Vector6& near) {
  const auto q = controller_.motion().inverse_kinematics(pose(0), near);
  if (!q) throw urscript::ScriptError(1, 1, "getInverseKin: unable to find solution!");
  answer(0, *q);
}

void RegisterProgram::advance_control() {
  Motion& motion = controller_.motion();
  if (control_ == Control::servo) {
    motion.servo_with_lag(target_, lookahead_s_);
  } else if (control_ == Control::servo_line) {
    follow_line();
  }
}

// At most with the speed from which it can still brake.
void RegisterProgram::follow_line() {
  Motion& motion = controller_.motion();
  const Pose X_RT = motion.tool_pose(motion.position()), X_RG = controller_.from_base(pose_of(target_));
  const Vec3 way = X_RG.p - X_RT.p;
  const Eigen::AngleAxisd turn(Mat3(X_RG.R * X_RT.R.transpose()));
  const double left = std::max(way.norm(), std::abs(turn.angle()));
  const double speed = std::min({speed_, std::sqrt(2.0 * acceleration_ * left), left / lookahead_s_});
  const double rate = left > 1e-9 ? speed / left : 0.0;
  const Vec3 v = rate * way, w = rate * turn.angle() * turn.axis();
  motion.tool_speed_command({v.x(), v.y(), v.z(), w.x(), w.y(), w.z()}, acceleration_);
}

int RegisterProgram::contact_cycles(const Vector6& direction) {
  const Vector6& f = controller_.contact_force();
  const Vec3 force(f[0], f[1], f[2]), d(direction[0], direction[1], direction[2]);
  const double against = d.norm() > 0.0 ? -force.dot(d.normalized()) : force.norm();
  contact_cycles_ = against >= controller_.mapping().contact_force_N
                        ? std::min(contact_cycles_ + 1, static_cast<int>(kHistory))
                        : 0;
  return contact_cycles_;
}

Vector6 RegisterProgram::position_before(int cycles) const {
  return history_.at(std::min(static_cast<std::size_t>(std::clamp(cycles, 0, 1000000)), history_.size() - 1));
}

void RegisterProgram::advance_approach() {
  if (const int cycles = contact_cycles(approach_->direction); cycles > 0) {
    const std::vector<urscript::Call> calls{{"stopl", {kContactDeceleration}, {}},
                                            {"movel", {list(position_before(cycles))}, {}}};
    approach_.reset();
    begin(urscript::compile(calls), false);
  } else {
    controller_.motion().tool_speed_command(controller_.turned(approach_->speed, false),
                                            approach_->acceleration);
  }
}

}  // namespace takt::ur

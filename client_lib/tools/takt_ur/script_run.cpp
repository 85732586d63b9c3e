#include "client_lib/tools/takt_ur/script_run.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <sstream>

#include "client_lib/gateway/urscript/popup.h"
#include "client_lib/tools/takt_ur/script_functions.h"

namespace takt::ur {
namespace {

using urscript::Function;
using urscript::HostCall;
using urscript::Outcome;
using urscript::ScriptError;
using urscript::Value;
using urscript::ValueError;

/// Arguments of a move that has begun by a blend, computed again when it is its turn.
constexpr double kSameTarget = 1e-6;
/// A servoc without a radius is over; m and rad.
constexpr double kServoArrived = 1e-4;

bool is_move(std::string_view name) {
  return name == "movej" || name == "movel" || name == "movep" || name == "movec" || name == "optimovej" ||
         name == "optimovel";
}

bool similar(const Value& a, const Value& b) {
  if (a.is_number() && b.is_number()) return std::abs(a.number() - b.number()) <= kSameTarget;
  if (a.items() == nullptr || b.items() == nullptr) return a == b;
  const auto &left = a.items()->values, &right = b.items()->values;
  return a.items()->kind == b.items()->kind &&
         std::equal(left.begin(), left.end(), right.begin(), right.end(), similar);
}

}  // namespace

ScriptRun::ScriptRun(UrController& controller, const std::string& name, urscript::Code code)
    : RunningProgram(name),
      controller_(controller),
      sockets_(controller),
      remote_(controller),
      interpreter_(std::move(code), *this) {}

ScriptRun::~ScriptRun() = default;

Outcome ScriptRun::call(const HostCall& call) {
  const CallArguments arguments(call.function, call.arguments);
  const Function::Kind kind = call.function.kind;
  if (kind == Function::Kind::reads || kind == Function::Kind::solves)
    return {false, read_function(controller_, arguments, controller_.motion().position())};
  if (kind == Function::Kind::ignored) return {};
  if (call.function.name == "interpreter_mode") return interpreter_mode(arguments, call.begins);
  if (call.function.name.substr(0, 7) == "modbus_") return {false, controller_.modbus().call(arguments)};
  if (call.function.name == urscript::kRemoteCall) {
    if (call.begins) waiting_[call.thread] = {call.function.name, false, controller_.cycle()};
    auto value = remote_.call(call.thread, call.arguments, call.begins, waiting_.at(call.thread).begun_cycle);
    if (!value) return {true};
    waiting_.erase(call.thread);
    return {false, std::move(*value)};
  }
  if (call.begins) {
    try {
      if (set_function(controller_, arguments) && !urscript::is_blocking_popup(call.function, call.arguments))
        return {};
    } catch (const ScriptError& error) {  // of the controller, which knows no lines
      throw ValueError(error.what());
    }
  }
  // Not what only sets, as force_mode does: a thread may repeat it beside one that moves.
  if (kind == Function::Kind::moves && call.begins) take_control(call.thread);
  if (call.function.name.substr(0, 7) == "socket_") {
    if (call.begins) waiting_[call.thread] = {call.function.name, false, controller_.cycle()};
    auto value = sockets_.call(arguments, call.begins, waiting_.at(call.thread).begun_cycle);
    if (!value) return {true};
    waiting_.erase(call.thread);
    return {false, std::move(*value)};
  }
  if (call.begins) {
    Waiting& waiting =
        waiting_[call.thread] = {call.function.name, kind == Function::Kind::moves, controller_.cycle()};
    if (!begin(call, arguments, waiting)) return {true};
  } else if (!is_over(call, arguments, waiting_.at(call.thread))) {
    return {true};
  }
  waiting_.erase(call.thread);
  return {};
}

std::optional<Value> ScriptRun::foresee(const Function& function, std::span<const Value> arguments) {
  const bool at_present = function.name == "get_forward_kin" && arguments[0].is_none();
  if (function.kind != Function::Kind::solves || at_present) return std::nullopt;
  return read_function(controller_, {function, arguments}, controller_.motion().end());
}

void ScriptRun::ended(std::uint64_t thread) {
  remote_.forget(thread);
  const auto found = waiting_.find(thread);
  if (found == waiting_.end()) return;
  if (found->second.moves) {
    controller_.motion().stop();
    blended_.reset();
  }
  waiting_.erase(found);
}

void ScriptRun::take_control(std::uint64_t thread) const {
  for (const auto& [number, waiting] : waiting_)
    if (number != thread && waiting.moves)
      throw ValueError("Another thread is already controlling the robot");
}

void ScriptRun::wait(Waiting& waiting, double seconds) const {
  waiting.wake_cycle =
      controller_.cycle() +
      static_cast<std::uint64_t>(std::ceil(std::clamp(seconds, 0.0, 1e6) / UrController::kCycle_s));
}

bool ScriptRun::begin(const HostCall& call, const CallArguments& arguments, Waiting& waiting) {
  const std::string_view f = call.function.name;
  if (f == "sleep" || f == "sync") {
    wait(waiting, f == "sync" ? UrController::kCycle_s : arguments.number(0));
  } else if (f == "popup") {
    controller_.log("The program waits until a client of the dashboard sends close popup.");
    waiting.for_popup = controller_.closed_popups();
  } else if (is_move(f)) {
    begin_move(call, arguments, waiting);
  } else if (f == "stopj" || f == "stopl") {
    controller_.motion().stop(std::max(0.1, arguments.number(0, 4.0)));
    waiting.for_motion = true;
    move_ = controller_.motion().moves();
  } else if (f == "servoj") {
    begin_servo(arguments, waiting);
  } else if (f == "servoc") {
    waiting.servo_line = servo_line_of(arguments);
    (void)follow(*waiting.servo_line);
  } else if (f == "speedj" || f == "speedl") {
    begin_speed(arguments, waiting);
  } else if (f == "direct_torque" || f == "torque_command") {
    if (const std::string problem = controller_.command_torques(arguments.six(0)); !problem.empty())
      throw ValueError(problem);
    wait(waiting, UrController::kCycle_s);
  } else if (f == "end_interpreter") {
    leaves_ = executes_;
    return true;
  } else if (f == "clear_interpreter") {
    if (executes_) queue_.clear();
    return true;
  } else {
    throw ValueError("compile_error_name_not_found:" + std::string(f) + ":");
  }
  return false;
}

bool ScriptRun::is_over(const HostCall& call, const CallArguments& arguments, Waiting& waiting) {
  Motion& motion = controller_.motion();
  if (waiting.for_popup) return controller_.closed_popups() > *waiting.for_popup;
  if (waiting.for_rest) {
    if (motion.follows() || !motion.at_rest()) return false;
    waiting.for_rest = false;
    begin_move(call, arguments, waiting);
    return false;
  }
  if (waiting.servo_line) {
    const bool arrives = follow(*waiting.servo_line);
    if (arrives) motion.stop();  // unless another command is next
    return arrives;
  }
  if (waiting.servo_target) motion.servo_with_lag(*waiting.servo_target, servo_lookahead_s_);
  if (executes_ && is_move(waiting.function))
    blend(call.thread);  // a statement may come while its predecessor moves
  if (controller_.cycle() < waiting.wake_cycle || (waiting.for_speed && !motion.has_speed()) ||
      (waiting.for_motion && motion.moves() == move_ && (motion.follows() || !motion.at_rest())))
    return false;
  if (waiting.servo_target) motion.stop();  // unless the next call is a servoj
  return true;
}

// --- motion ---

Move ScriptRun::move_of(const CallArguments& a, const Vector6& near) const {
  const std::string_view f = a.function();
  const Motion& motion = controller_.motion();
  const bool joints = f == "movej" || f == "optimovej", arc = f == "movec",
             timed = f == "movej" || f == "movel", fractions = f.starts_with("optimove");
  constexpr double kFraction = 0.3;
  // The target is a position of all joints or a pose; what the function wants, the other is turned into.
  const auto target = [&](std::size_t i, Vector6& q, Pose& X_RT) {
    if (a[i].list() == nullptr && a[i].pose() == nullptr) a.fail("[q0, .., q5] or p[x, y, z, rx, ry, rz]");
    q = a.six(i);
    X_RT = a[i].list() != nullptr ? motion.tool_pose(q) : controller_.from_base(pose_of(q));
    if (!joints || a[i].list() != nullptr) return;
    const auto found = motion.inverse_kinematics(X_RT, near);
    if (!found) throw ValueError("getInverseKin: unable to find solution!");
    q = *found;
  };
  Move move;
  move.kind = joints ? Move::Kind::joints : arc ? Move::Kind::arc : Move::Kind::line;
  std::size_t at = 0;
  Vector6 via{};
  if (arc) target(at++, via, move.X_RT_via);
  target(at++, move.q, move.X_RT);
  move.options.acceleration = a.number(at++, fractions ? kFraction : 0.0);
  move.options.speed = a.number(at++, fractions ? kFraction : 0.0);
  if (timed) move.options.duration_s = a.number(at++, 0.0);
  if (fractions) move.options = optimised(move.options, joints);
  move.options.blend_radius_m = std::max(0.0, a.number(at, 0.0));
  if (joints && !motion.within_limits(move.q))
    throw ValueError(std::string(f) + ": the target is outside of the joints' ranges");
  return move;
}

void ScriptRun::begin_move(const HostCall& call, const CallArguments& arguments, Waiting& waiting) {
  Motion& motion = controller_.motion();
  const bool under_way = blended_ && motion.moves() > move_;
  const bool is_this =
      under_way && blended_->place == call.place &&
      std::equal(blended_->arguments.begin(), blended_->arguments.end(), call.arguments.begin(), similar);
  blended_.reset();
  if (under_way && !is_this) {  // another thread has changed the target since: the robot comes from there
    waiting.for_rest = true;
    move_ = motion.moves();
    return;
  }
  if (!is_this) controller_.begin(move_of(arguments, motion.position()));
  move_ = motion.moves();
  waiting.for_motion = true;
  blend(call.thread);
}

void ScriptRun::blend(std::uint64_t thread) {
  Motion& motion = controller_.motion();
  if (!motion.takes_successor()) return;
  auto next = interpreter_.next_move(thread);
  if (!next || !is_move(next->function->name)) return;
  try {
    if (controller_.blend_into(move_of({*next->function, next->arguments}, motion.end())))
      blended_ = std::move(next);
  } catch (const ValueError&) {
    // That call fails when it is its turn.
  }
}

void ScriptRun::begin_servo(const CallArguments& a, Waiting& waiting) {
  Motion& motion = controller_.motion();
  waiting.servo_target = a.joints(0);
  if (!motion.within_limits(*waiting.servo_target)) a.fail("[q0, .., q5] within the joints' ranges");
  servo_lookahead_s_ = std::clamp(a.number(4, 0.1), 0.03, 0.2);
  motion.begin_servo();
  motion.servo_with_lag(*waiting.servo_target, servo_lookahead_s_);
  wait(waiting, std::max(UrController::kCycle_s, a.number(3, UrController::kCycle_s)));
}

ScriptRun::ServoLine ScriptRun::servo_line_of(const CallArguments& a) const {
  ServoLine line{controller_.from_base(pose_of(a.pose(0))), a.number(1, 1.2), a.number(2, 0.25),
                 a.number(3, 0.0)};
  if (line.acceleration <= 0.0 || line.speed <= 0.0) a.fail("a > 0 and v > 0");
  line.radius_m = std::max(line.radius_m, kServoArrived);
  return line;
}

// At most with the speed from which it can still brake.
bool ScriptRun::follow(const ServoLine& line) {
  constexpr double kLag_s = 0.1;
  Motion& motion = controller_.motion();
  const Pose X_RT = motion.tool_pose(motion.position());
  const Vec3 way = line.X_RG.p - X_RT.p;
  const Eigen::AngleAxisd turn(Mat3(line.X_RG.R * X_RT.R.transpose()));
  const double left = std::max(way.norm(), std::abs(turn.angle()));
  if (left <= line.radius_m) return true;
  const double speed = std::min({line.speed, std::sqrt(2.0 * line.acceleration * left), left / kLag_s});
  const Vec3 v = speed / left * way, w = speed / left * turn.angle() * turn.axis();
  motion.tool_speed_command({v.x(), v.y(), v.z(), w.x(), w.y(), w.z()}, line.acceleration);
  return false;
}

void ScriptRun::begin_speed(const CallArguments& a, Waiting& waiting) {
  const bool joints = a.function() == "speedj";
  const Vector6 speed = a.joints(0);
  const double acceleration = a.number(1, joints ? 1.4 : 1.2), seconds = a.number(2, 0.0);
  if (acceleration <= 0.0) a.fail("([six speeds], ACCELERATION, SECONDS)");
  if (joints)
    controller_.motion().speed(speed, acceleration);
  else
    controller_.motion().tool_speed_command(controller_.turned(speed, false), acceleration);
  wait(waiting, seconds);
  waiting.for_speed = seconds <= 0.0;  // then it returns when the speed is reached
}

// --- interpreter mode ---

std::string ScriptRun::interpret(std::string_view line) {
  if (line == "skipbuffer") {
    queue_.skip();
  } else if (line == "abort") {
    for (const auto& [thread, waiting] : waiting_)
      if (executes_ && (waiting.function == "movej" || waiting.function == "movel"))
        controller_.motion().stop();
  } else {
    return queue_.answer(line, interpreter_.symbols());
  }
  return "ack: 0: " + std::string(line);
}

Outcome ScriptRun::interpreter_mode(const CallArguments& arguments, bool begins) {
  if (begins) {
    if (arguments.flag(0, true)) queue_.clear_all();
    clears_at_end_ = arguments.flag(1, true);
    leaves_ = false;
    executes_ = false;
  } else if (executes_) {
    queue_.pop();
    executes_ = false;
  }
  if (leaves_) {
    leaves_ = false;
    if (clears_at_end_) queue_.clear_all();
    return {};
  }
  if (queue_.is_empty()) return {true};
  executes_ = true;
  return {false, {}, queue_.begin()};
}

urscript::Program read_script(const std::filesystem::path& file, const std::string& name) {
  std::ifstream in(file);
  std::stringstream text;
  text << in.rdbuf();
  if (!in) throw ScriptError(1, 1, file.string() + " cannot be read");
  urscript::Program program = urscript::parse_program(text.str());
  program.name = name;
  return program;
}

}  // namespace takt::ur

#include "client_lib/tools/takt_ur/external_program.h"

#include <algorithm>
#include <cmath>

namespace takt::ur {
namespace {

using rtde::ControlMode;
using rtde::PointType;
using rtde::TrajectoryAction;
using rtde::TrajectoryResult;

constexpr int kAttempts = 5;
constexpr std::chrono::milliseconds kPause{200};
constexpr double kStopDeceleration = 4.0;
/// Motion commands that need more than this are ignored, rad/s.
constexpr double kIgnoreSpeed = 20.0;
constexpr double kPointTimeout_s = 0.5;
/// The first version with torque control.
constexpr std::array<int, 3> kTorqueControl{5, 23, 0};
constexpr double kQuiet_s = 0.05;
/// A move with a blend begins without its successor after this.
constexpr double kSuccessorTimeout_s = 0.05;
constexpr std::int64_t kStreaming = 2147483647;
constexpr std::int32_t kContactFound = 0, kContactCanceled = 1, kFreedriveStart = 1, kFreedriveStop = -1;

std::uint64_t cycles(double seconds) {
  return static_cast<std::uint64_t>(std::ceil(seconds / UrController::kCycle_s - 1e-9));
}

}  // namespace

ExternalProgram::ExternalProgram(UrController& controller, const urscript::Program& program)
    : RunningProgram(program.name),
      controller_(controller),
      external_(*program.external),
      rest_(controller, program.name, program.code) {
  connect();
}

ExternalProgram::~ExternalProgram() {
  *alive_ = false;
  close_sockets();
}

void ExternalProgram::close_sockets() {
  for (Socket* socket : {&reverse_socket_, &trajectory_socket_, &command_socket_}) {
    if (*socket) (*socket)->finish();
    socket->reset();
  }
}

void ExternalProgram::connect() {
  const auto open = [this](const urscript::ExternalControl::Place& place, Socket& socket, const char* name) {
    controller_.loop().connect(place.host, place.port, kAttempts, kPause,
                               [this, alive = alive_, &socket, name](Socket connection) {
                                 if (*alive) connected(socket, std::move(connection), name);
                               });
  };
  if (!trajectory_socket_)
    open(external_.trajectory, trajectory_socket_, "trajectory");
  else if (!command_socket_)
    open(external_.script_command, command_socket_, "script command");
  else if (!reverse_socket_)
    open(external_.reverse, reverse_socket_, "reverse");
  else
    listen();
}

void ExternalProgram::connected(Socket& socket, Socket connection, const char* name) {
  if (!connection) {
    exit_by(std::string("The ") + name + " socket of the driver at " + external_.reverse.host +
            " cannot be reached; the driver must run, and its ports must be open.");
    return;
  }
  socket = std::move(connection);
  connect();
}

void ExternalProgram::listen() {
  phase_ = Phase::controlled;
  reverse_socket_->start(
      {[this](std::string_view bytes) { reverse_.add(bytes); }, [this] { reverse_closed_ = true; }});
  trajectory_socket_->start({[this](std::string_view bytes) { points_.add(bytes); }, {}});
  command_socket_->start({[this](std::string_view bytes) { commands_.add(bytes); }, {}});
}

void ExternalProgram::exit_by(const std::string& why) {
  controller_.text(why);
  controller_.motion().stop(kStopDeceleration);
  phase_ = Phase::ended;
}

bool ExternalProgram::advance() {
  switch (phase_) {
    case Phase::connecting:
      return true;
    case Phase::ended:
      return !controller_.motion().at_rest();
    case Phase::stopping:
      if (!controller_.motion().at_rest()) return true;
      close_sockets();
      phase_ = Phase::following;
      [[fallthrough]];
    case Phase::following:
      return rest_.advance();
    case Phase::controlled:
      break;
  }
  while (const auto command = commands_.next()) script_command(rtde::script_command(*command));
  bool received = false;
  while (phase_ == Phase::controlled && !cleaning_) {
    const auto bytes = reverse_.next();
    if (!bytes) break;
    received = true;
    handle(rtde::reverse_message(*bytes));
  }
  if (phase_ != Phase::controlled) return true;
  if (cleaning_ && !clean_up()) return true;
  if (!received && (reverse_closed_ || (deadline_cycle_ != 0 && controller_.cycle() >= deadline_cycle_))) {
    exit_by(reverse_closed_
                ? "The driver has closed the reverse socket. The program exits."
                : "Socket timed out waiting for command on reverse_socket. The script will exit now.");
    close_sockets();
    return true;
  }
  if (runs_) advance_trajectory();
  if (mode_ == ControlMode::torque && torque_mode_)
    if (const std::string problem = controller_.command_torques(torques_); !problem.empty())
      throw urscript::ScriptError(1, 1, problem);
  if (watches_contact_) watch_tool_contact();
  if (external_.writes_spline_time && controller_.motion().follows())
    controller_.write_output_double(1, controller_.motion().spline_time_s());
  return true;
}

void ExternalProgram::handle(const rtde::ReverseMessage& message) {
  deadline_cycle_ = message.timeout_ms > 0 ? controller_.cycle() + 1 + cycles(1e-3 * message.timeout_ms) : 0;
  if (message.mode != mode_) change_mode(message.mode);
  if (phase_ != Phase::controlled || cleaning_) return;
  Motion& motion = controller_.motion();
  switch (mode_) {
    case ControlMode::servoj:
      servo_set_point(message.values);
      break;
    case ControlMode::speedj:
      motion.speed(message.values);
      break;
    case ControlMode::speedl:
      motion.tool_speed_command(controller_.turned(message.values, false));
      break;
    case ControlMode::pose: {
      const auto q =
          motion.inverse_kinematics(controller_.from_base(pose_of(message.values)), motion.servo_set_point());
      if (!q) throw urscript::ScriptError(1, 1, "getInverseKin: unable to find solution!");
      servo_set_point(*q);
      break;
    }
    case ControlMode::forward:
      trajectory_action(message);
      break;
    case ControlMode::freedrive:
      freedrive_action(message.raw[0]);
      break;
    case ControlMode::torque:
      torques_ = message.values;
      break;
    default:
      break;
  }
}

void ExternalProgram::change_mode(ControlMode mode) {
  Motion& motion = controller_.motion();
  // A tool in contact stays until the driver ends the detection.
  if (mode_ == ControlMode::tool_in_contact && watches_contact_) return;
  const bool discards = mode_ == ControlMode::forward && runs_ && points_left_ > 0;
  if (mode_ == ControlMode::forward) runs_ = false;
  if (mode_ == ControlMode::freedrive) freedrive_action(kFreedriveStop);
  mode_ = mode;
  motion.stop(kStopDeceleration);
  if (discards) begin_cleanup(AfterCleanup::answer_cancel);
  switch (mode) {
    case ControlMode::servoj:
    case ControlMode::pose:
      motion.begin_servo();
      break;
    case ControlMode::stopped:
      controller_.text("ExternalControl: Stopping communication and control");
      phase_ = Phase::stopping;
      break;
    case ControlMode::torque:
      torque_mode_ = controller_.mapping().version_numbers() >= kTorqueControl;
      if (!torque_mode_)
        controller_.text("Torque control is only supported from software 5.23.0 and upwards.");
      break;
    default:
      break;
  }
}

void ExternalProgram::freedrive_action(std::int32_t action) {
  if (action == kFreedriveStart && !in_freedrive_) {
    controller_.text("Entering freedrive mode");
    controller_.start_freedrive();
    in_freedrive_ = true;
  } else if (action == kFreedriveStop && in_freedrive_) {
    controller_.text("Leaving freedrive mode");
    controller_.end_force_mode();
    in_freedrive_ = false;
  }
}

bool ExternalProgram::servo_set_point(const Vector6& q) {
  Motion& motion = controller_.motion();
  const auto near = [&](const Vector6& from) {
    for (std::size_t i = 0; i < q.size(); ++i)
      if (std::abs(q.at(i) - from.at(i)) > kIgnoreSpeed * UrController::kCycle_s) return false;
    return true;
  };
  if (near(motion.servo_set_point()) || near(motion.position())) {
    if (ignores_commands_) controller_.text("Received valid command. Resuming execution.");
    ignores_commands_ = false;
    motion.servo(q);
    return true;
  }
  if (!ignores_commands_)
    controller_.text("A command needs more than 20 rad/s. Commands are ignored until a valid one comes.");
  ignores_commands_ = true;
  return false;
}

// --- trajectories ---

void ExternalProgram::trajectory_action(const rtde::ReverseMessage& message) {
  switch (static_cast<TrajectoryAction>(message.raw[0])) {
    case TrajectoryAction::start:
    case TrajectoryAction::stream_start:
      announced_ = message.raw[1];
      stream_announced_ = static_cast<TrajectoryAction>(message.raw[0]) == TrajectoryAction::stream_start;
      begin_cleanup(AfterCleanup::start);
      break;
    case TrajectoryAction::stream_end:
      if (!streaming_) break;
      points_left_ = message.raw[1] - (kStreaming - points_left_);
      streaming_ = false;
      break;
    case TrajectoryAction::cancel:
      if (streaming_) points_left_ = message.raw[1] - (kStreaming - points_left_);
      streaming_ = false;
      begin_cleanup(AfterCleanup::answer_cancel);
      break;
    case TrajectoryAction::noop:
      break;
  }
}

void ExternalProgram::begin_cleanup(AfterCleanup then) {
  runs_ = finishing_ = false;
  next_point_.reset();
  cleaning_ = true;
  cleaning_since_ = controller_.cycle();
  after_cleanup_ = then;
  if (then != AfterCleanup::start || points_left_ > 0) controller_.motion().stop(kStopDeceleration);
  clean_up();
}

bool ExternalProgram::clean_up() {
  while (points_left_ > 0) {
    if (points_.next()) {
      --points_left_;
      cleaning_since_ = controller_.cycle();
    } else if (controller_.cycle() > cleaning_since_ + cycles(kPointTimeout_s)) {
      points_left_ = 0;
    } else {
      return false;
    }
  }
  if (!controller_.motion().at_rest()) return false;
  cleaning_ = false;
  if (after_cleanup_ == AfterCleanup::answer_cancel) {
    if (external_.answers_cancel) answer_trajectory(TrajectoryResult::canceled);
  } else if (after_cleanup_ == AfterCleanup::start) {
    start_trajectory();
  }
  return true;
}

void ExternalProgram::start_trajectory() {
  runs_ = first_point_ = true;
  finishing_ = moving_ = false;
  streaming_ = was_streaming_ = stream_announced_;
  points_left_ = streaming_ ? kStreaming : announced_;
  result_ = TrajectoryResult::success;
  waiting_since_ = controller_.cycle();
  spline_qd_ = spline_qdd_ = {};
}

void ExternalProgram::advance_trajectory() {
  Motion& motion = controller_.motion();
  if (motion.follows()) {
    waiting_since_ = controller_.cycle();
    if (motion.takes_successor() && !next_point_) offer_successor();
    return;
  }
  if (finishing_) {
    if (!motion.at_rest()) return;
    runs_ = finishing_ = false;
    answer_trajectory(result_);
    return;
  }
  if (points_left_ <= 0 && !next_point_) {
    finish_trajectory(result_);
    return;
  }
  if (!next_point_) {
    if (const auto bytes = points_.next()) {
      --points_left_;
      next_point_ = rtde::trajectory_point(*bytes);
      waiting_since_ = controller_.cycle();
    }
  }
  if (next_point_) {
    const bool blends = next_point_->type != PointType::spline && next_point_->blend_radius_m > 0.0;
    if (blends && points_left_ > 0 && points_.whole_messages() == 0 &&
        controller_.cycle() < waiting_since_ + cycles(kSuccessorTimeout_s))
      return;
    waiting_since_ = controller_.cycle();
    const rtde::TrajectoryPoint point = *next_point_;
    next_point_.reset();
    take_point(point, points_left_ == 0);
    first_point_ = false;
    if (result_ != TrajectoryResult::success) finish_trajectory(result_);
    if (motion.takes_successor()) offer_successor();
    return;
  }
  if (controller_.cycle() <= waiting_since_ + cycles(moving_ ? UrController::kCycle_s : kPointTimeout_s))
    return;
  --points_left_;
  const bool drained = was_streaming_ && !streaming_ && points_left_ < 0;
  if (was_streaming_) points_left_ = 0;  // no more points are announced
  if (!drained) controller_.text("Receiving trajectory point failed!");
  finish_trajectory(drained ? TrajectoryResult::success : TrajectoryResult::failure);
}

void ExternalProgram::finish_trajectory(TrajectoryResult result) {
  result_ = result;
  finishing_ = true;
  controller_.motion().stop(kStopDeceleration);
}

void ExternalProgram::answer_trajectory(TrajectoryResult result) {
  if (trajectory_socket_) trajectory_socket_->send(rtde::int32_bytes(static_cast<std::int32_t>(result)));
}

void ExternalProgram::offer_successor() {
  if (points_left_ <= 0) return;
  const auto bytes = points_.next();
  if (!bytes) return;
  --points_left_;
  next_point_ = rtde::trajectory_point(*bytes);
  if (next_point_->type == PointType::spline) return;
  const auto move = move_of(*next_point_, points_left_ == 0, controller_.motion().end());
  if (move && controller_.blend_into(*move)) next_point_.reset();
}

std::optional<Move> ExternalProgram::move_of(const rtde::TrajectoryPoint& point, bool last,
                                             const Vector6& near) const {
  const Motion& motion = controller_.motion();
  Move move;
  move.options = {point.third[0], point.third[1], point.time_s, last ? 0.0 : point.blend_radius_m};
  const auto pose = [&](const Vector6& values, bool is_pose) {
    return is_pose ? controller_.from_base(pose_of(values)) : motion.tool_pose(values);
  };
  const auto is_of = [&](std::initializer_list<PointType> types) {
    return std::find(types.begin(), types.end(), point.type) != types.end();
  };
  using enum PointType;
  const bool target_is_pose =
      is_of({movej_pose, optimovej_pose, movel, movep, optimovel, movec, movec_pose_joint});
  if (!is_of({movej, movej_pose, movel, movel_joint})) move.options.duration_s = 0.0;
  if (is_of({movej, movej_pose, optimovej, optimovej_pose})) {
    move.q = point.target;
    if (target_is_pose) {
      const bool near_given = point.third[2] != 0.0;
      const auto found =
          motion.inverse_kinematics(pose(point.target, true), near_given ? point.second : near);
      if (!found) throw urscript::ScriptError(1, 1, "getInverseKin: unable to find solution!");
      move.q = *found;
    }
    if (!motion.within_limits(move.q))
      throw urscript::ScriptError(1, 1, "movej: the target is outside of the joints' ranges");
    if (is_of({optimovej, optimovej_pose})) move.options = optimised(move.options, true);
    return move;
  }
  if (is_of({movec, movec_joint, movec_joint_pose, movec_pose_joint})) {
    move.kind = Move::Kind::arc;
    move.X_RT_via = pose(point.second, is_of({movec, movec_joint_pose}));
  } else if (is_of({movel, movel_joint, movep, movep_joint, optimovel, optimovel_joint})) {
    move.kind = Move::Kind::line;
  } else {
    return std::nullopt;
  }
  move.X_RT = pose(point.target, target_is_pose);
  return move;
}

void ExternalProgram::take_point(const rtde::TrajectoryPoint& point, bool last) {
  if (point.type == PointType::spline) {
    take_spline(point, last);
    return;
  }
  moving_ = false;
  spline_qd_ = spline_qdd_ = {};
  const auto move = move_of(point, last, controller_.motion().position());
  if (move) {
    controller_.begin(*move);
    return;
  }
  controller_.text("Trajectory points of type " + std::to_string(static_cast<int>(point.type)) +
                   " are not supported by takt.");
  result_ = TrajectoryResult::failure;
}

void ExternalProgram::take_spline(const rtde::TrajectoryPoint& point, bool last) {
  Motion& motion = controller_.motion();
  const Vector6& from = motion.position();
  const double T = point.time_s;
  if (point.spline_type != 1 && point.spline_type != 2) {
    controller_.text("Unknown spline type given: " + std::to_string(point.spline_type));
    result_ = TrajectoryResult::failure;
    return;
  }
  if (T <= 0.0) {
    double distance = 0.0;
    for (std::size_t i = 0; i < from.size(); ++i) distance += std::pow(point.target.at(i) - from.at(i), 2);
    moving_ = false;
    if (first_point_ && T == 0.0 && std::sqrt(distance) < 0.01) {
      if (external_.writes_spline_time) controller_.write_output_double(1, 0.0);
      return;
    }
    controller_.text(
        "Spline time shouldn't be zero as it would require infinite velocity to reach the target. Canceling "
        "motion.");
    result_ = TrajectoryResult::canceled;
    return;
  }
  for (std::size_t i = 0; i < from.size(); ++i) {
    if (std::abs(point.target.at(i) - from.at(i)) / T <= kIgnoreSpeed) continue;
    controller_.text("A spline needs more than 20 rad/s. The trajectory is cancelled.");
    result_ = TrajectoryResult::canceled;
    return;
  }
  const bool quintic = point.spline_type == 2;
  Spline spline;
  spline.duration_s = T;
  spline.last = last;
  const double T2 = T * T, T3 = T2 * T, T4 = T3 * T, T5 = T4 * T;
  for (std::size_t i = 0; i < from.size(); ++i) {
    const double q0 = from.at(i), q1 = point.target.at(i), v0 = spline_qd_.at(i), v1 = point.second.at(i);
    const double a0 = spline_qdd_.at(i), a1 = point.third.at(i);
    auto& c = spline.coefficients;
    c[0].at(i) = q0;
    c[1].at(i) = v0;
    if (quintic) {
      c[2].at(i) = 0.5 * a0;
      c[3].at(i) = (20.0 * (q1 - q0) - 3.0 * a0 * T2 + a1 * T2 - 12.0 * v0 * T - 8.0 * v1 * T) / (2.0 * T3);
      c[4].at(i) =
          (30.0 * (q0 - q1) + 3.0 * a0 * T2 - 2.0 * a1 * T2 + 16.0 * v0 * T + 14.0 * v1 * T) / (2.0 * T4);
      c[5].at(i) = (12.0 * (q1 - q0) - a0 * T2 + a1 * T2 - 6.0 * v0 * T - 6.0 * v1 * T) / (2.0 * T5);
    } else {
      c[2].at(i) = (3.0 * (q1 - q0) - 2.0 * v0 * T - v1 * T) / T2;
      c[3].at(i) = (2.0 * (q0 - q1) + v0 * T + v1 * T) / T3;
    }
  }
  motion.run_spline(spline);
  moving_ = !last;
  spline_qd_ = point.second;
  spline_qdd_ = quintic ? point.third : Vector6{};
}

// --- script commands ---

void ExternalProgram::script_command(const rtde::ScriptCommand& command) {
  using Type = rtde::ScriptCommandType;
  const auto& v = command.values;
  switch (command.type) {
    case Type::zero_ftsensor:
      controller_.zero_force_sensor();
      break;
    case Type::set_payload:
      controller_.set_payload({v[0], {v[1], v[2], v[3]}, {}});
      break;
    case Type::set_target_payload:
      controller_.set_payload({v[0], {v[1], v[2], v[3]}, {v[4], v[5], v[6], v[7], v[8], v[9]}});
      break;
    case Type::set_gravity:
      controller_.set_gravity({v[0], v[1], v[2]});
      break;
    case Type::set_tcp_offset:
      controller_.set_tcp({v[0], v[1], v[2], v[3], v[4], v[5]});
      break;
    case Type::set_tool_voltage:
      controller_.set_tool_voltage(static_cast<int>(std::lround(v[0])));
      break;
    case Type::start_tool_contact:
      watches_contact_ = true;
      break;
    case Type::end_tool_contact:
      if (mode_ != ControlMode::tool_in_contact && command_socket_)
        command_socket_->send(rtde::int32_bytes(kContactCanceled));
      watches_contact_ = false;
      break;
    case Type::start_force_mode: {
      ForceModeOptions options;
      options.X_RK = controller_.from_base(pose_of({v[0], v[1], v[2], v[3], v[4], v[5]}));
      for (std::size_t i = 0; i < 6; ++i) {
        options.compliant.at(i) = v.at(6 + i) != 0.0;
        options.wrench.at(i) = v.at(12 + i);
        options.speed_limit.at(i) = v.at(19 + i);
      }
      options.type = force_mode_type(v[18]);
      options.damping = v[25];
      options.gain = v[26];
      controller_.start_force_mode(options);
      break;
    }
    case Type::end_force_mode:
      controller_.end_force_mode();
      break;
    case Type::set_friction_compensation:
    case Type::set_friction_scales:
      controller_.text("Friction compensation has no effect: torques act on drives with their friction.");
      break;
    case Type::ft_rtde_input_enable:
      controller_.set_driver_sensor({v[0] != 0.0, Vec3(v[2], v[3], v[4]), Vec3(v[5], v[6], v[7]), v[1]});
      break;
  }
}

void ExternalProgram::watch_tool_contact() {
  if (mode_ == ControlMode::tool_in_contact) return;
  const Vector6& f = controller_.contact_force();
  if (std::hypot(f[0], f[1], f[2]) < controller_.mapping().contact_force_N) return;
  runs_ = finishing_ = false;
  controller_.motion().stop(kStopDeceleration);
  mode_ = ControlMode::tool_in_contact;
  controller_.text("tool contact detected");
  if (command_socket_) command_socket_->send(rtde::int32_bytes(kContactFound));
  if (points_left_ > 0) begin_cleanup(AfterCleanup::nothing);
}

// --- programs that a driver serves ---

RequestedProgram::RequestedProgram(UrController& controller, std::string name, const std::string& host,
                                   std::uint16_t port)
    : RunningProgram(std::move(name)),
      controller_(controller),
      deadline_cycle_(controller.cycle() + cycles(10.0)) {
  controller.loop().connect(host, port, kAttempts, kPause, [this, alive = alive_](auto connection) {
    if (!*alive) return;
    failed_ = connection == nullptr;
    if (failed_) return;
    connection_ = std::move(connection);
    connection_->start({[this](std::string_view bytes) {
                          text_.append(bytes);
                          newest_cycle_ = controller_.cycle();
                          failed_ = text_.size() > urscript::ScriptStream::kMostBytes;
                        },
                        [this] { complete_ = true; }});
    connection_->send("request_program\n");
  });
}

RequestedProgram::~RequestedProgram() {
  *alive_ = false;
}

bool RequestedProgram::advance() {
  if (program_) return program_->advance();
  if (failed_ || controller_.cycle() > deadline_cycle_) {
    controller_.text("The driver that serves the program " + name() + " does not answer.");
    return false;
  }
  // Drivers leave the connection open: the text ends where no further bytes come.
  const bool whole = text_.find("# NODE_CONTROL_LOOP_ENDS") != std::string::npos &&
                     controller_.cycle() > newest_cycle_ + cycles(kQuiet_s);
  if (!complete_ && !whole) return true;
  urscript::Program program = urscript::parse_program(text_);
  program.name = name();
  if (!program.external)
    throw urscript::ScriptError(1, 1, "the driver's program has no sockets of external control");
  connection_.reset();
  program_ = std::make_unique<ExternalProgram>(controller_, program);
  return true;
}

}  // namespace takt::ur

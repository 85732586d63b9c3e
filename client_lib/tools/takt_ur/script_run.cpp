#include "client_lib/tools/takt_ur/script_run.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <fstream>
#include <sstream>

namespace takt::ur {
namespace {

using urscript::Call;
using urscript::Literal;
using Kind = urscript::Instruction::Kind;

/// A loop without a call that waits yields after this many calls.
constexpr int kMostCallsPerCycle = 100;
constexpr std::array<std::string_view, 4> kMoves{"movej", "movel", "movep", "movec"};
constexpr std::array<std::string_view, 9> kOtherMotions{"stopj",      "stopl",          "speedj",
                                                        "speedl",     "servoj",         "force_mode",
                                                        "teach_mode", "freedrive_mode", "interpreter_mode"};
/// May stand between two moves that are blended.
constexpr std::array<std::string_view, 15> kBetweenMoves{"textmsg",
                                                         "set_standard_digital_out",
                                                         "set_configurable_digital_out",
                                                         "set_tool_digital_out",
                                                         "set_digital_out",
                                                         "set_standard_analog_out",
                                                         "set_analog_out",
                                                         "set_tool_voltage",
                                                         "set_payload",
                                                         "set_target_payload",
                                                         "set_payload_mass",
                                                         "set_payload_cog",
                                                         "write_output_boolean_register",
                                                         "write_output_float_register",
                                                         "write_output_integer_register"};

template <std::size_t count>
bool is_of(const std::array<std::string_view, count>& names, std::string_view name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

/// The argument at a position or of a name; nullptr: not given.
const Literal* find(const Call& call, std::size_t position, const char* name) {
  if (const auto named = call.named.find(name); named != call.named.end()) return &named->second;
  return position < call.arguments.size() ? &call.arguments[position] : nullptr;
}

template <class Type>
const Type* argument(const Call& call, std::size_t position, const char* name) {
  const Literal* value = find(call, position, name);
  return value == nullptr ? nullptr : std::get_if<Type>(value);
}

double number(const Call& call, std::size_t position, const char* name, double otherwise) {
  const auto* value = argument<double>(call, position, name);
  return value == nullptr ? otherwise : *value;
}

std::optional<Vector6> six(const std::vector<double>& values) {
  if (values.size() != 6) return std::nullopt;
  Vector6 result;
  std::copy(values.begin(), values.end(), result.begin());
  return result;
}

std::string text_of(const Literal* value) {
  if (value == nullptr) return {};
  if (const auto* text = std::get_if<std::string>(value)) return *text;
  if (const auto* flag = std::get_if<bool>(value)) return *flag ? "True" : "False";
  const auto* number = std::get_if<double>(value);
  if (number == nullptr) return {};
  std::array<char, 32> digits{};
  return {digits.data(), std::to_chars(digits.data(), digits.data() + digits.size(), *number).ptr};
}

std::string socket_name(const Call& call, std::size_t position) {
  const auto* name = argument<std::string>(call, position, "socket_name");
  return name == nullptr ? "socket_0" : *name;
}

/// What a call that sends to a socket writes: an integer has four bytes, the most significant one first.
std::string bytes_of(const Call& call) {
  const std::string& f = call.function;
  if (f == "socket_set_var")
    return "set " + text_of(find(call, 0, "name")) + " " + text_of(find(call, 1, "value")) + "\n";
  const Literal* value =
      find(call, 0, f == "socket_send_line" || f == "socket_send_string" ? "str" : "value");
  if (f == "socket_send_line") return text_of(value) + "\n";
  if (f == "socket_send_string") return text_of(value);
  const double number =
      value != nullptr && std::holds_alternative<double>(*value) ? std::get<double>(*value) : 0.0;
  const auto whole = static_cast<std::uint32_t>(std::llround(number));
  std::string bytes;
  for (int shift = f == "socket_send_int" ? 24 : 0; shift >= 0; shift -= 8)
    bytes += static_cast<char>(whole >> static_cast<unsigned>(shift) & 0xffU);
  return bytes;
}

}  // namespace

ScriptRun::ScriptRun(UrController& controller, const urscript::Program& program)
    : RunningProgram(program.name), controller_(controller), instructions_(program.instructions) {}

ScriptRun::~ScriptRun() {
  *alive_ = false;
  for (auto& [name, socket] : sockets_)
    if (socket) socket->finish();
}

bool ScriptRun::moves(const urscript::Program& program) {
  return std::any_of(program.instructions.begin(), program.instructions.end(), [](const auto& instruction) {
    return is_of(kMoves, instruction.call.function) || is_of(kOtherMotions, instruction.call.function);
  });
}

bool ScriptRun::advance() {
  for (int calls = 0; calls < kMostCallsPerCycle; ++calls) {
    if (next_ >= instructions_.size()) return false;
    const urscript::Instruction& instruction = instructions_[next_];
    switch (instruction.kind) {
      case Kind::halt:
        return false;
      case Kind::loop_begin:
        ++next_;
        break;
      case Kind::loop_end:
        next_ = instruction.other;
        break;
      case Kind::call:
        if (instruction.call.function == "interpreter_mode") {
          if (!interprets_) enter_interpreter(instruction.call);
          if (!advance_interpreter()) return !halted_;
        } else if (!execute(instruction.call)) {
          return true;
        }
        ++next_;
    }
  }
  return true;
}

std::string ScriptRun::interpret(std::string_view line) {
  if (line == "skipbuffer") {
    queue_.skip();
  } else if (line == "abort") {
    const bool moves = interprets_ && begun_ && !queue_.statements().empty();
    const std::string function = moves ? queue_.statements().front().call.function : std::string();
    if (function == "movej" || function == "movel") controller_.motion().stop();
  } else {
    return queue_.answer(line);
  }
  return "ack: 0: " + std::string(line);
}

void ScriptRun::enter_interpreter(const Call& call) {
  const auto flag = [&](std::size_t position, const char* name) {
    const auto* value = argument<bool>(call, position, name);
    return value == nullptr || *value;
  };
  if (flag(0, "clearQueueOnEnter")) queue_.clear_all();
  clears_at_end_ = flag(1, "clearOnEnd");
  interprets_ = true;
  blended_.reset();
}

void ScriptRun::leave_interpreter() {
  queue_.pop();
  if (clears_at_end_) queue_.clear_all();
  interprets_ = false;
  blended_.reset();
}

bool ScriptRun::advance_interpreter() {
  for (int calls = 0; calls < kMostCallsPerCycle && !queue_.statements().empty(); ++calls) {
    const Call& call = queue_.statements().front().call;
    if (!begun_) queue_.begin();
    if (call.function == "end_interpreter") {
      leave_interpreter();
      return true;
    }
    if (call.function == "halt") {
      halted_ = true;
      return false;
    }
    if (call.function == "clear_interpreter")
      queue_.clear();
    else if (!execute(call))
      return false;
    queue_.pop();
  }
  return false;
}

void ScriptRun::fail(const Call& call, const std::string& text) {
  throw urscript::ScriptError(call.line, call.column, text);
}

bool ScriptRun::execute(const Call& call) {
  if (!begun_) {
    waits_for_motion_ = waits_for_speed_ = false;
    wake_cycle_ = 0;
    if (begin(call)) return true;
    begun_ = true;
    return false;
  }
  Motion& motion = controller_.motion();
  if (servo_target_) motion.servo_with_lag(*servo_target_, servo_lookahead_s_);
  if (interprets_ && is_of(kMoves, call.function))
    blend();  // a statement may come while its predecessor moves
  if (controller_.cycle() < wake_cycle_ || connecting_ || (waits_for_speed_ && !motion.has_speed()) ||
      (waits_for_motion_ && motion.moves() == move_ && (motion.follows() || !motion.at_rest())))
    return false;
  if (servo_target_) motion.stop();  // unless the next call is a servoj
  servo_target_.reset();
  begun_ = false;
  return true;
}

void ScriptRun::begin_force_mode(const Call& call) {
  const auto* frame = argument<urscript::PoseLiteral>(call, 0, "task_frame");
  const auto* selection = argument<std::vector<double>>(call, 1, "selection_vector");
  const auto* wrench = argument<std::vector<double>>(call, 2, "wrench");
  const auto* limits = argument<std::vector<double>>(call, 4, "limits");
  const auto has_six = [](const std::vector<double>* values) {
    return values != nullptr && values->size() == 6;
  };
  if (frame == nullptr || !six(frame->values) || !has_six(selection) || !has_six(wrench) || !has_six(limits))
    fail(call, "force_mode: allowed: (p[..], [selection], [wrench], TYPE, [limits]), six numbers each");
  ForceModeOptions options = controller_.next_force_mode();
  options.X_RK = controller_.from_base(pose_of(*six(frame->values)));
  for (std::size_t i = 0; i < 6; ++i) {
    options.compliant.at(i) = (*selection)[i] != 0.0;
    options.wrench.at(i) = (*wrench)[i];
    options.speed_limit.at(i) = (*limits)[i];
  }
  options.type = force_mode_type(number(call, 3, "type", 0.0));
  controller_.start_force_mode(options);
}

Move ScriptRun::move_of(const Call& call, const Vector6& near) const {
  const std::string& f = call.function;
  const Motion& motion = controller_.motion();
  const bool joints = f == "movej", arc = f == "movec", timed = joints || f == "movel";
  // The target is a position of all joints or a pose; what the function wants, the other is turned into.
  const auto target = [&](std::size_t position, const char* name, Vector6& q, Pose& X_RT) {
    const auto* list = argument<std::vector<double>>(call, position, name);
    const auto* pose = argument<urscript::PoseLiteral>(call, position, name);
    const auto values = list != nullptr ? six(*list) : pose != nullptr ? six(pose->values) : std::nullopt;
    if (!values) fail(call, f + ": allowed: [q0, .., q5] or p[x, y, z, rx, ry, rz]");
    q = *values;
    X_RT = list != nullptr ? motion.tool_pose(*values) : controller_.from_base(pose_of(*values));
    if (!joints || list != nullptr) return;
    const auto found = motion.inverse_kinematics(X_RT, near);
    if (!found) fail(call, "getInverseKin: unable to find solution!");
    q = *found;
  };
  Move move;
  move.kind = joints ? Move::Kind::joints : arc ? Move::Kind::arc : Move::Kind::line;
  std::size_t at = 0;
  Vector6 via{};
  if (arc) target(at++, "pose_via", via, move.X_RT_via);
  target(at++, joints ? "q" : arc ? "pose_to" : "pose", move.q, move.X_RT);
  move.options.acceleration = number(call, at++, "a", 0.0);
  move.options.speed = number(call, at++, "v", 0.0);
  if (timed) move.options.duration_s = number(call, at++, "t", 0.0);
  move.options.blend_radius_m = std::max(0.0, number(call, at, "r", 0.0));
  if (joints && !motion.within_limits(move.q))
    fail(call, "movej: the target is outside of the joints' ranges");
  return move;
}

std::uint64_t ScriptRun::place() const {
  return interprets_ ? queue_.statements().front().id : next_;
}

std::optional<ScriptRun::NextMove> ScriptRun::next_move() const {
  if (interprets_) {
    const auto& statements = queue_.statements();
    for (auto statement = statements.begin() + 1; statement != statements.end(); ++statement) {
      if (is_of(kMoves, statement->call.function)) return NextMove{statement->id, &statement->call};
      if (!is_of(kBetweenMoves, statement->call.function)) break;
    }
    return std::nullopt;
  }
  std::size_t at = next_;
  for (int steps = 0; steps < kMostCallsPerCycle; ++steps) {
    if (++at >= instructions_.size()) return std::nullopt;
    const urscript::Instruction& instruction = instructions_[at];
    if (instruction.kind == Kind::loop_end) at = instruction.other;
    if (instruction.kind == Kind::halt) return std::nullopt;
    if (instruction.kind != Kind::call) continue;
    if (is_of(kMoves, instruction.call.function)) return NextMove{at, &instruction.call};
    if (!is_of(kBetweenMoves, instruction.call.function)) return std::nullopt;
  }
  return std::nullopt;
}

void ScriptRun::begin_move(const Call& call) {
  Motion& motion = controller_.motion();
  const bool is_under_way = blended_ == place() && motion.moves() > move_;
  blended_.reset();
  if (!is_under_way) controller_.begin(move_of(call, motion.position()));
  move_ = motion.moves();
  waits_for_motion_ = true;
  blend();
}

void ScriptRun::blend() {
  Motion& motion = controller_.motion();
  const auto next = motion.takes_successor() ? next_move() : std::nullopt;
  if (!next) return;
  try {
    if (controller_.blend_into(move_of(*next->call, motion.end()))) blended_ = next->place;
  } catch (const urscript::ScriptError&) {
    // That call fails when it is its turn.
  }
}

void ScriptRun::wait(double seconds) {
  wake_cycle_ = controller_.cycle() +
                static_cast<std::uint64_t>(std::ceil(std::clamp(seconds, 0.0, 1e6) / UrController::kCycle_s));
}

bool ScriptRun::begin(const Call& call) {
  const std::string& f = call.function;
  Motion& motion = controller_.motion();
  if (f == "textmsg") {
    std::string text;
    for (std::size_t i = 0; i < call.arguments.size(); ++i)
      if (const auto* part = argument<std::string>(call, i, "s1"))
        text += *part;
      else if (const auto* value = argument<double>(call, i, "s1"))
        text += std::to_string(*value);
      else if (const auto* flag = argument<bool>(call, i, "s1"))
        text += *flag ? "True" : "False";
    controller_.text(text);
    return true;
  }
  if (f == "popup") {
    const auto* text = argument<std::string>(call, 0, "s");
    controller_.text(text == nullptr ? "" : *text);
    return true;
  }
  if (f == "sleep" || f == "sync") {
    const double seconds = f == "sync" ? UrController::kCycle_s : number(call, 0, "t", 0.0);
    wait(seconds);
    return false;
  }
  if (f == "protective_stop") {
    controller_.protective_stop("a program has asked for it");
    return true;
  }
  if (is_of(kMoves, f)) {
    begin_move(call);
    return false;
  }
  if (f == "stopj" || f == "stopl") {
    motion.stop(std::max(0.1, number(call, 0, "a", 4.0)));
    waits_for_motion_ = true;
    move_ = motion.moves();
    return false;
  }
  if (f == "servoj") {
    const auto* list = argument<std::vector<double>>(call, 0, "q");
    servo_target_ = list != nullptr ? six(*list) : std::nullopt;
    if (!servo_target_ || !motion.within_limits(*servo_target_))
      fail(call, "servoj: allowed: [q0, .., q5] within the joints' ranges");
    servo_lookahead_s_ = std::clamp(number(call, 4, "lookahead_time", 0.1), 0.03, 0.2);
    motion.begin_servo();
    motion.servo_with_lag(*servo_target_, servo_lookahead_s_);
    wait(std::max(UrController::kCycle_s, number(call, 3, "t", UrController::kCycle_s)));
    return false;
  }
  if (f == "speedj" || f == "speedl") {
    const bool joints = f == "speedj";
    const auto* list = argument<std::vector<double>>(call, 0, joints ? "qd" : "xd");
    const auto speed = list != nullptr ? six(*list) : std::nullopt;
    const double acceleration = number(call, 1, "a", joints ? 1.4 : 1.2), seconds = number(call, 2, "t", 0.0);
    if (!speed || acceleration <= 0.0) fail(call, f + ": allowed: ([six speeds], ACCELERATION, SECONDS)");
    if (joints)
      motion.speed(*speed, acceleration);
    else
      motion.tool_speed_command(controller_.turned(*speed, false), acceleration);
    wait(seconds);
    waits_for_speed_ = seconds <= 0.0;  // then it returns when the speed is reached
    return false;
  }
  if (f == "set_standard_digital_out" || f == "set_configurable_digital_out" || f == "set_tool_digital_out" ||
      f == "set_digital_out") {
    const auto* value = argument<bool>(call, 1, "b");
    const double n = number(call, 0, "n", -1.0);
    const int first = f == "set_configurable_digital_out" ? 8 : f == "set_tool_digital_out" ? 16 : 0;
    const int most = f == "set_digital_out" ? 17 : f == "set_tool_digital_out" ? 1 : 7;
    if (value == nullptr || n != std::floor(n) || n < 0.0 || n > most)
      fail(call, f + ": allowed: (N, True or False), N 0 to " + std::to_string(most));
    controller_.set_digital_output(first + static_cast<int>(n), *value);
    return true;
  }
  if (f == "set_standard_analog_out" || f == "set_analog_out") {
    const double n = number(call, 0, "n", -1.0);
    if (n != 0.0 && n != 1.0) fail(call, f + ": allowed: (0 or 1, FRACTION)");
    controller_.set_analog_output(static_cast<int>(n), number(call, 1, "f", 0.0));
    return true;
  }
  if (f == "set_tool_voltage") {
    const double volts = number(call, 0, "voltage", -1.0);
    if (volts != 0.0 && volts != 12.0 && volts != 24.0) fail(call, f + ": allowed: 0, 12, 24");
    controller_.set_tool_voltage(static_cast<int>(volts));
    return true;
  }
  if (f == "set_payload" || f == "set_target_payload") {
    Payload payload{number(call, 0, "m", 0.0)};
    if (const auto* cog = argument<std::vector<double>>(call, 1, "cog"); cog != nullptr && cog->size() == 3)
      std::copy(cog->begin(), cog->end(), payload.center_of_gravity_m.begin());
    if (const auto* inertia = argument<std::vector<double>>(call, 2, "inertia");
        inertia != nullptr && inertia->size() == 6)
      std::copy(inertia->begin(), inertia->end(), payload.inertia_kg_m2.begin());
    controller_.set_payload(payload);
    return true;
  }
  if (f == "set_payload_mass" || f == "set_payload_cog") {
    Payload payload = controller_.payload();
    if (f == "set_payload_mass")
      payload.mass_kg = number(call, 0, "m", 0.0);
    else if (const auto* cog = argument<std::vector<double>>(call, 0, "CoG");
             cog != nullptr && cog->size() == 3)
      std::copy(cog->begin(), cog->end(), payload.center_of_gravity_m.begin());
    else
      fail(call, "set_payload_cog: allowed: [x, y, z]");
    controller_.set_payload(payload);
    return true;
  }
  if (f == "set_tcp") {
    const auto* pose = argument<urscript::PoseLiteral>(call, 0, "pose");
    const auto offset = pose != nullptr ? six(pose->values) : std::nullopt;
    if (!offset) fail(call, "set_tcp: allowed: p[x, y, z, rx, ry, rz]");
    controller_.set_tcp(*offset);
    return true;
  }
  if (f == "set_gravity") {
    const auto* g = argument<std::vector<double>>(call, 0, "d");
    if (g == nullptr || g->size() != 3) fail(call, "set_gravity: allowed: [x, y, z]");
    controller_.set_gravity({(*g)[0], (*g)[1], (*g)[2]});
    return true;
  }
  if (f == "zero_ftsensor") {
    controller_.zero_force_sensor();
    return true;
  }
  if (f == "force_mode") {
    begin_force_mode(call);
    return true;
  }
  if (f == "force_mode_set_damping" || f == "force_mode_set_gain_scaling") {
    ForceModeOptions& next = controller_.next_force_mode();
    (f == "force_mode_set_damping" ? next.damping : next.gain) =
        number(call, 0, f == "force_mode_set_damping" ? "damping" : "scaling", -1.0);
    if (const std::string problem = problem_of(next); !problem.empty()) fail(call, problem);
    return true;
  }
  if (f == "freedrive_mode" || f == "teach_mode") {
    controller_.start_freedrive();
    return true;
  }
  if (f == "end_force_mode" || f == "end_freedrive_mode" || f == "end_teach_mode") {
    controller_.end_force_mode();
    return true;
  }
  if (f == "write_output_float_register") {
    controller_.write_output_double(static_cast<int>(number(call, 0, "address", -1.0)),
                                    number(call, 1, "value", 0.0));
    return true;
  }
  if (f == "write_output_boolean_register") {
    const auto* value = argument<bool>(call, 1, "value");
    if (value == nullptr) fail(call, f + ": allowed: (N, True or False)");
    controller_.write_output_bit(static_cast<int>(number(call, 0, "address", -1.0)), *value);
    return true;
  }
  if (f == "write_output_integer_register") {
    controller_.write_output_int(static_cast<int>(number(call, 0, "address", -1.0)),
                                 std::llround(number(call, 1, "value", 0.0)));
    return true;
  }
  if (f.substr(0, 7) == "socket_") return begin_socket_call(call);
  fail(call, "compile_error_name_not_found:" + f + ":");
}

// As the real controller: what is sent without a connection is lost, and the program goes on.
bool ScriptRun::begin_socket_call(const Call& call) {
  const std::string& f = call.function;
  if (f == "socket_open") {
    const auto* host = argument<std::string>(call, 0, "address");
    const double port = number(call, 1, "port", 0.0);
    if (host == nullptr || port < 1.0 || port > 65535.0)
      fail(call, "socket_open: allowed: (HOST, PORT, NAME)");
    connecting_ = true;
    controller_.loop().connect(*host, static_cast<std::uint16_t>(port), 1, std::chrono::seconds(0),
                               [this, alive = alive_, key = socket_name(call, 2)](auto connection) {
                                 if (!*alive) return;
                                 connecting_ = false;
                                 sockets_[key] = std::move(connection);
                               });
    return false;
  }
  const auto socket = sockets_.find(socket_name(call, f == "socket_close"     ? 0
                                                      : f == "socket_set_var" ? 2
                                                                              : 1));
  const bool is_open = socket != sockets_.end() && socket->second && socket->second->is_open();
  if (f == "socket_close") {
    if (is_open) socket->second->finish();
    if (socket != sockets_.end()) sockets_.erase(socket);
    return true;
  }
  const std::string text = bytes_of(call);
  if (is_open)
    socket->second->send(text);
  else
    controller_.log(f + ": the socket is not open.");
  return true;
}

urscript::Program read_script(const std::filesystem::path& file, const std::string& name) {
  std::ifstream in(file);
  std::stringstream text;
  text << in.rdbuf();
  if (!in) throw urscript::ScriptError(1, 1, file.string() + " cannot be read");
  urscript::Program program = urscript::parse_program(text.str());
  program.name = name;
  return program;
}

}  // namespace takt::ur

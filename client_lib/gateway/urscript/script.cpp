#include "client_lib/gateway/urscript/script.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <numbers>

namespace takt::urscript {
namespace {

constexpr std::array<std::string_view, 50> kFunctions{"textmsg",
                                                      "sleep",
                                                      "sync",
                                                      "halt",
                                                      "popup",
                                                      "movej",
                                                      "movel",
                                                      "movep",
                                                      "movec",
                                                      "stopj",
                                                      "stopl",
                                                      "speedj",
                                                      "speedl",
                                                      "protective_stop",
                                                      "set_standard_digital_out",
                                                      "set_configurable_digital_out",
                                                      "set_tool_digital_out",
                                                      "set_digital_out",
                                                      "set_standard_analog_out",
                                                      "set_analog_out",
                                                      "set_tool_voltage",
                                                      "set_payload",
                                                      "set_target_payload",
                                                      "set_tcp",
                                                      "set_gravity",
                                                      "zero_ftsensor",
                                                      "force_mode",
                                                      "end_force_mode",
                                                      "force_mode_set_damping",
                                                      "force_mode_set_gain_scaling",
                                                      "freedrive_mode",
                                                      "end_freedrive_mode",
                                                      "socket_open",
                                                      "socket_close",
                                                      "servoj",
                                                      "set_payload_mass",
                                                      "set_payload_cog",
                                                      "write_output_boolean_register",
                                                      "teach_mode",
                                                      "end_teach_mode",
                                                      "socket_send_string",
                                                      "socket_send_line",
                                                      "socket_send_int",
                                                      "socket_send_byte",
                                                      "socket_set_var",
                                                      "interpreter_mode",
                                                      "end_interpreter",
                                                      "clear_interpreter",
                                                      "write_output_float_register",
                                                      "write_output_integer_register"};

/// No number of a robot is larger; squares and whole numbers of it exist.
constexpr double kLargest = 1e9;

bool is_blank(char c) {
  return c == ' ' || c == '\t' || c == '\r';
}
bool is_letter(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_';
}
bool is_digit(char c) {
  return c >= '0' && c <= '9';
}

/// Without a comment and blanks at the end.
std::string_view code_of(std::string_view line) {
  bool quoted = false;
  for (std::size_t i = 0; i < line.size(); ++i) {
    if (line[i] == '"') quoted = !quoted;
    if (line[i] == '#' && !quoted) {
      line = line.substr(0, i);
      break;
    }
  }
  while (!line.empty() && is_blank(line.back())) line.remove_suffix(1);
  return line;
}

std::string_view trimmed(std::string_view line) {
  while (!line.empty() && is_blank(line.front())) line.remove_prefix(1);
  return line;
}

std::string_view first_word(std::string_view code) {
  std::size_t end = 0;
  while (end < code.size() && (is_letter(code[end]) || is_digit(code[end]))) ++end;
  return code.substr(0, end);
}

bool opens_block(std::string_view code) {
  const std::string_view word = first_word(code);
  return word == "def" || word == "sec" || word == "thread" || word == "while" || word == "for" ||
         word == "if";
}

/// Reads one call.
class CallReader {
 public:
  CallReader(std::string_view code, int line, int column) : code_(code), line_(line), column_(column) {}

  Call read() {
    Call call;
    call.line = line_;
    call.column = column_;
    call.function = std::string(word());
    skip();
    if (call.function == "digital_out" && peek() == '[') return digital_out(call);
    if (call.function.empty() || at_ >= code_.size() || code_[at_] != '(') {
      if (call.function == "halt" && at_ == code_.size()) return call;
      fail("syntax_error: takt runs calls with constant arguments and endless loops");
    }
    if (std::find(kFunctions.begin(), kFunctions.end(), call.function) == kFunctions.end())
      throw ScriptError(line_, column_, "compile_error_name_not_found:" + call.function + ":");
    ++at_;
    skip();
    while (peek() != ')') {
      const std::size_t begin = at_;
      std::string name;
      if (is_letter(peek())) {
        name = std::string(word());
        skip();
        if (peek() != '=') {
          name.clear();
          at_ = begin;
        } else {
          ++at_;
          skip();
        }
      }
      Literal value = literal();
      if (name.empty())
        call.arguments.push_back(std::move(value));
      else
        call.named.insert_or_assign(name, std::move(value));
      skip();
      if (peek() == ',') {
        ++at_;
        skip();
      } else if (peek() != ')') {
        fail("syntax_error: ',' or ')' is missing");
      }
    }
    ++at_;
    skip();
    if (at_ != code_.size()) fail("syntax_error: one call in a line is allowed");
    return call;
  }

 private:
  [[noreturn]] void fail(const std::string& text) const {
    throw ScriptError(line_, column_ + static_cast<int>(at_), text + ": " + std::string(code_.substr(0, 80)));
  }
  char peek() const { return at_ < code_.size() ? code_[at_] : '\0'; }
  void skip() {
    while (at_ < code_.size() && is_blank(code_[at_])) ++at_;
  }
  std::string_view word() {
    const std::string_view found = first_word(code_.substr(at_));
    at_ += found.size();
    return found;
  }
  /// digital_out[N] = VALUE, the older form of set_digital_out(N, VALUE).
  Call digital_out(Call call) {
    call.function = "set_digital_out";
    const std::vector<double> place = list();
    skip();
    if (place.size() != 1 || peek() != '=') fail("syntax_error: allowed: digital_out[N] = True or False");
    ++at_;
    skip();
    call.arguments = {place[0], literal()};
    skip();
    if (at_ != code_.size()) fail("syntax_error: one assignment in a line is allowed");
    return call;
  }
  /// NAME( with its blanks, if it is next.
  bool takes_call(std::string_view name) {
    const std::size_t begin = at_;
    if (word() == name) {
      skip();
      if (peek() == '(') {
        ++at_;
        skip();
        return true;
      }
    }
    at_ = begin;
    return false;
  }
  void close_call() {
    skip();
    if (peek() != ')') fail("syntax_error: ')' is missing");
    ++at_;
  }
  double number() {
    if (takes_call("d2r")) {
      const double degrees = number();
      close_call();
      return degrees * std::numbers::pi / 180.0;
    }
    const std::size_t begin = at_;
    while (at_ < code_.size() &&
           (is_digit(code_[at_]) || std::string_view("+-.eE").find(code_[at_]) != std::string_view::npos))
      ++at_;
    double value = 0.0;
    std::string_view text = code_.substr(begin, at_ - begin);
    if (!text.empty() && text.front() == '+') text.remove_prefix(1);
    const auto [end, problem] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (problem != std::errc{} || end != text.data() + text.size() || !(std::abs(value) <= kLargest)) {
      at_ = begin;
      fail("syntax_error: takt allows constants here (a number, True, False, a text, [..], p[..])");
    }
    return value;
  }
  std::vector<double> list() {
    std::vector<double> values;
    ++at_;  // [
    skip();
    while (peek() != ']') {
      values.push_back(number());
      skip();
      if (peek() == ',') {
        ++at_;
        skip();
      } else if (peek() != ']') {
        fail("syntax_error: ',' or ']' is missing");
      }
    }
    ++at_;
    return values;
  }
  Literal literal() {
    if (peek() == '[') return list();
    if (peek() == 'p' && at_ + 1 < code_.size() && code_[at_ + 1] == '[') {
      ++at_;
      return PoseLiteral{list()};
    }
    if (peek() == '"') {
      const std::size_t end = code_.find('"', at_ + 1);
      if (end == std::string_view::npos) fail("syntax_error: a text has no end");
      std::string text(code_.substr(at_ + 1, end - at_ - 1));
      at_ = end + 1;
      return text;
    }
    if (takes_call("get_inverse_kin")) {  // a move takes the pose itself
      Literal pose = literal();
      if (!std::holds_alternative<PoseLiteral>(pose))
        fail("syntax_error: allowed: get_inverse_kin(p[x, y, z, rx, ry, rz])");
      close_call();
      return pose;
    }
    const std::size_t begin = at_;
    const std::string_view name = word();
    if (name == "True" || name == "true") return true;
    if (name == "False" || name == "false") return false;
    at_ = begin;
    return number();
  }

  std::string_view code_;
  int line_, column_;
  std::size_t at_ = 0;
};

struct Line {
  std::string_view code;
  int number = 0, column = 0;
};

std::vector<Line> lines_of(std::string_view text) {
  std::vector<Line> lines;
  for (int number = 1; !text.empty(); ++number) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    const std::string_view code = code_of(text.substr(0, end)), inner = trimmed(code);
    if (!inner.empty()) lines.push_back({inner, number, static_cast<int>(code.size() - inner.size()) + 1});
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  return lines;
}

/// NAME of "def NAME():"; empty if the line is no head of a program.
std::string name_of_program(std::string_view code) {
  std::string_view rest = trimmed(code.substr(first_word(code).size()));
  const std::string_view name = first_word(rest);
  rest = trimmed(rest.substr(name.size()));
  if (name.empty() || !is_letter(name.front()) || rest.substr(0, 1) != "(" || rest.back() != ':') return {};
  return std::string(name);
}

std::vector<Instruction> instructions_of(const std::vector<Line>& lines, std::size_t begin, std::size_t end) {
  std::vector<Instruction> instructions;
  std::vector<std::size_t> loops;
  for (std::size_t i = begin; i < end; ++i) {
    const Line& line = lines[i];
    Instruction instruction;
    if (line.code == "while True:" || line.code == "while (True):") {
      instruction.kind = Instruction::Kind::loop_begin;
      loops.push_back(instructions.size());
    } else if (line.code == "end") {
      if (loops.empty()) throw ScriptError(line.number, line.column, "syntax_error: 'end' without a block");
      instruction.kind = Instruction::Kind::loop_end;
      instruction.other = loops.back();
      loops.pop_back();
    } else {
      instruction.call = CallReader(line.code, line.number, line.column).read();
      if (instruction.call.function == "halt") instruction.kind = Instruction::Kind::halt;
    }
    instructions.push_back(std::move(instruction));
  }
  if (!loops.empty()) throw ScriptError(lines[end - 1].number, 1, "syntax_error: a block has no 'end'");
  return instructions;
}

/// HOST and PORT of connect_socket_with_retry("HOST", PORT, "NAME").
std::optional<ExternalControl::Place> place_of(std::string_view text, std::string_view socket) {
  constexpr std::string_view kCall = "connect_socket_with_retry(\"";
  for (std::size_t at = text.find(kCall); at != std::string_view::npos; at = text.find(kCall, at + 1)) {
    std::string_view rest = text.substr(at + kCall.size());
    rest = rest.substr(0, rest.find('\n'));
    const std::size_t quote = rest.find('"');
    if (quote == std::string_view::npos) continue;
    ExternalControl::Place place{std::string(rest.substr(0, quote)), 0};
    rest.remove_prefix(quote + 1);
    while (!rest.empty() && (rest.front() == ',' || is_blank(rest.front()))) rest.remove_prefix(1);
    const auto [end, problem] = std::from_chars(rest.data(), rest.data() + rest.size(), place.port);
    if (problem != std::errc{}) continue;
    rest.remove_prefix(static_cast<std::size_t>(end - rest.data()));
    if (rest.find("\"" + std::string(socket) + "\"") != std::string_view::npos) return place;
  }
  return std::nullopt;
}

double scale_of(std::string_view text, std::string_view name) {
  const std::size_t at = text.find(std::string(name) + " = ");
  double value = 1e6;
  if (at == std::string_view::npos) return value;
  const std::string_view rest = text.substr(at + name.size() + 3);
  std::from_chars(rest.data(), rest.data() + rest.size(), value);
  return value > 0.0 ? value : 1e6;
}

std::optional<ExternalControl> external_control_of(std::string_view text) {
  const auto trajectory = place_of(text, "trajectory_socket"),
             script_command = place_of(text, "script_command_socket"),
             reverse = place_of(text, "reverse_socket");
  if (!trajectory || !script_command || !reverse) return std::nullopt;
  ExternalControl external{*trajectory, *script_command, *reverse};
  external.joint_scale = scale_of(text, "MULT_jointstate");
  external.time_scale = scale_of(text, "MULT_time");
  external.answers_cancel = text.find("socket_send_int(TRAJECTORY_RESULT_CANCELED") != std::string_view::npos;
  for (const Line& line : lines_of(text))
    if (line.code.find("write_output_float_register(1, splineTimerTraveled)") != std::string_view::npos)
      external.writes_spline_time = true;
  return external;
}

/// The number of "global NAME = NUMBER"; comments may stand between.
int offset_of(const std::vector<Line>& lines, std::string_view name) {
  const std::string head = "global " + std::string(name) + " =";
  for (std::size_t i = 0; i < lines.size(); ++i) {
    std::string_view code = lines[i].code;
    if (code.substr(0, head.size()) != head) continue;
    code = trimmed(code.substr(head.size()));
    if (code.empty() && i + 1 < lines.size()) code = lines[i + 1].code;
    int number = -1;
    std::from_chars(code.data(), code.data() + code.size(), number);
    if (number < 0 || number > 24)
      throw ScriptError(lines[i].number, lines[i].column,
                        std::string(name) + ": allowed: 0 to 24, the first RTDE register");
    return number;
  }
  return 0;
}

std::optional<RegisterControl> register_control_of(std::string_view text, const std::vector<Line>& lines) {
  for (const std::string_view mark : {"def process_cmd():", "def rtde_cmd():", "reg_offset_int"})
    if (text.find(mark) == std::string_view::npos) return std::nullopt;
  RegisterControl control{offset_of(lines, "reg_offset_float"), offset_of(lines, "reg_offset_int"), {}, {}};
  constexpr std::string_view kCommand = "cmd == ";
  std::size_t begin = lines.size(), end = lines.size();
  for (std::size_t i = 0; i < lines.size(); ++i) {
    const std::string_view code = lines[i].code;
    if (first_word(code) == "if" && code.find(kCommand) != code.rfind(kCommand)) {
      for (std::size_t at = code.find(kCommand); at != std::string_view::npos;
           at = code.find(kCommand, at + 1)) {
        int number = 0;
        std::from_chars(code.data() + at + kCommand.size(), code.data() + code.size(), number);
        control.realtime_commands.push_back(number);
      }
    }
    if (code == "def exec_move_path():") begin = i + 1;
    if (code == "end" && begin < i && end == lines.size()) end = i;
  }
  for (std::size_t i = begin; i < end; ++i) {
    constexpr std::string_view kProgress = "signal_async_progress(";
    Instruction instruction;
    if (lines[i].code.substr(0, kProgress.size()) == kProgress) {
      double number = 0.0;
      std::from_chars(lines[i].code.data() + kProgress.size(), lines[i].code.data() + lines[i].code.size(),
                      number);
      instruction.call = {
          "write_output_integer_register", {2.0, number}, {}, lines[i].number, lines[i].column};
    } else {
      instruction.call = CallReader(lines[i].code, lines[i].number, lines[i].column).read();
    }
    control.path.push_back(std::move(instruction));
  }
  return control;
}

}  // namespace

std::optional<std::string> ScriptStream::next() {
  std::size_t begin = 0;
  while (!broken_) {
    // Lines from `begin` on until the block that the first one opens is closed.
    std::size_t at = begin;
    int depth = 0;
    for (;;) {
      const std::size_t end = buffer_.find('\n', at);
      if (end == std::string::npos) {
        buffer_.erase(0, begin);
        broken_ = buffer_.size() > kMostBytes;
        return std::nullopt;
      }
      const std::string_view code = trimmed(code_of(std::string_view(buffer_).substr(at, end - at)));
      if (opens_block(code)) ++depth;
      if (code == "end" && depth > 0) --depth;
      at = end + 1;
      if (depth == 0) {
        if (code.empty()) {  // an empty line or a comment
          begin = at;
          break;
        }
        std::string text = buffer_.substr(begin, end - begin);
        buffer_.erase(0, at);
        return text;
      }
    }
  }
  return std::nullopt;
}

Program parse_program(std::string_view text) {
  const std::vector<Line> lines = lines_of(text);
  Program program;
  if (lines.empty()) return program;
  program.external = external_control_of(text);
  program.registers = register_control_of(text, lines);
  std::size_t begin = 0, end = lines.size();
  const std::string_view head = first_word(lines.front().code);
  if (head == "def" || head == "sec") {
    program.name = name_of_program(lines.front().code);
    if (program.name.empty())
      throw ScriptError(lines.front().number, lines.front().column, "syntax_error: def NAME(): is expected");
    program.secondary = head == "sec";
    if (lines.size() < 2 || lines.back().code != "end")
      throw ScriptError(lines.back().number, lines.back().column, "syntax_error: the program has no 'end'");
    begin = 1;
    end = lines.size() - 1;
  }
  if (program.registers) return program;
  if (program.external) {
    // What follows the control loop; its own lines are what takt does in its place.
    const std::size_t mark = text.find("# NODE_CONTROL_LOOP_ENDS");
    const auto first =
        static_cast<int>(std::count(
            text.begin(), text.begin() + static_cast<std::ptrdiff_t>(std::min(mark, text.size())), '\n')) +
        1;
    begin = static_cast<std::size_t>(
        std::find_if(lines.begin(), lines.end(), [&](const Line& line) { return line.number > first; }) -
        lines.begin());
    begin = std::min(begin, end);
  }
  program.instructions = instructions_of(lines, begin, end);
  return program;
}

}  // namespace takt::urscript

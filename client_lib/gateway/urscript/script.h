#pragma once
// The part of URScript that takt runs: programs of calls with constant arguments, and endless loops of them. The external
// control program of a driver is recognised by its sockets, that of ur_rtde by its functions; their statements are not
// interpreted (docs/controllers.md).
//
//   def close_and_wait():          # or: sec NAME(): a secondary program, beside the running one
//     set_standard_digital_out(0, True)
//     while True:
//       sleep(0.5)
//     end
//   end
#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

namespace takt::urscript {

struct PoseLiteral {
  std::vector<double> values;  ///< p[x, y, z, rx, ry, rz]
};
using Literal = std::variant<bool, double, std::string, std::vector<double>, PoseLiteral>;

struct Call {
  std::string function;
  std::vector<Literal> arguments;
  std::map<std::string, Literal> named;
  int line = 0, column = 0;  ///< from 1 on
};

struct Instruction {
  enum class Kind : std::uint8_t { call, loop_begin, loop_end, halt };
  Kind kind = Kind::call;
  Call call{};
  std::size_t other = 0;  ///< of a loop's end: its begin
};

/// The external control program: where the driver listens, and the scales of its numbers.
struct ExternalControl {
  struct Place {
    std::string host;
    std::uint16_t port = 0;
  };
  Place trajectory, script_command, reverse;
  double joint_scale = 1e6, time_scale = 1e6;
  bool answers_cancel = true;  ///< the text sends the result of a cancelled trajectory
  bool writes_spline_time =
      false;  ///< the text writes output float register 1: seconds of the present spline
};

/// The control program of ur_rtde (SDU Robotics), which a client commands by numbers in RTDE registers.
struct RegisterControl {
  int first_double = 0, first_int = 0;  ///< registers
  std::vector<int> realtime_commands;   ///< those that the text executes in each cycle
  std::vector<Instruction> path;        ///< of exec_move_path()
};

struct Program {
  std::string name;
  bool secondary = false;
  std::optional<ExternalControl> external;
  std::optional<RegisterControl> registers;
  std::vector<Instruction>
      instructions;  ///< of an external control program: those that follow its control loop
};

/// Text that is no program of this part of URScript. `what()` has the form of the controller's messages, e.g.
/// compile_error_name_not_found:foo:
class ScriptError : public std::runtime_error {
 public:
  ScriptError(int line, int column, const std::string& text)
      : std::runtime_error(text), line_(line), column_(column) {}
  int line() const { return line_; }
  int column() const { return column_; }

 private:
  int line_, column_;
};

/// Splits what clients send to ports 30001 to 30003: whole programs, and single lines outside of programs.
class ScriptStream {
 public:
  static constexpr std::size_t kMostBytes = 1U << 20U;
  void add(std::string_view bytes) { buffer_.append(bytes); }
  /// The next program or line, without its last end of line; comments and empty lines are left out.
  std::optional<std::string> next();
  /// A program is longer than kMostBytes.
  bool broken() const { return broken_; }

 private:
  std::string buffer_;
  bool broken_ = false;
};

/// A whole program, or one line as a program without a name. Throws ScriptError for text that takt does not run, and for
/// functions that it does not have.
Program parse_program(std::string_view text);

}  // namespace takt::urscript

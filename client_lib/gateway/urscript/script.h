#pragma once
// Programs that clients send to a UR controller. takt runs URScript (code.h, interpreter.h); the external control program of a
// driver is recognised by its sockets, that of ur_rtde by its functions: takt does what their statements do
// (docs/controllers.md).
//
//   def close_and_wait():          # or: sec NAME(): a secondary program, beside the running one
//     set_standard_digital_out(0, True)
//     while get_standard_digital_in(0) == False:
//       sleep(0.5)
//     end
//   end
#include "client_lib/gateway/urscript/code.h"

namespace takt::urscript {

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
  Code path{};                          ///< of exec_move_path()
};

struct Program {
  std::string name;
  bool secondary = false;
  std::optional<ExternalControl> external;
  std::optional<RegisterControl> registers;
  Code code{};  ///< of an external control program: the statements that follow its control loop
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

/// A whole program, or statements as a program without a name. Throws ScriptError for text that is no URScript, and for
/// functions that takt does not have.
Program parse_program(std::string_view text);

}  // namespace takt::urscript

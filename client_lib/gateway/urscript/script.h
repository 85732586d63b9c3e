#pragma once
// Programs that clients send to a UR controller. takt runs URScript (code.h, interpreter.h); the external control program of a
// driver is recognised by its sockets: takt does what its statements do (docs/controllers.md).
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

struct Program {
  std::string name;
  bool secondary = false;
  std::optional<ExternalControl> external;
  Code code{};  ///< of an external control program: the statements that follow its control loop
};

/// Splits what clients send to ports 30001 to 30003: whole programs, and single lines outside of programs.
class ScriptStream {
 public:
  static constexpr std::size_t kMostBytes = 1U << 20U;
  void add(std::string_view bytes) { buffer_.append(bytes); }
  /// The next program or line, without its last end of line; comments and empty lines are left out.
  std::optional<std::string> next();
  /// A program is longer than kMostBytes. After next() has found no more.
  bool broken() const { return buffer_.size() > kMostBytes; }

 private:
  std::string buffer_;
  std::size_t begin_ = 0, line_ = 0;  ///< of the program, and of the line that is looked at next
  std::size_t searched_ = 0;          ///< no end of line lies between that line's begin and here
  int depth_ = 0;                     ///< blocks that are open before that line
};

/// A whole program, or statements as a program without a name. Throws ScriptError for text that is no URScript, and for
/// functions that takt does not have.
Program parse_program(std::string_view text);

}  // namespace takt::urscript

#pragma once
// Runs URScript (client_lib/gateway/urscript/interpreter.h) on the controller: its moves, waits and sockets.
#include <filesystem>
#include <optional>

#include "client_lib/tools/takt_ur/remote_calls.h"
#include "client_lib/tools/takt_ur/script_sockets.h"
#include "client_lib/tools/takt_ur/statement_queue.h"
#include "client_lib/tools/takt_ur/ur_controller.h"

namespace takt::ur {

class ScriptRun final : public RunningProgram, private urscript::Host {
 public:
  ScriptRun(UrController& controller, const std::string& name, urscript::Code code);
  ~ScriptRun() override;
  bool advance() override { return interpreter_.advance(); }
  std::string interpret(std::string_view line) override;

 private:
  /// Of servoc.
  struct ServoLine {
    Pose X_RG;  ///< the goal in the robot's base
    double acceleration = 0.0, speed = 0.0, radius_m = 0.0;
  };
  /// What a thread waits for in its call.
  struct Waiting {
    std::string_view function;
    bool moves = false;  ///< it has the control of the robot
    std::uint64_t begun_cycle = 0, wake_cycle = 0;
    std::optional<std::uint64_t> for_popup{};  ///< popups that were closed before it
    bool for_motion = false, for_speed = false;
    bool for_rest = false;  ///< before the move begins
    std::optional<Vector6> servo_target{};
    std::optional<ServoLine> servo_line{};
  };

  urscript::Outcome call(const urscript::HostCall& call) override;
  std::optional<urscript::Value> foresee(const urscript::Function& function,
                                         std::span<const urscript::Value> arguments) override;
  urscript::RoutinePointer statement_ahead(std::size_t number) override { return queue_.ahead(number); }
  void ended(std::uint64_t thread) override;

  /// Begins a call that may wait; true where it is over.
  bool begin(const urscript::HostCall& call, const CallArguments& arguments, Waiting& waiting);
  bool is_over(const urscript::HostCall& call, const CallArguments& arguments, Waiting& waiting);
  void take_control(std::uint64_t thread) const;
  void wait(Waiting& waiting, double seconds) const;
  void begin_servo(const CallArguments& arguments, Waiting& waiting);
  ServoLine servo_line_of(const CallArguments& arguments) const;
  /// One cycle; true where it has arrived.
  bool follow(const ServoLine& line);
  void begin_speed(const CallArguments& arguments, Waiting& waiting);
  void begin_move(const urscript::HostCall& call, const CallArguments& arguments, Waiting& waiting);
  /// From the joint positions where it begins.
  Move move_of(const CallArguments& arguments, const Vector6& near) const;
  /// Blends the present move into the next one, if it has a radius.
  void blend(std::uint64_t thread);
  urscript::Outcome interpreter_mode(const CallArguments& arguments, bool begins);

  UrController& controller_;
  ScriptSockets sockets_;
  RemoteCalls remote_;
  urscript::Interpreter interpreter_;
  std::map<std::uint64_t, Waiting> waiting_;                ///< by thread
  std::uint64_t move_ = 0;                                  ///< of the motion: that of the present call
  std::optional<urscript::Interpreter::Foreseen> blended_;  ///< the move that follows by a blend
  double servo_lookahead_s_ = 0.1;

  StatementQueue queue_;
  bool executes_ = false, leaves_ = false, clears_at_end_ = true;
};

/// Throws urscript::ScriptError, also for a file that cannot be read.
urscript::Program read_script(const std::filesystem::path& file, const std::string& name);

}  // namespace takt::ur

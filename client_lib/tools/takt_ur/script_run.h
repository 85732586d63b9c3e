#pragma once
// Runs programs of the part of URScript that takt has (client_lib/gateway/urscript/script.h).
#include <filesystem>
#include <memory>
#include <optional>

#include "client_lib/tools/takt_ur/statement_queue.h"
#include "client_lib/tools/takt_ur/ur_controller.h"

namespace takt::ur {

class ScriptRun final : public RunningProgram {
 public:
  ScriptRun(UrController& controller, const urscript::Program& program);
  ~ScriptRun() override;
  bool advance() override;
  std::string interpret(std::string_view line) override;
  /// It has a function that moves the robot: such a program is never a secondary one.
  static bool moves(const urscript::Program& program);

 private:
  /// Executes one call; false while it has not ended.
  bool execute(const urscript::Call& call);
  void begin_force_mode(const urscript::Call& call);
  bool begin(const urscript::Call& call);
  void wait(double seconds);
  void begin_move(const urscript::Call& call);
  /// From the joint positions where it begins.
  Move move_of(const urscript::Call& call, const Vector6& near) const;
  /// A call by its place: in interpreter mode the number of the statement, else the place among the instructions.
  std::uint64_t place() const;
  /// The next move, where nothing before it waits.
  struct NextMove {
    std::uint64_t place;
    const urscript::Call* call;
  };
  std::optional<NextMove> next_move() const;
  /// Blends the present move into the next one, if it has a radius.
  void blend();
  void enter_interpreter(const urscript::Call& call);
  /// The statements that clients append. False while one has not ended, or none is there.
  bool advance_interpreter();
  void leave_interpreter();
  bool begin_socket_call(const urscript::Call& call);
  [[noreturn]] static void fail(const urscript::Call& call, const std::string& text);

  UrController& controller_;
  std::vector<urscript::Instruction> instructions_;
  std::size_t next_ = 0;
  bool begun_ = false;  ///< the call at next_
  std::uint64_t wake_cycle_ = 0;
  bool waits_for_motion_ = false, waits_for_speed_ = false;
  std::uint64_t move_ = 0;                ///< of the motion: that of the call at next_
  std::optional<std::uint64_t> blended_;  ///< place of the move that follows by a blend
  StatementQueue queue_;
  bool interprets_ = false, halted_ = false, clears_at_end_ = true;
  std::optional<Vector6> servo_target_;  ///< of the servoj at next_
  double servo_lookahead_s_ = 0.1;
  /// Of sockets that the program opens: by name; nullptr while connecting.
  std::map<std::string, std::shared_ptr<gateway::Connection>> sockets_;
  std::shared_ptr<bool> alive_ = std::make_shared<bool>(true);
  bool connecting_ = false;
};

/// Throws urscript::ScriptError, also for a file that cannot be read.
urscript::Program read_script(const std::filesystem::path& file, const std::string& name);

}  // namespace takt::ur

#pragma once
// A controller program as it runs: its routines (one coroutine per robot), what each waits for, its signals.
// The names that programs use are documented in docs/lua.md.
#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "client_lib/controller/controller.h"
#include "client_lib/controller/robot_driver.h"
#include "client_lib/controller/state_source.h"
#include "idl/common/named_lists.h"
#include "idl/lua/lua_sandbox.h"

namespace takt::controller {

/// The objects that a program acts upon. They outlive the program.
struct ProgramContext {
  const takt_msgs::msg::CellDescription* cell = nullptr;
  const Named* names = nullptr;                ///< of what the cell has
  std::vector<RobotDriver>* robots = nullptr;  ///< in the order of CellDescription::robots
  std::vector<GripperSetPoint>* grippers =
      nullptr;  ///< standing commands, in the order of CellDescription::grippers
  std::vector<DeviceSetPoint>* devices = nullptr;  ///< in the order of CellDescription::devices
  const Parameters* parameters = nullptr;          ///< each of which the program must ask for
  StepLog* steps = nullptr;                        ///< null: steps are not kept
};

class Program {
 public:
  /// Runs the text of the program up to its end, which registers routines. Throws std::runtime_error with
  /// file and line.
  Program(const std::string& text, const std::string& file, const ProgramContext& context);

  double period_s() const { return period_s_; }
  /// Robots that have a routine, in rising order.
  std::vector<int> driven_robots() const;
  /// Devices that the program asked for while it was loaded, in rising order.
  std::vector<int> driven_devices() const { return {devices_.begin(), devices_.end()}; }
  /// Whether the program leaves this gripper of its robots to another controller.
  bool leaves_gripper(int gripper) const { return left_grippers_.contains(gripper); }

  /// Runs every routine up to its next wait. The routines run in the order of the robots, in rounds, until all
  /// of them wait. So a signal takes effect in the same period, whichever routine gives it.
  void run(StateSource& source);
  bool finished() const;
  void keep_steps(StepLog* steps) { context_.steps = steps; }

  const ProgramContext& context() const { return context_; }
  /// State of the present update. Throws while the program is loaded, before the first update.
  const takt_msgs::msg::CellState& state() const;
  /// The same, in which at least this part is up to date.
  const takt_msgs::msg::CellState& state(StatePart part, std::size_t component) const;

  /// Text of an error in the motion that the robot's routine waits for, with file and line of the call.
  std::string located(int robot, const std::string& reason) const;

 private:
  friend struct ProgramFunctions;  // what programs call, program_functions.cpp
  friend struct DeviceFunctions;

  enum class Wait { nothing, arrival, time, signal, condition, finished };

  struct Routine {
    int robot = -1;
    lua_State* thread = nullptr;
    bool begun = false;
    Wait wait = Wait::nothing;
    double until_s = 0.0;               ///< Wait::time; Wait::condition: when to give up
    int signal = -1;                    ///< Wait::signal
    int condition = LUA_NOREF;          ///< Wait::condition: the function, by reference
    std::int64_t call = -1, step = -1;  ///< number of the running one in context_.steps, or -1
  };

  bool may_go_on(Routine& routine);
  bool condition_holds(Routine& routine);
  void resume(Routine& routine);
  /// Begins a step of the routine, at the line of `L` that is being executed; returns its number, -1 if none
  /// are kept.
  std::int64_t begin_step(lua_State* L, const Routine& routine, std::string_view name, bool named);
  void end_step(std::int64_t& step);
  int signal_id(std::string_view name);
  std::string in_routine(const Routine& routine, const std::string& reason) const;
  void read_period(const std::string& file);
  void check_parameters(const std::string& file) const;

  ProgramContext context_;
  StateSource* source_ = nullptr;                     ///< of the update under way
  const takt_msgs::msg::CellState* state_ = nullptr;  ///< its state
  std::vector<Routine> routines_;                     ///< in the order of the robots
  Routine* current_ = nullptr;                        ///< the routine that is running
  std::set<int> devices_;
  std::set<int> left_grippers_;
  std::set<std::string, std::less<>> parameters_;  ///< asked for
  std::map<std::string, int, std::less<>> signal_ids_;
  std::vector<bool> signals_;  ///< given so far
  double period_s_ = 0.008;
  LuaSandbox lua_;  ///< last: its functions may use all of the above
};

/// Adds what programs call to the names of the state. lua_owner() is the Program.
void open_program_library(lua_State* L);
/// The names of robot programs as sections of docs/lua.md.
std::string program_reference();
/// Pushes the value that stands for the robot in its routine.
void push_routine_robot(lua_State* L, int robot);

}  // namespace takt::controller

// Functions of controller programs: routines, motions, grippers, waits, signals.
#include <algorithm>
#include <cstdio>
#include <iostream>
#include <limits>
#include <string>

#include "client_lib/controller/cell_view.h"
#include "client_lib/controller/lua_arguments.h"
#include "client_lib/controller/lua_handles.h"
#include "client_lib/controller/lua_pose.h"
#include "client_lib/controller/program.h"
#include "idl/common/text.h"

namespace takt::controller {

using takt_msgs::msg::CellDescription;
using takt_msgs::msg::DeviceDescription;
using takt_msgs::msg::GripperDescription;

namespace {

constexpr char kRobotType[] = "robot";
constexpr char kGripperType[] = "gripper";
constexpr char kDeviceType[] = "device";
constexpr std::size_t kMaxParameters = 1000;

JointArray to_joints(lua_State* L, int index, const ArmModel& arm) {
  const int count = arm.joint_count();
  if (!lua_istable(L, index) || static_cast<int>(lua_rawlen(L, index)) != count) {
    const std::string found =
        lua_istable(L, index) ? std::to_string(lua_rawlen(L, index)) + " values" : luaL_typename(L, index);
    throw std::runtime_error("a table of " + std::to_string(count) + " joint positions is needed, not " +
                             found);
  }
  JointArray q{};
  for (int i = 0; i < count; ++i) {
    lua_rawgeti(L, index, i + 1);
    q[static_cast<size_t>(i)] = to_number(L, -1, arm.joints[static_cast<size_t>(i)].name);
    lua_pop(L, 1);
  }
  return q;
}

constexpr LuaOption<JointMotionOptions> kJointOptions[] = {
    {"speed", &JointMotionOptions::speed, "fraction of each joint's own limit, in (0, 1]"},
    {"acceleration_rad_per_s2", &JointMotionOptions::acceleration_rad_per_s2,
     "of every joint; m/s^2 for prismatic joints"},
    {"duration_s", &JointMotionOptions::duration_s,
     "exact time of the motion, rounded up to whole periods; 0: as fast as the other options allow"}};
constexpr LuaOption<LineOptions> kLineOptions[] = {
    {"speed_m_per_s", &LineOptions::speed_m_per_s, "of the TCP"},
    {"acceleration_m_per_s2", &LineOptions::acceleration_m_per_s2, "of the TCP"},
    {"rotation_speed_rad_per_s", &LineOptions::rotation_speed_rad_per_s, "of the orientation of the TCP"},
    {"rotation_acceleration_rad_per_s2", &LineOptions::rotation_acceleration_rad_per_s2,
     "of the orientation of the TCP"},
    {"duration_s", &LineOptions::duration_s,
     "exact time of the motion, rounded up to whole periods; 0: as fast as the other options allow"}};

template <typename Options, std::size_t Count>
std::string option_table(const LuaOption<Options> (&options)[Count]) {
  std::string table = "| option | default | meaning |\n|---|---|---|\n";
  for (const LuaOption<Options>& one : options) {
    char usual[32];
    std::snprintf(usual, sizeof usual, "%g", Options{}.*one.value);
    table += std::string("| `") + one.name + "` | " + usual + " | " + one.doc + " |\n";
  }
  return table;
}

}  // namespace

struct ProgramFunctions {
  using Wait = Program::Wait;

  static Program& program(lua_State* L) { return *static_cast<Program*>(lua_owner(L)); }
  static const CellDescription& cell_info(lua_State* L) { return *program(L).context_.cell; }

  static double now_s(lua_State* L) { return program(L).state().time; }

  /// The running routine, which must be that of the robot: one robot, one hand on it.
  static Program::Routine& routine_of(lua_State* L, int robot) {
    Program::Routine* routine = program(L).current_;
    if (routine == nullptr || routine->thread != L) {
      throw std::runtime_error("a robot can be moved, and waited with, only in its routine");
    }
    if (routine->robot != robot) {
      throw std::runtime_error(
          cell_info(L).robots[static_cast<size_t>(robot)].name + " cannot be driven from the routine of " +
          cell_info(L).robots[static_cast<size_t>(routine->robot)].name + "; use a signal");
    }
    return *routine;
  }
  static Program::Routine& own_routine(lua_State* L) {
    return routine_of(L, to_handle(L, kRobotType, " (write r:move_to(...), not r.move_to(...))"));
  }
  static RobotDriver& driver(lua_State* L, const Program::Routine& routine) {
    return (*program(L).context_.robots)[static_cast<size_t>(routine.robot)];
  }

  /// The routine waits for this, and goes on when it has come.
  static int await(lua_State* L, Program::Routine& routine, Wait what, const char* call) {
    routine.wait = what;
    routine.call = program(L).begin_step(L, routine, call, false);
    return lua_yield(L, 0);
  }

  static int routine(lua_State* L) {
    Program& self = program(L);
    if (self.state_ != nullptr) {
      throw std::runtime_error("routines are registered while the program is loaded");
    }
    const int robot = index_by_name(self.context_.cell->robots, to_name(L, 1), "the cell has no robot");
    if (!lua_isfunction(L, 2)) {
      throw std::runtime_error("routine(\"ROBOT\", function(r) ... end): the function is missing");
    }
    for (const Program::Routine& other : self.routines_) {
      if (other.robot != robot) continue;
      throw std::runtime_error("robot " + std::string(to_name(L, 1)) + " has a routine already");
    }
    Program::Routine added;
    added.robot = robot;
    added.thread = lua_newthread(L);
    lua_pushvalue(L, 2);
    lua_xmove(L, added.thread, 1);
    luaL_ref(L, LUA_REGISTRYINDEX);  // the thread lives as long as the state
    self.routines_.push_back(added);
    return 0;
  }

  static int parameter(lua_State* L) {
    Program& self = program(L);
    if (self.state_ != nullptr)
      throw std::runtime_error("parameters are asked for while the program is loaded");
    const std::string name(to_name(L, 1));
    const double fallback = to_number(L, 2, "the default of parameter " + name);
    if (self.parameters_.size() >= kMaxParameters)
      throw std::runtime_error("a program may have 1000 parameters");
    self.parameters_.insert(name);
    const auto given = self.context_.parameters->find(name);
    lua_pushnumber(L, given == self.context_.parameters->end() ? fallback : given->second);
    return 1;
  }

  static int signal(lua_State* L) {
    Program& self = program(L);
    self.signals_[static_cast<size_t>(self.signal_id(to_name(L, 1)))] = true;
    return 0;
  }

  static int print(lua_State* L) {
    std::string text;
    const int count = lua_gettop(L);
    for (int i = 1; i <= count; ++i) {
      lua_getglobal(L, "tostring");
      lua_pushvalue(L, i);
      lua_call(L, 1, 1);
      const char* part = lua_tostring(L, -1);
      if (text.size() > kLuaString_bytes) refuse_long_string(L);
      text += (i > 1 ? "\t" : "") + std::string(part != nullptr ? part : "?");
      lua_pop(L, 1);
    }
    spend_work(L, text.size());
    char time[32] = "loading";
    if (const auto* now = program(L).state_) std::snprintf(time, sizeof time, "%.3f s", now->time);
    std::clog << "[" << time << "] " << text << "\n";
    return 0;
  }

  static int move_joints(lua_State* L) {
    Program::Routine& routine = own_routine(L);
    RobotDriver& robot = driver(L, routine);
    robot.move_joints(to_joints(L, 2, robot.arm()), to_options(L, 3, kJointOptions), now_s(L));
    return await(L, routine, Wait::arrival, "move_joints");
  }

  static int move_to(lua_State* L) {
    Program::Routine& routine = own_routine(L);
    driver(L, routine).move_to(to_pose(L, 2), to_options(L, 3, kJointOptions), now_s(L));
    return await(L, routine, Wait::arrival, "move_to");
  }

  static int move_line(lua_State* L) {
    Program::Routine& routine = own_routine(L);
    driver(L, routine).move_line(to_pose(L, 2), to_options(L, 3, kLineOptions), now_s(L));
    return await(L, routine, Wait::arrival, "move_line");
  }

  static int wait(lua_State* L) {
    Program::Routine& routine = own_routine(L);
    const double duration = to_number(L, 2, "seconds");
    if (duration < 0.0) throw std::runtime_error("wait: the number of seconds is negative");
    routine.until_s = now_s(L) + duration;
    return await(L, routine, Wait::time, "wait");
  }

  static int wait_until(lua_State* L) {
    Program::Routine& routine = own_routine(L);
    routine.until_s = to_number(L, 2, "time in s");
    return await(L, routine, Wait::time, "wait_until");
  }

  static int wait_signal(lua_State* L) {
    Program::Routine& routine = own_routine(L);
    routine.signal = program(L).signal_id(to_name(L, 2));
    return await(L, routine, Wait::signal, "wait_signal");
  }

  static int wait_for(lua_State* L) {
    Program::Routine& routine = own_routine(L);
    if (!lua_isfunction(L, 2)) {
      throw std::runtime_error("wait_for(function(cell) ... end): the function is missing");
    }
    routine.until_s = lua_isnoneornil(L, 3) ? std::numeric_limits<double>::infinity()
                                            : now_s(L) + to_number(L, 3, "seconds to wait at most");
    lua_pushvalue(L, 2);
    routine.condition = luaL_ref(L, LUA_REGISTRYINDEX);
    return await(L, routine, Wait::condition, "wait_for");
  }

  static int step(lua_State* L) {
    Program::Routine& routine = own_routine(L);
    const std::string_view name = to_name(L, 2);
    program(L).end_step(routine.step);
    routine.step = program(L).begin_step(L, routine, name, true);
    return 0;
  }

  static const RobotDriver& robot_of(lua_State* L) {
    return (*program(L).context_.robots)[static_cast<size_t>(to_handle(L, kRobotType))];
  }
  static int name(lua_State* L) { return lua_pushstring(L, robot_of(L).name().c_str()), 1; }
  static int gripper(lua_State* L) { return push_only_gripper(L, to_handle(L, kRobotType)), 1; }
  static int grippers(lua_State* L) { return push_grippers(L, to_handle(L, kRobotType)), 1; }
  static int tcp(lua_State* L) { return push_pose(L, robot_of(L).X_WT()), 1; }
  static int joints(lua_State* L) { return push_joints(L, robot_of(L).arm(), robot_of(L).joints()), 1; }

  static void push_only_gripper(lua_State* L, int robot) {
    const std::vector<GripperDescription>& grippers = cell_info(L).grippers;
    int found = -1;
    for (size_t i = 0; i < grippers.size(); ++i) {
      if (grippers[i].robot != robot) continue;
      if (found >= 0) throw std::runtime_error("the robot has several grippers; use r.grippers.NAME");
      found = static_cast<int>(i);
    }
    if (found < 0) throw std::runtime_error("the robot has no gripper");
    push_handle(L, kGripperType, found);
  }

  static void push_grippers(lua_State* L, int robot) {
    const std::vector<GripperDescription>& grippers = cell_info(L).grippers;
    lua_newtable(L);
    for (size_t i = 0; i < grippers.size(); ++i) {
      if (grippers[i].robot != robot) continue;
      push_handle(L, kGripperType, static_cast<int>(i));
      lua_setfield(L, -2, grippers[i].name.c_str());
    }
  }

  static GripperSetPoint& own_gripper(lua_State* L, const GripperDescription*& info) {
    const int gripper = to_handle(L, kGripperType, " (write r.gripper:close(), not r.gripper.close())");
    if (program(L).leaves_gripper(gripper))
      throw std::runtime_error("the program has left this gripper to another controller (leave_gripper)");
    info = &cell_info(L).grippers[static_cast<size_t>(gripper)];
    routine_of(L, info->robot);
    return (*program(L).context_.grippers)[static_cast<size_t>(gripper)];
  }

  static double to_part_of(lua_State* L, int index, const char* what, double largest, const char* unit) {
    const double value = to_number(L, index, what);
    if (value >= 0.0 && value <= largest) return value;
    char text[160];
    std::snprintf(text, sizeof text, "%s = %.6g %s is outside [0, %.6g] %s", what, value, unit, largest,
                  unit);
    throw std::runtime_error(text);
  }

  static int open(lua_State* L) {
    if (lua_gettop(L) >= 2) return width(L);
    const GripperDescription* info = nullptr;
    GripperSetPoint& command = own_gripper(L, info);
    command = {command.gripper, GripperAction::open, info->max_width, info->max_force};
    return 0;
  }

  static int close(lua_State* L) {
    const GripperDescription* info = nullptr;
    GripperSetPoint& command = own_gripper(L, info);
    const double force =
        lua_isnoneornil(L, 2) ? info->max_force : to_part_of(L, 2, "force", info->max_force, "N");
    command = {command.gripper, GripperAction::close, 0.0, force};
    return 0;
  }

  static int width(lua_State* L) {
    const GripperDescription* info = nullptr;
    GripperSetPoint& command = own_gripper(L, info);
    const double width = to_part_of(L, 2, "width", info->max_width, "m");
    command = {command.gripper, GripperAction::width, width, info->max_force};
    return 0;
  }
};

struct DeviceFunctions {
  static int device(lua_State* L) {
    Program& self = ProgramFunctions::program(L);
    if (self.state_ != nullptr) throw std::runtime_error("devices are asked for while the program is loaded");
    const int index = index_by_name(self.context_.cell->devices, to_name(L, 1), "the cell has no device");
    self.devices_.insert(index);
    push_handle(L, kDeviceType, index);
    return 1;
  }

  static int leave_gripper(lua_State* L) {
    Program& self = ProgramFunctions::program(L);
    if (self.state_ != nullptr) throw std::runtime_error("grippers are left while the program is loaded");
    self.left_grippers_.insert(
        index_by_name(self.context_.cell->grippers, to_name(L, 1), "the cell has no gripper"));
    return 0;
  }

  static int name(lua_State* L) {
    const auto device = static_cast<size_t>(to_handle(L, kDeviceType));
    lua_pushstring(L, ProgramFunctions::cell_info(L).devices[device].name.c_str());
    return 1;
  }

  static int set(lua_State* L) {
    const auto device =
        static_cast<size_t>(to_handle(L, kDeviceType, " (write device:set{...}, not device.set{...})"));
    const DeviceDescription& info = ProgramFunctions::cell_info(L).devices[device];
    if (ProgramFunctions::program(L).current_ == nullptr)
      throw std::runtime_error("signals of a device are set while routines run");
    if (!lua_istable(L, 2)) throw std::runtime_error("a table {SIGNAL = value, ...} is needed");
    DeviceSetPoint& standing = (*ProgramFunctions::program(L).context_.devices)[device];
    lua_pushnil(L);
    while (lua_next(L, 2) != 0) {
      if (lua_type(L, -2) != LUA_TSTRING)
        throw std::runtime_error("every value needs the name of its signal: {SIGNAL = value, ...}");
      const std::string_view name = to_name(L, -2);
      const int signal = index_by_name(info.signals, name, info.name + " has no signal");
      set_signal(standing, signal, to_number(L, -1, name));
      lua_pop(L, 1);
    }
    return 0;
  }

  /// In the order of signals, whatever order the table has.
  static void set_signal(DeviceSetPoint& standing, int signal, double value) {
    const auto place = std::lower_bound(standing.signals.begin(), standing.signals.end(), signal);
    const auto at = place - standing.signals.begin();
    if (place != standing.signals.end() && *place == signal) {
      standing.values[static_cast<size_t>(at)] = value;
      return;
    }
    standing.signals.insert(place, signal);
    standing.values.insert(standing.values.begin() + at, value);
  }
};

namespace {

using F = ProgramFunctions;
constexpr LuaCall kRobotCalls[] = {
    {"name", F::name, "the robot's name"},
    {"gripper", F::gripper, "its only gripper"},
    {"grippers", F::grippers, "its grippers by name: `r.grippers.NAME`"},
    {"tcp", F::tcp, "pose of the TCP as commanded last"},
    {"joints", F::joints, "joint positions as commanded last, a list (rad or m)"},
    {"move_joints({q1, ...} [, options])", lua_entry<F::move_joints>, "all joints start and stop together"},
    {"move_to(pose [, options])", lua_entry<F::move_to>,
     "the same, to the nearest joint positions that give the pose"},
    {"move_line(pose [, options])", lua_entry<F::move_line>,
     "the TCP on a straight line; the orientation turns evenly about one axis"},
    {"wait(seconds)", lua_entry<F::wait>, "goes on after this time"},
    {"wait_until(time_s)", lua_entry<F::wait_until>, "goes on in the first period at or after this time"},
    {"wait_signal(name)", lua_entry<F::wait_signal>,
     "goes on once `signal(name)` has been called, in the same period"},
    {"wait_for(function(cell) return ... end [, seconds])", lua_entry<F::wait_for>,
     "goes on once the function returns true; it is called every period. An error after the given time"},
    {"step(name)", lua_entry<F::step>,
     "names the work of the routine until its next `r:step`; reports list time and energy of each step"}};
constexpr LuaCall kGripperCalls[] = {
    {"open([width_m])", lua_entry<F::open>, "opens fully, or to this width"},
    {"close([force_N])", lua_entry<F::close>,
     "closes, and holds the Parts that both jaws touch, with at most this force; without it the gripper's "
     "own limit"},
    {"width(width_m)", lua_entry<F::width>, "moves the jaws to this width without holding"}};
constexpr LuaCall kDeviceCalls[] = {
    {"name", DeviceFunctions::name, "the device's name"},
    {"set{SIGNAL = value, ...}", lua_entry<DeviceFunctions::set>, "sets signals; others keep their values"}};
constexpr LuaCall kFunctions[] = {
    {"routine(ROBOT, function(r) ... end)", lua_entry<F::routine>,
     "at load: the routine that drives this robot; `r` is the robot"},
    {"device(NAME)", lua_entry<DeviceFunctions::device>, "at load: the device, which the program commands"},
    {"leave_gripper(NAME)", lua_entry<DeviceFunctions::leave_gripper>,
     "at load: leaves a gripper of a driven robot to another controller, e.g. a PLC"},
    {"parameter(NAME, default)", lua_entry<F::parameter>,
     "at load: the number that the scenario or the command line gives, or the default"},
    {"signal(name)", lua_entry<F::signal>,
     "gives a signal to the routines that wait for it. It stays given; in a loop give each round its own "
     "name"},
    {"print(...)", lua_entry<F::print>, "writes a line with the time to the error output"}};
/// Names that no table registers.
constexpr LuaCall kVariables[] = {
    {"period_s", nullptr, "the program sets it at load: period of the controller (s); without it 0.008"},
    {"cell", nullptr, "the state of the cell, at any time while routines run"}};

int index_robot(lua_State* L) {
  return push_member(L, kRobotCalls, "a robot");
}
int index_device(lua_State* L) {
  return push_member(L, kDeviceCalls, "a device", " (its signals: cell.devices.NAME.signals)");
}

}  // namespace

void open_program_library(lua_State* L) {
  open_pose_library(L);
  define_type(L, kRobotType, lua_entry<index_robot>, kRobotCalls);
  define_type(L, kGripperType, nullptr, kGripperCalls);
  define_type(L, kDeviceType, lua_entry<index_device>, kDeviceCalls);
  open_cell_view(L);
  register_functions(L, kFunctions);
}

std::string program_reference() {
  return lua_call_table(kFunctions) + "\nVariables:\n\n" + lua_call_table(kVariables) +
         "\n### A robot\n\n`r` is the robot of a routine.\n\n" + lua_call_table(kRobotCalls, "r:") +
         "\nOptions of `move_joints` and `move_to`:\n\n" + option_table(kJointOptions) +
         "\nOptions of `move_line`:\n\n" + option_table(kLineOptions) + "\n### A gripper\n\n" +
         lua_call_table(kGripperCalls, "r.gripper:") + "\n### A device\n\n" +
         lua_call_table(kDeviceCalls, "device:") + "\n### Poses\n\n" + pose_reference();
}

void push_routine_robot(lua_State* L, int robot) {
  push_handle(L, kRobotType, robot);
}

}  // namespace takt::controller

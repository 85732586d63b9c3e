#include "client_lib/controller/cell_view.h"

#include <stdexcept>
#include <string>

#include "client_lib/controller/lua_arguments.h"
#include "client_lib/controller/lua_handles.h"
#include "client_lib/controller/lua_pose.h"
#include "client_lib/controller/program.h"

namespace takt::controller {

namespace {

constexpr char kCellType[] = "cell";
constexpr char kComponentStateType[] = "component state";
constexpr char kRobotStateType[] = "robot state";
constexpr char kGripperStateType[] = "gripper state";
constexpr char kDeviceStateType[] = "device state";

const Program& program(lua_State* L) {
  return *static_cast<const Program*>(lua_owner(L));
}
const CellInfo& cell_info(lua_State* L) {
  return *program(L).context().cell;
}
const Input& input(lua_State* L) {
  return program(L).input();
}

int index_of_component(lua_State* L, std::string_view name) {
  return index_by_name(cell_info(L).components, name, "component",
                       [](const std::string& info) { return info; });
}
int index_of_robot(lua_State* L, std::string_view name) {
  return index_by_name(cell_info(L).robots, name, "robot", [](const RobotInfo& info) { return info.name; });
}
int index_of_gripper(lua_State* L, std::string_view name) {
  return index_by_name(cell_info(L).grippers, name, "gripper",
                       [](const GripperInfo& info) { return info.name; });
}

int index_cell(lua_State* L) {
  const std::string_view key = to_name(L, 2);
  if (key == "time_s") {
    lua_pushnumber(L, input(L).time_s);
  } else if (key == "components" || key == "robots" || key == "grippers" || key == "devices") {
    luaL_getmetafield(L, 1, std::string(key).c_str());
  } else {
    refuse_key("the cell", key, "time_s, components, robots, grippers, devices");
  }
  return 1;
}

int index_devices(lua_State* L) {
  push_handle(L, kDeviceStateType,
              index_by_name(cell_info(L).devices, to_name(L, 2), "device",
                            [](const DeviceInfo& info) { return info.name; }));
  return 1;
}

int index_device_state(lua_State* L) {
  const auto device = static_cast<size_t>(to_handle(L, kDeviceStateType));
  const DeviceInfo& info = cell_info(L).devices[device];
  const int signal =
      index_by_name(info.signals, to_name(L, 2), ("signal of " + info.name + " called").c_str(),
                    [](const std::string& known) { return known; });
  lua_pushnumber(L, input(L).devices[device][static_cast<size_t>(signal)]);
  return 1;
}

int index_components(lua_State* L) {
  push_handle(L, kComponentStateType, index_of_component(L, to_name(L, 2)));
  return 1;
}
int index_robots(lua_State* L) {
  push_handle(L, kRobotStateType, index_of_robot(L, to_name(L, 2)));
  return 1;
}
int index_grippers(lua_State* L) {
  push_handle(L, kGripperStateType, index_of_gripper(L, to_name(L, 2)));
  return 1;
}

/// Nil for none.
void push_component_name(lua_State* L, int component) {
  const std::vector<std::string>& names = cell_info(L).components;
  if (component < 0 || static_cast<size_t>(component) >= names.size())
    lua_pushnil(L);
  else
    lua_pushstring(L, names[static_cast<size_t>(component)].c_str());
}

int index_component_state(lua_State* L) {
  const Input::Component& state = input(L).components[static_cast<size_t>(to_handle(L, kComponentStateType))];
  const std::string_view key = to_name(L, 2);
  if (key == "pose") {
    push_pose(L, Pose::from_quaternion(state.p_WB, state.q_WB));
  } else if (key == "partner") {
    push_component_name(L, state.partner);
  } else {
    refuse_key("a component", key, "pose, partner");
  }
  return 1;
}

int index_robot_state(lua_State* L) {
  const auto robot = static_cast<size_t>(to_handle(L, kRobotStateType));
  const RobotDriver& driven = (*program(L).context().robots)[robot];
  const std::string_view key = to_name(L, 2);
  if (key == "joints") {
    push_joints(L, driven.arm(), input(L).robots[robot].position);
  } else if (key == "tcp") {
    push_pose(L, driven.tcp_at(input(L).robots[robot].position));
  } else {
    refuse_key("the state of a robot", key, "joints, tcp");
  }
  return 1;
}

int index_gripper_state(lua_State* L) {
  const Input::Gripper& state = input(L).grippers[static_cast<size_t>(to_handle(L, kGripperStateType))];
  const std::string_view key = to_name(L, 2);
  if (key == "width_m") {
    lua_pushnumber(L, state.width_m);
  } else if (key == "closed") {
    lua_pushboolean(L, state.closed ? 1 : 0);
  } else if (key == "moving") {
    lua_pushboolean(L, state.moving ? 1 : 0);
  } else if (key == "in_position") {
    lua_pushboolean(L, state.in_position ? 1 : 0);
  } else if (key == "force_N") {
    lua_pushnumber(L, state.force_N);
  } else if (key == "part_present") {
    push_component_name(L, state.part);
  } else {
    refuse_key("the state of a gripper", key, "width_m, force_N, moving, in_position, part_present, closed");
  }
  return 1;
}

/// A table without content whose names are looked up by `index`, as a field of the cell's metatable.
void define_view(lua_State* L, const char* name, lua_CFunction index) {
  luaL_getmetatable(L, kCellType);
  lua_newtable(L);
  lua_createtable(L, 0, 1);
  lua_pushcfunction(L, index);
  lua_setfield(L, -2, "__index");
  lua_setmetatable(L, -2);
  lua_setfield(L, -2, name);
  lua_pop(L, 1);
}

}  // namespace

void open_cell_view(lua_State* L) {
  const luaL_Reg none[] = {{nullptr, nullptr}};
  define_type(L, kCellType, lua_entry<index_cell>, none);
  define_type(L, kComponentStateType, lua_entry<index_component_state>, none);
  define_type(L, kRobotStateType, lua_entry<index_robot_state>, none);
  define_type(L, kGripperStateType, lua_entry<index_gripper_state>, none);
  define_type(L, kDeviceStateType, lua_entry<index_device_state>, none);
  define_view(L, "devices", lua_entry<index_devices>);
  define_view(L, "components", lua_entry<index_components>);
  define_view(L, "robots", lua_entry<index_robots>);
  define_view(L, "grippers", lua_entry<index_grippers>);
  push_cell(L);
  lua_setglobal(L, "cell");
}

void push_cell(lua_State* L) {
  push_handle(L, kCellType, 0);
}

}  // namespace takt::controller

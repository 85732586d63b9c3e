#include "client_lib/controller/lua_pose.h"

#include <cmath>
#include <cstdio>
#include <iostream>
#include <new>
#include <numbers>
#include <string>
#include <string_view>
#include <type_traits>

#include "client_lib/controller/lua_arguments.h"
#include "client_lib/controller/lua_handles.h"
#include "client_lib/kinematics/motions.h"

namespace takt::controller {

namespace {

constexpr char kPoseType[] = "pose";
static_assert(std::is_trivially_destructible_v<Pose>, "poses are collected without a destructor");

/// One note for each line of the program: an angle beyond a full turn is rather in degrees.
void note_angle(lua_State* L, const char* name, double value) {
  if (std::abs(value) <= 2.0 * std::numbers::pi * (1.0 + 1e-9)) return;
  luaL_where(L, 1);
  const std::string place = lua_tostring(L, -1);
  lua_pop(L, 1);
  const std::string key = "takt.angle " + place + name;
  const bool known = lua_getfield(L, LUA_REGISTRYINDEX, key.c_str()) != LUA_TNIL;
  lua_pop(L, 1);
  if (known) return;
  lua_pushboolean(L, 1);
  lua_setfield(L, LUA_REGISTRYINDEX, key.c_str());
  char text[160];
  std::snprintf(text, sizeof text,
                "%s = %.6g is more than a full turn; angles are in radians: %s = math.rad(%.6g), and half a "
                "turn is math.pi",
                name, value, name, value);
  std::clog << "note: " << place << text << "\n";
}

int make_pose(lua_State* L) {
  double x = 0.0, y = 0.0, z = 0.0, roll = 0.0, pitch = 0.0, yaw = 0.0;
  const NamedNumber fields[] = {{"x", &x},       {"y", &y},         {"z", &z},
                                {"roll", &roll}, {"pitch", &pitch}, {"yaw", &yaw}};
  read_options(L, 1, fields);
  note_angle(L, "roll", roll);
  note_angle(L, "pitch", pitch);
  note_angle(L, "yaw", yaw);
  push_pose(L, {rotation_from_rpy({roll, pitch, yaw}), {x, y, z}});
  return 1;
}

int multiply(lua_State* L) {
  push_pose(L, to_pose(L, 1) * to_pose(L, 2));
  return 1;
}

/// pose:offset(dx, dy, dz): moved along the axes of the frame the pose is given in.
int offset(lua_State* L) {
  Pose X = to_pose(L, 1);
  X.p += Vec3(to_number(L, 2, "dx"), to_number(L, 3, "dy"), to_number(L, 4, "dz"));
  push_pose(L, X);
  return 1;
}

int inverse(lua_State* L) {
  push_pose(L, to_pose(L, 1).inverse());
  return 1;
}

int text(lua_State* L) {
  lua_pushstring(L, ("pose" + to_text(to_pose(L, 1))).c_str());
  return 1;
}

template <double (*number)(const Pose&)>
int push_number(lua_State* L) {
  lua_pushnumber(L, number(to_pose(L, 1)));
  return 1;
}
constexpr LuaCall kPoseCalls[] = {
    {"x", push_number<[](const Pose& X) { return X.p.x(); }>, "m"},
    {"y", push_number<[](const Pose& X) { return X.p.y(); }>, "m"},
    {"z", push_number<[](const Pose& X) { return X.p.z(); }>, "m"},
    {"roll", push_number<[](const Pose& X) { return std::atan2(X.R(2, 1), X.R(2, 2)); }>,
     "rad, about the fixed x axis"},
    {"pitch",
     push_number<[](const Pose& X) { return std::atan2(-X.R(2, 0), std::hypot(X.R(0, 0), X.R(1, 0))); }>,
     "rad, about the fixed y axis"},
    {"yaw", push_number<[](const Pose& X) { return std::atan2(X.R(1, 0), X.R(0, 0)); }>,
     "rad, about the fixed z axis"},
    {"offset(dx, dy, dz)", lua_entry<offset>,
     "the pose moved along the axes of the frame in which it is given (m)"},
    {"inverse()", lua_entry<inverse>, "the inverse"}};
constexpr LuaCall kPoseOperators[] = {
    {"a * b", lua_entry<multiply>, "the pose b given in the frame a", "__mul"},
    {"tostring(a)", lua_entry<text>, "the pose as text", "__tostring"}};
constexpr LuaCall kPoseFunctions[] = {
    {"pose{x=, y=, z=, roll=, pitch=, yaw=}", lua_entry<make_pose>,
     "a pose: Rz(yaw) Ry(pitch) Rx(roll), angles about fixed axes; omitted values are 0"}};

int index_pose(lua_State* L) {
  to_pose(L, 1);
  return push_member(L, kPoseCalls, "a pose");
}

}  // namespace

void open_pose_library(lua_State* L) {
  define_type(L, kPoseType, lua_entry<index_pose>, kPoseCalls);
  luaL_getmetatable(L, kPoseType);
  for (const LuaCall& call : kPoseOperators) {
    lua_pushcfunction(L, call.function);
    lua_setfield(L, -2, std::string(call.name()).c_str());
  }
  lua_pop(L, 1);
  register_functions(L, kPoseFunctions);
}

std::string pose_reference() {
  return lua_call_table(kPoseFunctions) + "\nOf a pose `a`:\n\n" + lua_call_table(kPoseCalls, "a:") + "\n" +
         lua_call_table(kPoseOperators);
}

void push_pose(lua_State* L, const Pose& X) {
  new (lua_newuserdatauv(L, sizeof(Pose), 0)) Pose(X);
  luaL_setmetatable(L, kPoseType);
}

Pose to_pose(lua_State* L, int index) {
  const void* data = luaL_testudata(L, index, kPoseType);
  if (data == nullptr) {
    throw std::runtime_error("a pose is needed, as of pose{x=, y=, z=, roll=, pitch=, yaw=}, not a " +
                             std::string(luaL_typename(L, index)));
  }
  return *static_cast<const Pose*>(data);
}

}  // namespace takt::controller

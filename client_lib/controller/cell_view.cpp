#include "client_lib/controller/cell_view.h"

#include <algorithm>
#include <span>
#include <stdexcept>
#include <string>
#include <type_traits>

#include "client_lib/controller/lua_arguments.h"
#include "client_lib/controller/lua_handles.h"
#include "client_lib/controller/lua_pose.h"
#include "client_lib/controller/program.h"
#include "client_lib/kinematics/arm.h"
#include "idl/common/eigen_messages.h"
#include "idl/common/text.h"

namespace takt::controller {

namespace {

constexpr char kViewType[] = "part of the cell";

/// Where a message or a list of messages is: kState or kDescription, then the number of each field and, behind that of a
/// list, the number of the element.
using Way = std::span<const int>;
constexpr int kState = 0, kDescription = 1;
constexpr int kCell[] = {kState};

const Program& program(lua_State* L) {
  return *static_cast<const Program*>(lua_owner(L));
}

void push_view(lua_State* L, Way way, std::initializer_list<int> further = {}) {
  auto* made = static_cast<int*>(lua_newuserdatauv(L, (way.size() + further.size()) * sizeof(int), 0));
  std::ranges::copy(further, std::ranges::copy(way, made).out);
  luaL_setmetatable(L, kViewType);
}

Way to_view(lua_State* L) {
  const void* way = luaL_testudata(L, 1, kViewType);
  if (way == nullptr) throw std::runtime_error("a part of the cell is needed");
  return {static_cast<const int*>(way), lua_rawlen(L, 1) / sizeof(int)};
}

/// Calls `use(value, field, of)` with the message or list at the end of the way; `of` has the names of what the value is of.
template <Message Type, typename Use>
void follow(const Type& message, const FieldInfo& field, const Named& of, Way way, const Use& use) {
  if (way.empty()) return use(message, field, of);
  int number = 0;
  for_each_field(message, [&](const FieldInfo& info, const auto& value) {
    using Member = std::decay_t<decltype(value)>;
    if (number++ != way[0]) return;
    if constexpr (Message<Member>) {
      follow(value, info, of, way.subspan(1), use);
    } else if constexpr (kIsMessageList<Member>) {
      if (way.size() == 1) return use(value, info, of);
      const auto element = static_cast<std::size_t>(way[1]);
      const auto* order = order_of(info, of);
      follow(value.at(element), info, order == nullptr ? of : order->at(element), way.subspan(2), use);
    }
  });
}

template <typename Use>
void follow(lua_State* L, Way way, const Use& use) {
  const Program& self = program(L);
  const Named& names = *self.context().names;
  if (way[0] == kDescription)
    follow(*self.context().cell, FieldInfo{}, names, way.subspan(1), use);
  else
    follow(self.state(), FieldInfo{}, names, way.subspan(1), use);
}

/// Brings up to date what the key of index_view may lead to. The time always is.
void look(lua_State* L, Way way) {
  if (way[0] != kState) return;
  if (way.size() < 3) {
    const bool is_time = way.size() == 1 && lua_type(L, 2) == LUA_TSTRING && to_name(L, 2) == "time";
    if (!is_time) (void)program(L).state(StatePart::instant, 0);
    return;
  }
  const std::string_view list =
      message_info<takt_msgs::msg::CellState>().fields[static_cast<std::size_t>(way[1])].name;
  const bool is_field = way.size() == 3 && lua_type(L, 2) == LUA_TSTRING;
  (void)program(L).state(part_of(list, is_field ? to_name(L, 2) : std::string_view{}),
                         static_cast<std::size_t>(way[2]));
}

std::string_view short_name(const MessageInfo& message) {
  return message.name.substr(message.name.rfind('/') + 1);
}

/// What a table says about names that it does not have: `index`, with `subject` as its upvalue.
void set_index(lua_State* L, const void* subject, lua_CFunction index) {
  if (lua_rawgetp(L, LUA_REGISTRYINDEX, subject) == LUA_TNIL) {
    lua_pop(L, 1);
    lua_createtable(L, 0, 1);
    lua_pushlightuserdata(L, const_cast<void*>(subject));
    lua_pushcclosure(L, index, 1);
    lua_setfield(L, -2, "__index");
    lua_pushvalue(L, -1);
    lua_rawsetp(L, LUA_REGISTRYINDEX, subject);
  }
  lua_setmetatable(L, -2);
}

template <typename Subject>
const Subject& subject(lua_State* L) {
  return *static_cast<const Subject*>(lua_touserdata(L, lua_upvalueindex(1)));
}

/// Numbers in the order of described things, by the name of one; nil behind the last number.
int index_numbers(lua_State* L) {
  if (lua_isinteger(L, 2) != 0) {
    lua_pushnil(L);
    return 1;
  }
  const auto& order = subject<std::vector<Named>>(L);
  lua_rawgeti(L, 1, index_by_name(order, to_name(L, 2), "the list has no") + 1);
  return 1;
}

int index_quantity(lua_State* L) {
  const auto& message = subject<MessageInfo>(L);
  refuse_key(short_name(message), to_name(L, 2), list_names(message.fields));
}

struct Values {
  lua_State* L;
  Way way;  ///< of the message that has the field
  int number;

  template <typename Number>
  void push(const FieldInfo& field, const Number& value, const Named&) const {
    if constexpr (TabledEnumeration<Number>) {
      push(field, std::string(to_string(value)), {});
    } else if constexpr (std::is_same_v<Number, bool>) {
      lua_pushboolean(L, value ? 1 : 0);
    } else if constexpr (std::is_floating_point_v<Number>) {
      lua_pushnumber(L, value);
    } else if (has_annotation(field.annotations, "hexadecimal")) {
      push(field, hexadecimal_text(static_cast<std::uint64_t>(value)), {});
    } else if (const auto list = annotation(field.annotations, "index"); !list.empty()) {
      const std::string* name = program(L).context().names->name_of(list, static_cast<std::int64_t>(value));
      name == nullptr ? lua_pushnil(L) : push(field, *name, {});
    } else {
      lua_pushinteger(L, static_cast<lua_Integer>(value));
    }
  }
  void push(const FieldInfo&, const std::string& text, const Named&) const {
    lua_pushlstring(L, text.data(), text.size());
  }
  template <Message Type>
  void push(const FieldInfo&, const Type& message, const Named& of) const {
    constexpr const MessageInfo& info = message_info<Type>();
    if constexpr (!has_annotation(info.annotations, "quantity")) {
      push_view(L, way, {number});
    } else {
      lua_createtable(L, 0, static_cast<int>(info.fields.size()));
      for_each_field(message, [&](const FieldInfo& field, const auto& value) {
        push(field, value, of);
        lua_setfield(L, -2, std::string(field.name).c_str());
      });
      set_index(L, &info, lua_entry<index_quantity>);
    }
  }
  template <typename Element>
  void push(const FieldInfo& field, const std::vector<Element>& list, const Named& of) const {
    if constexpr (Message<Element>) {
      push_view(L, way, {number});
    } else {
      lua_createtable(L, static_cast<int>(list.size()), 0);
      for (std::size_t i = 0; i < list.size(); ++i) {
        push({}, list[i], of);
        lua_rawseti(L, -2, static_cast<lua_Integer>(i) + 1);
      }
      if (const auto* order = order_of(field, of)) set_index(L, order, lua_entry<index_numbers>);
    }
  }
};

/// What programs would have to work out of the fields of a message, if the key is its name.
struct Derived {
  lua_State* L;
  Way way;
  std::string_view key;

  template <Message Type>
  static std::string names() {
    if constexpr (std::is_same_v<Type, takt_msgs::msg::CellState>) return ", description";
    if constexpr (std::is_same_v<Type, takt_msgs::msg::RobotState>) return ", tcp";
    if constexpr (std::is_same_v<Type, takt_msgs::msg::ComponentState> ||
                  std::is_same_v<Type, takt_msgs::msg::Transform>)
      return ", pose";
    return {};
  }
  template <Message Type>
  bool push(const Type&) const {
    return false;
  }
  bool push(const takt_msgs::msg::RobotState& robot) const {
    if (key != "tcp") return false;
    push_pose(L, (*program(L).context().robots)[static_cast<std::size_t>(way.back())].tcp_at(robot.position));
    return true;
  }
  bool push(const takt_msgs::msg::ComponentState& component) const {
    if (key != "pose") return false;
    push_pose(L, Pose::from_quaternion(to_eigen(component.position), to_eigen(component.orientation)));
    return true;
  }
  bool push(const takt_msgs::msg::Transform& transform) const {
    if (key != "pose") return false;
    push_pose(L, pose_of(transform));
    return true;
  }
};

/// What a key leads to.
struct Indexing {
  lua_State* L;
  Way way;

  template <Message Type>
  void operator()(const Type& message, const FieldInfo&, const Named& of) const {
    const std::string_view key = to_name(L, 2);
    const int before = lua_gettop(L);
    int number = 0;
    for_each_field(message, [&](const FieldInfo& field, const auto& value) {
      if (field.name == key) Values{L, way, number}.push(field, value, of);
      ++number;
    });
    if (lua_gettop(L) > before || Derived{L, way, key}.push(message)) return;
    const MessageInfo& info = message_info<Type>();
    refuse_key(short_name(info), key, list_names(info.fields) + Derived::names<Type>());
  }
  template <Message Element>
  void operator()(const std::vector<Element>& list, const FieldInfo& field, const Named& of) const {
    const std::string none = "the list of " + std::string(field.name) + " has no";
    int element = 0;
    if (lua_isinteger(L, 2) != 0) {
      const lua_Integer number = lua_tointeger(L, 2);
      if (number < 1 || number > static_cast<lua_Integer>(list.size())) return lua_pushnil(L);
      element = static_cast<int>(number) - 1;
    } else if (const auto* order = order_of(field, of)) {
      element = index_by_name(*order, to_name(L, 2), none);
    } else {
      const std::string_view key = annotation(field.annotations, "key");
      element =
          index_by_name(list, to_name(L, 2), none, [&](const Element& one) { return text_of(one, key); });
    }
    push_view(L, way, {element});
  }

 private:
  template <Message Type>
  static std::string_view text_of(const Type& message, std::string_view name) {
    std::string_view text;
    for_each_field(message, [&](const FieldInfo& field, const auto& value) {
      if constexpr (std::is_same_v<std::decay_t<decltype(value)>, std::string>)
        if (field.name == name) text = value;
    });
    return text;
  }
};

int index_view(lua_State* L) {
  const Way way = to_view(L);
  // The description is known while the program is loaded.
  if (std::ranges::equal(way, kCell) && lua_type(L, 2) == LUA_TSTRING && to_name(L, 2) == "description") {
    constexpr int description[] = {kDescription};
    push_view(L, description);
  } else {
    look(L, way);
    follow(L, way, Indexing{L, way});
  }
  return 1;
}

int length_of_view(lua_State* L) {
  if (to_view(L)[0] == kState) (void)program(L).state(StatePart::instant, 0);
  follow(L, to_view(L), [&]<typename Value>(const Value& value, const FieldInfo&, const Named&) {
    if constexpr (kIsList<Value>)
      lua_pushinteger(L, static_cast<lua_Integer>(value.size()));
    else
      throw std::runtime_error(std::string(short_name(message_info<Value>())) + " is no list");
  });
  return 1;
}

}  // namespace

void open_cell_view(lua_State* L) {
  define_type(L, kViewType, lua_entry<index_view>, {});
  luaL_getmetatable(L, kViewType);
  lua_pushcfunction(L, lua_entry<length_of_view>);
  lua_setfield(L, -2, "__len");
  lua_pop(L, 1);
  push_cell(L);
  lua_setglobal(L, "cell");
}

void push_cell(lua_State* L) {
  push_view(L, kCell);
}

}  // namespace takt::controller

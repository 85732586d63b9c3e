#include "idl/lua/lua_sandbox.h"

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <new>

#include "idl/lua/lua_libraries.h"

namespace takt {

namespace {

constexpr int kInstructionsPerCount = 1000, kMaxVariableArguments = 1000;
constexpr std::size_t kBytesPerInstruction = 256;     ///< of new memory: writing it, and collecting it later
constexpr std::size_t kBytesPerFullCollection = 640;  ///< per instruction, of the memory in use
constexpr std::size_t kStringHead_bytes = 64;         ///< at most; of the memory that Lua asks for a string

constexpr std::string_view kTooManyArguments = "a function may have 1000 variable arguments";
constexpr std::string_view kTooLongString = "not enough memory: a string may have 1 MB";
static_assert(kLuaInstructionsPerUpdate == 1'000'000 && kLuaMemory_bytes == 64U << 20U &&
              kLuaString_bytes == 1U << 20U);

constexpr char kPreludeName[] = "prelude";

// The reduced standard libraries, written in Lua. The prelude removes functions that are not deterministic (random
// numbers, addresses in texts, the order of a hash table, which Lua seeds by clock and address) and functions that
// reach files or other code.
constexpr char kPrelude[] = R"lua(
local raw_next, raw_setmetatable, raw_tostring, raw_format = next, setmetatable, tostring, string.format
local raw_type, raw_error, raw_rawget, sort, find = type, error, rawget, table.sort, string.find
local pack, unpack = table.pack, table.unpack

for _, name in raw_next, { "collectgarbage", "dofile", "load", "loadfile", "next", "getmetatable", "rawequal", "rawget",
                           "rawlen", "rawset", "warn", "print" } do
  _G[name] = nil
end
math.random, math.randomseed, string.dump = nil, nil, nil

local rank = { number = 1, string = 2, boolean = 3 }
local function before(a, b)
  local kind_a, kind_b = raw_type(a), raw_type(b)
  if kind_a ~= kind_b then return rank[kind_a] < rank[kind_b] end
  if kind_a == "boolean" then return not a and b end
  return a < b
end

-- Numbers in rising order, then strings, then false and true.
function pairs(t)
  if raw_type(t) ~= "table" then raw_error("pairs: a table is needed, not a " .. raw_type(t), 2) end
  local keys = {}
  for key in raw_next, t do
    if not rank[raw_type(key)] then
      raw_error("pairs: a key is a " .. raw_type(key) .. "; only numbers, strings and booleans have a fixed order", 2)
    end
    keys[#keys + 1] = key
  end
  sort(keys, before)
  local i = 0
  return function()
    i = i + 1
    local key = keys[i]
    if key ~= nil then return key, t[key] end
  end
end

function setmetatable(t, meta)
  if raw_type(meta) == "table" and raw_rawget(meta, "__gc") ~= nil then
    raw_error("setmetatable: __gc is not allowed", 2)
  end
  return raw_setmetatable(t, meta)
end

local has_address = { table = true, ["function"] = true, thread = true }
function tostring(v)
  if has_address[raw_type(v)] then return raw_type(v) end
  return raw_tostring(v)
end

function string.format(text, ...)
  if raw_type(text) == "string" and find(text, "%%[^%a%%]*p") then
    raw_error("string.format: %p is not allowed", 2)
  end
  local values = pack(...)
  for i = 1, values.n do
    if has_address[raw_type(values[i])] then values[i] = raw_type(values[i]) end
  end
  return raw_format(text, unpack(values, 1, values.n))
end

raw_setmetatable(_G, { __index = function(_, name) raw_error("undefined name '" .. raw_tostring(name) .. "'", 2) end })
)lua";

void open_library(lua_State* L, const char* name, lua_CFunction open) {
  luaL_requiref(L, name, open, 1);
  lua_pop(L, 1);
}

}  // namespace

LuaSandbox::LuaSandbox(void* owner, const LuaLimits& limits)
    : header_{this, owner}, limits_(limits), L_(lua_newstate(&LuaSandbox::allocate, this)) {
  if (L_ == nullptr) throw std::bad_alloc();
  // The space in front of a state is copied to the threads made from it.
  Header* header = &header_;
  std::memcpy(lua_getextraspace(L_), &header, sizeof header);
  open_library(L_, LUA_GNAME, luaopen_base);
  open_library(L_, LUA_MATHLIBNAME, luaopen_math);
  open_library(L_, LUA_STRLIBNAME, luaopen_string);
  open_library(L_, LUA_TABLIBNAME, luaopen_table);
  open_library(L_, LUA_UTF8LIBNAME, luaopen_utf8);
  bound_libraries(L_);
  if (luaL_loadbufferx(L_, kPrelude, sizeof kPrelude - 1, "=prelude", "t") != LUA_OK ||
      lua_pcall(L_, 0, 0, 0) != LUA_OK) {
    const std::string text = error_text(L_);
    lua_close(L_);
    throw std::runtime_error(text);
  }
  lua_sethook(L_, &LuaSandbox::count, LUA_MASKCOUNT, kInstructionsPerCount);
}

LuaSandbox::~LuaSandbox() {
  lua_close(L_);
}

void LuaSandbox::run(const std::string& text, const std::string& file) {
  // Lua shortens long names of chunks from the left; the bare file name says more then.
  const bool fits = file.size() + 1 < LUA_IDSIZE;
  const std::string chunk = "@" + (fits ? file : file.substr(file.find_last_of('/') + 1));
  refill();
  running_ = L_;
  if (luaL_loadbufferx(L_, text.data(), text.size(), chunk.c_str(), "t") != LUA_OK ||
      lua_pcall(L_, 0, 0, 0) != LUA_OK || exceeded()) {
    const std::string reason = error_text(L_);
    lua_settop(L_, 0);
    throw std::runtime_error(reason);
  }
}

std::string LuaSandbox::error_text(lua_State* thread) const {
  if (!exceeded_.empty()) return exceeded_at_ + std::string(exceeded_);
  const char* said = lua_tostring(thread, -1);
  std::string text = said != nullptr ? said : "error value of type " + std::string(luaL_typename(thread, -1));
  if (thread == L_) return text;
  // A thread that failed keeps its stack: the lines further up say how the program got there. The innermost
  // is part of the message already.
  lua_Debug activation;
  std::string lines;
  bool innermost = true;
  for (int level = 0; lua_getstack(thread, level, &activation) != 0; ++level) {
    lua_getinfo(thread, "Sl", &activation);
    if (activation.currentline <= 0) continue;
    if (!innermost) {
      lines += (lines.empty() ? " (called from line " : ", ") + std::to_string(activation.currentline);
    }
    innermost = false;
  }
  return lines.empty() ? text : text + lines + ")";
}

void* LuaSandbox::allocate(void* sandbox, void* block, std::size_t old_size, std::size_t new_size) {
  auto* self = static_cast<LuaSandbox*>(sandbox);
  const std::size_t released =
      block != nullptr ? old_size : 0;  // without a block, old_size is a kind of object
  if (new_size == 0) {
    self->bytes_ -= released;
    std::free(block);
    return nullptr;
  }
  const bool is_string = block == nullptr && old_size == LUA_TSTRING;
  if (is_string && new_size > kLuaString_bytes + kStringHead_bytes) {
    self->refuse(new_size, kTooLongString);
    return nullptr;
  }
  if (new_size > released && self->bytes_ - released + new_size > self->limits_.memory_bytes) {
    self->refuse(new_size, self->limits_.too_much_memory);
    return nullptr;
  }
  void* result = std::realloc(block, new_size);
  if (result == nullptr) return nullptr;
  self->bytes_ += new_size - released;
  if (new_size > released) {
    self->refused_bytes_ = 0;
    self->instructions_left_ -= static_cast<long>((new_size - released) / kBytesPerInstruction);
    if (self->instructions_left_ < 0) self->exceed(self->limits_.too_much_work);
  }
  return result;
}

/// Lua collects all garbage after a refusal and asks once more.
void LuaSandbox::refuse(std::size_t size, std::string_view limit) {
  if (refused_bytes_ == size) exceed(limit);
  refused_bytes_ = size;
  instructions_left_ -= static_cast<long>(bytes_ / kBytesPerFullCollection);
}

void LuaSandbox::exceed(std::string_view limit) {
  if (!exceeded_.empty() || running_ == nullptr) return;
  exceeded_ = limit;
  lua_Debug activation{};
  for (int level = 0; lua_getstack(running_, level, &activation) != 0; ++level) {
    lua_getinfo(running_, "Sl", &activation);
    if (activation.currentline <= 0 || std::strcmp(activation.short_src, kPreludeName) == 0) continue;
    std::snprintf(exceeded_at_, sizeof exceeded_at_, "%s:%d: ", activation.short_src, activation.currentline);
    break;
  }
  lua_sethook(running_, &LuaSandbox::count, LUA_MASKCOUNT, 1);
}

void LuaSandbox::fail(lua_State* L) {
  lua_pushstring(L, exceeded_at_);
  lua_pushlstring(L, exceeded_.data(), exceeded_.size());
  lua_concat(L, 2);
  lua_error(L);
  std::abort();  // lua_error() does not return
}

LuaSandbox& LuaSandbox::of(lua_State* L) {
  Header* header = nullptr;
  std::memcpy(&header, lua_getextraspace(L), sizeof header);
  return *header->sandbox;
}

void LuaSandbox::count(lua_State* L, lua_Debug*) {
  LuaSandbox& self = of(L);
  self.running_ = L;
  self.instructions_left_ -= lua_gethookcount(L);
  if (self.instructions_left_ < 0) self.exceed(self.limits_.too_much_work);
  // One instruction copies all of them.
  lua_Debug running{};
  if (lua_getstack(L, 0, &running) != 0 && lua_getlocal(L, &running, -kMaxVariableArguments - 1) != nullptr) {
    lua_pop(L, 1);
    self.exceed(kTooManyArguments);
  }
  if (!self.exceeded_.empty()) self.fail(L);
}

void spend_work(lua_State* L, std::size_t work) {
  LuaSandbox& self = LuaSandbox::of(L);
  self.running_ = L;
  self.instructions_left_ -= static_cast<long>(std::min<std::size_t>(work, kLuaInstructionsPerUpdate + 1));
  if (self.instructions_left_ < 0) self.exceed(self.limits_.too_much_work);
  if (!self.exceeded_.empty()) self.fail(L);
}

void refuse_long_string(lua_State* L) {
  LuaSandbox& self = LuaSandbox::of(L);
  self.running_ = L;
  self.exceed(kTooLongString);
  self.fail(L);
}

void* lua_owner(lua_State* L) {
  LuaSandbox::Header* header = nullptr;
  std::memcpy(&header, lua_getextraspace(L), sizeof header);
  return header->owner;
}

}  // namespace takt

// The bounded library functions of controller programs against Lua's own, and their bounds.
#include <gmock/gmock.h>

#include <random>
#include <string>
#include <string_view>
#include <vector>

#include "idl/lua/lua_sandbox.h"
#include "tests/support/effort.h"

namespace takt::controller {
namespace {

using testing::HasSubstr;

/// Writes what a call returned into `said`, strings with their bytes as numbers.
constexpr char kDescribe[] = R"lua(
local function text(v)
  if type(v) == "table" then return "table" end
  if type(v) ~= "string" then return type(v) .. ":" .. tostring(v) end
  v = v:gsub("argument #%d", "argument")  -- releases of Lua differ here
  return "string:" .. table.concat({string.byte(v, 1, -1)}, ",")
end
function describe(...)
  local all = {}
  for i = 1, select("#", ...) do all[i] = text((select(i, ...))) end
  said = table.concat(all, " ")
end
)lua";

/// Lua as it comes.
class PlainLua {
 public:
  PlainLua() : L_(luaL_newstate()) {
    luaL_openlibs(L_);
    run(kDescribe);
  }
  ~PlainLua() { lua_close(L_); }
  PlainLua(const PlainLua&) = delete;
  PlainLua& operator=(const PlainLua&) = delete;
  std::string run(const std::string& text) {
    if (luaL_loadbufferx(L_, text.data(), text.size(), "=test", "t") != LUA_OK ||
        lua_pcall(L_, 0, 0, 0) != LUA_OK) {
      const std::string error = lua_tostring(L_, -1);
      lua_pop(L_, 1);
      return error;
    }
    return said(L_);
  }
  static std::string said(lua_State* L) {
    lua_pushglobaltable(L);
    lua_pushstring(L, "said");
    lua_rawget(L, -2);
    const char* text = lua_tostring(L, -1);
    std::string result = text != nullptr ? text : "";
    lua_pop(L, 2);
    return result;
  }

 private:
  lua_State* L_;
};

class Sandbox {
 public:
  Sandbox() { lua_.run(kDescribe, "test"); }
  std::string run(const std::string& text) {
    try {
      lua_.run(text, "test");
    } catch (const std::runtime_error& error) {
      return error.what();
    }
    return PlainLua::said(lua_.state());
  }

 private:
  LuaSandbox lua_{nullptr};
};

class Calls {
 public:
  explicit Calls(unsigned seed) : random_(seed) {}

  std::string next() {
    const std::string subject = quoted(text(40));
    switch (number(9)) {
      case 0:
        return "describe(pcall(string.find, " + subject + ", " + quoted(pattern()) + ", " + place() + "))";
      case 1:
        return "describe(pcall(string.match, " + subject + ", " + quoted(pattern()) + ", " + place() + "))";
      case 2:
        return "describe(pcall(string.gsub, " + subject + ", " + quoted(pattern()) + ", " + replacement() +
               (number(3) == 0 ? ", " + std::to_string(number(4)) : "") + "))";
      case 3:
        return "describe(pcall(function() local n, all = 0, {} for a, b, c in string.gmatch(" + subject +
               ", " + quoted(pattern()) + ", " + place() +
               ") do n = n + 1 all[n] = tostring(a) .. tostring(b) .. tostring(c) end return "
               "table.concat(all, ';') end))";
      case 4:
        return "describe(pcall(string.find, " + subject + ", " + quoted(text(3)) + ", " + place() +
               ", true))";
      case 5:
        return "describe(pcall(string.rep, " + subject + ", " + std::to_string(number(8) - 2) +
               (number(2) == 0 ? ", " + quoted(text(3)) : "") + "))";
      case 6:
        return "local t = " + list() + " describe(pcall(table." +
               std::string(number(2) == 0 ? "insert" : "remove") + ", t" +
               (number(3) > 0 ? ", " + std::to_string(number(10) - 2) : "") + (number(2) > 0 ? ", 'x'" : "") +
               ")) local before = said describe(table.unpack(t, 1, 12)) said = before .. said";
      case 7:
        return "local t = " + list() + " describe(pcall(table.move, t, " + place() + ", " + place() + ", " +
               place() + (number(2) == 0 ? ", {7, 8}" : "") +
               ")) local before = said describe(table.unpack(t, -5, 12)) said = before .. said";
      default:
        return "local t = " + list() + " describe(pcall(table.concat, t, " + quoted(text(2)) + ", " +
               place() + ", " + place() + ")) local before = said table.sort(t" +
               (number(2) == 0 ? ", function(a, b) return a > b end" : "") +
               ") describe(table.unpack(t)) said = before .. said";
    }
  }

 private:
  int number(int below) { return static_cast<int>(random_() % static_cast<unsigned>(below)); }
  std::string place() { return std::to_string(number(14) - 4); }
  std::string text(int longest) {
    constexpr std::string_view kCharacters("ab(1 \0%].-a[x", 13);
    std::string result;
    for (int i = number(longest + 1); i > 0; --i)
      result += kCharacters[static_cast<std::size_t>(number(static_cast<int>(kCharacters.size())))];
    return result;
  }
  std::string pattern() {
    static const std::vector<std::string> kPieces{"a",
                                                  "b",
                                                  ".",
                                                  "%a",
                                                  "%d",
                                                  "%s",
                                                  "%W",
                                                  "%%",
                                                  "%.",
                                                  "[ab]",
                                                  "[^a]",
                                                  "[a-x]",
                                                  "[%d%]]",
                                                  "[]]",
                                                  "[^]]",
                                                  "(",
                                                  ")",
                                                  "()",
                                                  "%1",
                                                  "%2",
                                                  "%b()",
                                                  "%bab",
                                                  "%f[%w]",
                                                  "^",
                                                  "$",
                                                  "*",
                                                  "+",
                                                  "-",
                                                  "?",
                                                  "%g",
                                                  "(a",
                                                  "b*)",
                                                  "(.-)",
                                                  "%",
                                                  "[a",
                                                  "%0",
                                                  "%b",
                                                  "%f",
                                                  "%x",
                                                  "[a-]",
                                                  "[%a-z]",
                                                  "[-a]",
                                                  std::string(1, '\0')};
    std::string result;
    for (int i = number(6); i >= 0; --i)
      result += kPieces[static_cast<std::size_t>(number(static_cast<int>(kPieces.size())))];
    return result;
  }
  std::string replacement() {
    static const std::vector<std::string> kAll{"'x'",
                                               "'%0%0'",
                                               "'<%1>'",
                                               "'%2'",
                                               "'%%'",
                                               "'%'",
                                               "'%x'",
                                               "7",
                                               "''",
                                               "{a = 'A', b = false, ['1'] = 1}",
                                               "function(a, b) return b end",
                                               "function() return {} end",
                                               "string.upper",
                                               "function(a) return #a end",
                                               "nil"};
    return kAll[static_cast<std::size_t>(number(static_cast<int>(kAll.size())))];
  }
  std::string list() {
    std::string result = "{";
    for (int i = number(9); i > 0; --i) result += std::to_string(number(50)) + ", ";
    return result + "}";
  }
  static std::string quoted(const std::string& bytes) {
    std::string result = "\"";
    for (const char c : bytes) {
      char code[8];
      std::snprintf(code, sizeof code, "\\%03d", static_cast<int>(static_cast<unsigned char>(c)));
      result += code;
    }
    return result + "\"";
  }

  std::mt19937 random_;
};

TEST(LuaLibraries, BoundedFunctionsDoWhatLuaDoes) {
  PlainLua plain;
  Sandbox sandbox;
  Calls calls(7);
  int found = 0;
  for (std::size_t i = 0; i < 20'000 * test::effort(); ++i) {
    const std::string call = calls.next();
    const std::string expected = plain.run(call);
    ASSERT_EQ(sandbox.run(call), expected) << call;
    if (expected.starts_with("boolean:true string") || expected.starts_with("boolean:true number")) ++found;
  }
  EXPECT_GT(found, 5000);  // most calls are no errors
}

TEST(LuaLibraries, EqualElementsKeepTheirOrderInASort) {
  Sandbox sandbox;
  EXPECT_EQ(
      sandbox.run(
          "local t = {} for i = 1, 1000 do t[i] = {key = i % 7, at = i} end "
          "table.sort(t, function(a, b) return a.key < b.key end) local last = t[1] "
          "for i = 2, 1000 do assert(last.key < t[i].key or last.key == t[i].key and last.at < t[i].at) "
          "last = t[i] end said = 'sorted'"),
      "sorted");
  EXPECT_EQ(
      sandbox.run("local t = {} for i = 1, 500 do t[i] = i end table.sort(t, function() return true end) "
                  "said = #t"),
      "500");
}

struct Hostile {
  const char* name;
  const char* program;
  const char* limit;
};

class HostileCall : public testing::TestWithParam<Hostile> {};

/// Each would take hours or all memory in plain Lua, most of them within one call.
TEST_P(HostileCall, EndsWithTheLimitAndTheLine) {
  LuaSandbox lua(nullptr);
  for (const std::string& text :
       {std::string(GetParam().program),
        "while true do pcall(function() " + std::string(GetParam().program) + " end) end"}) {
    LuaSandbox fresh(nullptr);
    try {
      fresh.run(text, "hostile.lua");
      ADD_FAILURE() << text << " came to its end";
    } catch (const std::runtime_error& error) {
      EXPECT_THAT(error.what(), HasSubstr(GetParam().limit));
      EXPECT_THAT(error.what(), HasSubstr("hostile.lua:1: "));
    }
  }
}

constexpr char kWork[] = "more than 1000000 instructions", kMemory[] = "64 MB", kText[] = "1 MB";
INSTANTIATE_TEST_SUITE_P(
    All, HostileCall,
    testing::Values(
        Hostile{"Rep", "string.rep('x', 1 << 40)", kText},
        Hostile{"RepBetween", "(''):rep(1 << 62, 'ab')", kText},
        Hostile{"FindBacktracks", "string.find(('a'):rep(40), ('a-'):rep(40) .. 'b')", kWork},
        Hostile{"MatchBacktracks", "string.match(('a'):rep(3000), '.-.-.-.-.-.-x')", kWork},
        Hostile{"GsubBacktracks", "string.gsub(('a'):rep(30), ('a?'):rep(30) .. ('a'):rep(30) .. 'b', '')",
                kWork},
        Hostile{"GmatchBacktracks", "for _ in string.gmatch(('a'):rep(9999), '.*.*.*x') do end", kWork},
        Hostile{"FindPlain", "local s = ('a'):rep(1000000) for i = 1, 1e9 do s:find('b', 1, true) end",
                kWork},
        Hostile{"LongSet", "local p = '[' .. ('b'):rep(900000) .. ']' for i = 1, 1e9 do ('a'):find(p) end",
                kWork},
        Hostile{"Balance", "string.find(('('):rep(900000), '%b()')", kWork},
        Hostile{"GsubGrows", "local s = ('a'):rep(100000) s:gsub('a', s)", kText},
        Hostile{"ConcatGrows", "table.concat({('a'):rep(600000), ('a'):rep(600000)})", kText},
        Hostile{"ConcatOfNothing", "table.concat(setmetatable({}, {__index = type}), '', 1, math.maxinteger)",
                kText},
        Hostile{"ConcatenatedStrings", "local s = 'x' while true do s = s .. s end", kText},
        Hostile{"Move", "table.move({}, 1, math.maxinteger - 1, 2)", kWork},
        Hostile{"Insert", "table.insert(setmetatable({}, {__len = function() return 1 << 53 end}), 1, 0)",
                kWork},
        Hostile{"Remove", "table.remove(setmetatable({}, {__len = function() return 1 << 53 end}), 1)",
                kWork},
        Hostile{"SortOfNothing",
                "table.sort(setmetatable({}, {__len = function() return 1 << 30 end}), type)", kWork},
        Hostile{"Unpack", "for i = 1, 1e9 do select('#', table.unpack({}, 1, 500000)) end", kWork},
        Hostile{"Bytes", "local s = ('a'):rep(500000) for i = 1, 1e9 do s:byte(1, -1) end", kWork},
        Hostile{"PackedSizes", "local s = ('x'):rep(1000000) for i = 1, 1e9 do s.packsize(s) end", kWork},
        Hostile{"Format", "local s = ('x'):rep(400000) for i = 1, 1e9 do string.format('%s%s', s, s) end",
                kWork},
        Hostile{"Utf8Length", "local s = ('x'):rep(1000000) for i = 1, 1e9 do utf8.len(s) end", kWork},
        Hostile{"Keys", "local s = ('x'):rep(1000000) local t = {} for i = 1, 1e9 do t[s .. i] = 1 end",
                kMemory}),
    [](const auto& hostile) { return std::string(hostile.param.name); });

TEST(LuaLimits, MemoryBeyondTheLimitEndsTheProgramWithItsLine) {
  LuaSandbox lua(nullptr);
  try {
    lua.run("local t, s = {}, ('x'):rep(1000000)\nfor i = 1, 100 do\n t[i] = s .. i\n end", "hostile.lua");
    ADD_FAILURE();
  } catch (const std::runtime_error& error) {
    EXPECT_EQ(error.what(), std::string("hostile.lua:3: not enough memory: a program may use 64 MB"));
  }
}

TEST(LuaLimits, AProgramThatKeepsItsErrorDoesNotGoOn) {
  LuaSandbox lua(nullptr);
  EXPECT_THROW(lua.run("return pcall(string.rep, 'x', 1 << 40)", "hostile.lua"), std::runtime_error);
  EXPECT_TRUE(lua.exceeded());
}

TEST(LuaLimits, AFunctionWithThousandsOfVariableArgumentsEndsTheProgram) {
  LuaSandbox lua(nullptr);
  EXPECT_NO_THROW(
      lua.run("local function f(...) for i = 1, 9999 do end end f(table.unpack({}, 1, 1000))", "many.lua"));
  try {
    lua.run("local function f(...)\n return f(1, ...)\n end f()", "hostile.lua");
    ADD_FAILURE();
  } catch (const std::runtime_error& error) {
    EXPECT_EQ(error.what(), std::string("hostile.lua:2: a function may have 1000 variable arguments"));
  }
}

TEST(LuaLimits, HonestProgramsStayWithinTheirAllowance) {
  LuaSandbox lua(nullptr);
  EXPECT_NO_THROW(lua.run(
      "local lines = {} for i = 1, 2000 do lines[i] = string.format('%d %.3f %s', i, i / 7, 'part') end "
      "local text = table.concat(lines, '\\n') local n = 0 "
      "for word in text:gmatch('%a+') do n = n + 1 end assert(n == 2000) "
      "table.sort(lines) assert(#text:gsub('part', 'P') < #text)",
      "honest.lua"));
}

}  // namespace
}  // namespace takt::controller

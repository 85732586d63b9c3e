#pragma once
// What a program is compiled to: routines of instructions for a stack machine, so that a program can wait at any call and go
// on in a later cycle.
#include <map>
#include <memory>

#include "client_lib/gateway/urscript/functions.h"
#include "client_lib/gateway/urscript/syntax.h"

namespace takt::urscript {

struct Op {
  enum class Code : std::uint8_t {
    constant,     ///< pushes constants[a]
    no_value,     ///< pushes no value
    load_global,  ///< pushes it
    load_local,
    store_global,  ///< pops it
    store_local,
    make_list,  ///< of the a values on top
    make_pose,
    make_record,  ///< names: member_names[b]
    binary,       ///< operator a
    unary,
    jump,           ///< to a
    jump_if_false,  ///< pops
    keep_if_false,  ///< jumps where the top is False, else pops it
    keep_if_true,
    check_flag,  ///< the top is True or False
    part,        ///< paths[a]
    assign_part,
    method,         ///< texts[a] with b arguments
    mutate,         ///< the same, of a variable's part: paths[a]
    jump_if_given,  ///< local a has a value: to b
    call,           ///< routine a
    native,         ///< functions()[a], which has b parameters
    run,            ///< routine a as a thread; pushes its number
    join,
    kill,
    enter_critical,
    exit_critical,
    halt,
    give_back,  ///< return
    drop
  };
  Code code;
  int a = 0, b = 0;
  int line = 1, column = 1;
};

/// A part of a variable, or of the value below its indices.
struct Path {
  bool global = false;
  int slot = 0;
  std::vector<Step> steps{};
  std::size_t indices = 0;  ///< of all steps
  std::string method{};     ///< of mutate
  std::size_t arguments = 0;
};

struct Routine {
  std::string name{};
  bool is_thread = false;
  std::vector<std::string> parameters{};
  std::size_t required = 0;  ///< parameters without a default
  std::size_t locals = 0;    ///< with the parameters
  std::vector<Op> ops{};
  std::vector<Value> constants{};
  std::vector<std::string> texts{};
  std::vector<MemberNames> member_names{};
  std::vector<Path> paths{};
};
using RoutinePointer = std::shared_ptr<const Routine>;

/// Names of a program. Statements of interpreter mode add to them.
struct Symbols {
  static constexpr std::size_t kMostGlobals = 2000, kMostRoutines = 5000;
  std::map<std::string, int, std::less<>> globals{}, routine_names{};
  std::vector<RoutinePointer> routines{};
};

/// A call with constant arguments.
struct Call {
  std::string function;
  std::vector<Value> arguments{};
  std::map<std::string, Value> named{};
};

struct Code {
  Symbols symbols{};
  RoutinePointer main{};
  bool moves = false;  ///< it calls a function that moves the robot
  bool is_empty() const { return main == nullptr; }
};

/// All throw ScriptError.
Code compile(const Definition& program);
Code compile(const std::vector<Call>& calls);
/// Statements that are executed with a program's names, whose routine it does not keep.
RoutinePointer compile_statement(std::string_view text, Symbols& symbols);

}  // namespace takt::urscript

#pragma once
// The syntax tree of URScript.
#include <memory>
#include <optional>

#include "client_lib/gateway/urscript/operators.h"

namespace takt::urscript {

struct Expression {
  enum class Kind : std::uint8_t {
    constant,
    name,
    list,
    pose,
    unary,
    binary,
    logical_and,
    logical_or,
    call,    ///< name(operands)
    run,     ///< run name()
    index,   ///< operands[0][operands[1], ..]
    member,  ///< operands[0].name
    method   ///< operands[0].name(operands[1], ..)
  };
  Kind kind = Kind::constant;
  int line = 1, column = 1;
  Value constant{};
  std::string name{};
  Operator op = Operator::add;
  std::vector<Expression> operands{};
  std::vector<std::string> names{};  ///< of a call: one for each operand, empty where it goes by position
  int depth = 1;
};

struct Definition;

struct Statement {
  enum class Kind : std::uint8_t {
    expression,
    assignment,  ///< expressions[0] = expressions[1]
    branch,      ///< if: expressions[i] and blocks[i], then blocks.back() where there is one more
    loop,        ///< while
    loop_break,
    loop_continue,
    function_return,
    join,
    kill,
    halt,
    enter_critical,
    exit_critical,
    definition
  };
  enum class Scope : std::uint8_t { free, local, global };
  using Block = std::vector<Statement>;

  Kind kind = Kind::expression;
  int line = 1, column = 1;
  Scope scope = Scope::free;
  std::vector<Expression> expressions{};
  std::vector<Block> blocks{};
  std::shared_ptr<const Definition> definition{};
};

struct Parameter {
  std::string name;
  std::optional<Expression> otherwise{};
};

struct Definition {
  enum class Kind : std::uint8_t { function, thread, secondary };
  Kind kind = Kind::function;
  std::string name{};
  std::vector<Parameter> parameters{};
  Statement::Block body{};
  int line = 1, column = 1;
};

/// A program (def or sec) becomes its definition; other statements one without a name. Throws ScriptError.
Definition parse(std::string_view text);

}  // namespace takt::urscript

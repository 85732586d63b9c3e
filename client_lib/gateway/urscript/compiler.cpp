#include <algorithm>
#include <set>

#include "client_lib/gateway/urscript/code.h"

namespace takt::urscript {
namespace {

using Names = std::map<std::string, int, std::less<>>;

[[noreturn]] void fail(int line, int column, const std::string& text) {
  throw ScriptError(line, column, text);
}
[[noreturn]] void not_found(const Expression& at, const std::string& name) {
  fail(at.line, at.column, "compile_error_name_not_found:" + name + ":");
}

const Expression& base_of(const Expression& target) {
  const Expression* base = &target;
  while (base->kind == Expression::Kind::index || base->kind == Expression::Kind::member)
    base = &base->operands.front();
  return *base;
}

/// The older form of set_digital_out(N, VALUE).
bool is_digital_out(const Statement& statement) {
  const Expression& target = statement.expressions.front();
  return statement.kind == Statement::Kind::assignment && target.kind == Expression::Kind::index &&
         target.operands.front().kind == Expression::Kind::name &&
         target.operands.front().name == "digital_out";
}

/// Calls `visit` for each statement of a block and of the blocks in it, not of definitions in it.
template <class Visit>
void for_each(const Statement::Block& block, const Visit& visit) {
  for (const Statement& statement : block) {
    visit(statement);
    for (const Statement::Block& inner : statement.blocks) for_each(inner, visit);
  }
}

class Compiler {
 public:
  explicit Compiler(Symbols& symbols) : symbols_(symbols) { scopes_.push_back(symbols.routine_names); }

  RoutinePointer main(const Definition& program) {
    find_globals(program.body, true);
    const RoutinePointer routine = body(program, std::make_shared<Routine>(), true);
    symbols_.routine_names = root_names_;
    return routine;
  }
  bool moves() const { return moves_; }

 private:
  /// The routine that is being compiled.
  struct Current {
    Routine& routine;
    Names locals{};
    bool is_main = false;
    struct Loop {
      std::size_t begin;
      std::vector<std::size_t> breaks{};
    };
    std::vector<Loop> loops{};
  };

  // --- names ---

  void add_global(const std::string& name, const Statement& at) {
    if (symbols_.globals.size() >= Symbols::kMostGlobals)
      fail(at.line, at.column,
           "a program has at most " + std::to_string(Symbols::kMostGlobals) + " global variables");
    symbols_.globals.try_emplace(name, static_cast<int>(symbols_.globals.size()));
  }

  /// All variables of the first level, and those that functions declare as global.
  void find_globals(const Statement::Block& block, bool first_level) {
    for_each(block, [&](const Statement& statement) {
      if (statement.kind == Statement::Kind::definition) find_globals(statement.definition->body, false);
      if (statement.kind == Statement::Kind::assignment && !is_digital_out(statement) &&
          (first_level || statement.scope == Statement::Scope::global))
        add_global(base_of(statement.expressions.front()).name, statement);
    });
  }

  void declare(const Statement::Block& block) {
    for_each(block, [&](const Statement& statement) {
      if (statement.kind != Statement::Kind::definition) return;
      const Definition& definition = *statement.definition;
      if (symbols_.routines.size() >= Symbols::kMostRoutines)
        fail(definition.line, definition.column,
             "a program has at most " + std::to_string(Symbols::kMostRoutines) + " functions");
      auto routine = std::make_shared<Routine>();
      routine->name = definition.name;
      routine->is_thread = definition.kind == Definition::Kind::thread;
      for (const Parameter& parameter : definition.parameters) {
        routine->parameters.push_back(parameter.name);
        if (!parameter.otherwise) routine->required = routine->parameters.size();
      }
      scopes_.back()[definition.name] = static_cast<int>(symbols_.routines.size());
      pending_[&definition] = routine;
      symbols_.routines.push_back(routine);
    });
  }

  int routine_named(std::string_view name) const {
    for (auto scope = scopes_.rbegin(); scope != scopes_.rend(); ++scope)
      if (const auto found = scope->find(name); found != scope->end()) return found->second;
    return -1;
  }

  // --- routines ---

  RoutinePointer body(const Definition& definition, const std::shared_ptr<Routine>& routine, bool is_main) {
    if (!is_main) scopes_.emplace_back();
    declare(definition.body);
    if (is_main) root_names_ = scopes_.back();
    Current current{*routine};
    current.is_main = is_main;
    routine->name = definition.name;
    for (const Parameter& parameter : definition.parameters)
      if (!current.locals.try_emplace(parameter.name, static_cast<int>(current.locals.size())).second)
        fail(definition.line, definition.column, "syntax_error: two parameters " + parameter.name);
    if (!is_main) find_locals(definition.body, current.locals);
    routine->locals = current.locals.size();
    Current* outer = current_;
    current_ = &current;
    for (std::size_t i = 0; i < definition.parameters.size(); ++i) {
      const Parameter& parameter = definition.parameters[i];
      if (!parameter.otherwise) continue;
      const std::size_t given = emit(Op::Code::jump_if_given, *parameter.otherwise, static_cast<int>(i));
      value(*parameter.otherwise);
      emit(Op::Code::store_local, *parameter.otherwise, static_cast<int>(i));
      routine->ops[given].b = here();
    }
    block(definition.body);
    emit(Op::Code::no_value, definition);
    emit(Op::Code::give_back, definition);
    current_ = outer;
    if (!is_main) scopes_.pop_back();
    return routine;
  }

  void find_locals(const Statement::Block& block, Names& locals) const {
    for_each(block, [&](const Statement& statement) {
      if (statement.kind != Statement::Kind::assignment || is_digital_out(statement)) return;
      const std::string& name = base_of(statement.expressions.front()).name;
      const bool is_global = statement.scope == Statement::Scope::global ||
                             (statement.scope == Statement::Scope::free && symbols_.globals.count(name) > 0);
      if (!is_global) locals.try_emplace(name, static_cast<int>(locals.size()));
    });
  }

  // --- instructions ---

  template <class At>
  std::size_t emit(Op::Code code, const At& at, int a = 0, int b = 0) {
    current_->routine.ops.push_back({code, a, b, at.line, at.column});
    return current_->routine.ops.size() - 1;
  }
  int here() const { return static_cast<int>(current_->routine.ops.size()); }
  void land(std::size_t jump) { current_->routine.ops[jump].a = here(); }
  template <class List, class Item>
  static int added(List& list, Item item) {
    list.push_back(std::move(item));
    return static_cast<int>(list.size()) - 1;
  }

  void block(const Statement::Block& statements) {
    for (const Statement& one : statements) statement(one);
  }

  void statement(const Statement& s) {
    using Kind = Statement::Kind;
    switch (s.kind) {
      case Kind::expression:
        value(s.expressions[0]);
        emit(Op::Code::drop, s);
        break;
      case Kind::assignment:
        assignment(s);
        break;
      case Kind::branch:
        branch(s);
        break;
      case Kind::loop:
        loop(s);
        break;
      case Kind::loop_break:
      case Kind::loop_continue:
        if (current_->loops.empty())
          fail(s.line, s.column, "syntax_error: break and continue are allowed in a loop alone");
        if (s.kind == Kind::loop_continue)
          emit(Op::Code::jump, s, static_cast<int>(current_->loops.back().begin));
        else
          current_->loops.back().breaks.push_back(emit(Op::Code::jump, s));
        break;
      case Kind::function_return:
        if (s.expressions.empty())
          emit(Op::Code::no_value, s);
        else
          value(s.expressions[0]);
        emit(Op::Code::give_back, s);
        break;
      case Kind::join:
      case Kind::kill:
        value(s.expressions[0]);
        emit(s.kind == Kind::join ? Op::Code::join : Op::Code::kill, s);
        break;
      case Kind::halt:
        emit(Op::Code::halt, s);
        break;
      case Kind::enter_critical:
      case Kind::exit_critical:
        emit(s.kind == Kind::enter_critical ? Op::Code::enter_critical : Op::Code::exit_critical, s);
        break;
      case Kind::definition:
        body(*s.definition, pending_.at(s.definition.get()), false);
        break;
    }
  }

  void branch(const Statement& s) {
    std::vector<std::size_t> ends;
    for (std::size_t i = 0; i < s.expressions.size(); ++i) {
      value(s.expressions[i]);
      const std::size_t next = emit(Op::Code::jump_if_false, s.expressions[i]);
      block(s.blocks[i]);
      ends.push_back(emit(Op::Code::jump, s));
      land(next);
    }
    if (s.blocks.size() > s.expressions.size()) block(s.blocks.back());
    for (const std::size_t end : ends) land(end);
  }

  void loop(const Statement& s) {
    current_->loops.push_back({static_cast<std::size_t>(here())});
    value(s.expressions[0]);
    const std::size_t end = emit(Op::Code::jump_if_false, s.expressions[0]);
    block(s.blocks[0]);
    emit(Op::Code::jump, s, static_cast<int>(current_->loops.back().begin));
    land(end);
    for (const std::size_t out : current_->loops.back().breaks) land(out);
    current_->loops.pop_back();
  }

  void assignment(const Statement& s) {
    const Expression& target = s.expressions[0];
    if (is_digital_out(s)) {
      if (target.operands.size() != 2)
        fail(s.line, s.column, "syntax_error: allowed: digital_out[N] = True or False");
      value(target.operands[1]);
      value(s.expressions[1]);
      native(*find_function("set_digital_out"), target);
      emit(Op::Code::drop, s);
      return;
    }
    if (target.kind == Expression::Kind::name) {
      value(s.expressions[1]);
      const auto [global, slot] = variable(target);
      emit(global ? Op::Code::store_global : Op::Code::store_local, target, slot);
      return;
    }
    const int path = path_to(target);
    value(s.expressions[1]);
    emit(Op::Code::assign_part, target, path);
  }

  std::pair<bool, int> variable(const Expression& name) const {
    if (const auto local = current_->locals.find(name.name); local != current_->locals.end())
      return {false, local->second};
    const auto global = symbols_.globals.find(name.name);
    if (global == symbols_.globals.end()) not_found(name, name.name);
    return {true, global->second};
  }

  /// Pushes the indices of a part of a variable.
  int path_to(const Expression& target) {
    Path path;
    const auto [global, slot] = variable(base_of(target));
    path.global = global;
    path.slot = slot;
    steps(target, path);
    return added(current_->routine.paths, std::move(path));
  }
  void steps(const Expression& target, Path& path) {
    if (target.kind == Expression::Kind::name) return;
    steps(target.operands.front(), path);
    for (std::size_t i = 1; i < target.operands.size(); ++i) value(target.operands[i]);
    path.indices += target.operands.size() - 1;
    path.steps.push_back({target.operands.size() - 1, target.name});
  }

  void value(const Expression& e) {
    using Kind = Expression::Kind;
    switch (e.kind) {
      case Kind::constant:
        emit(Op::Code::constant, e, added(current_->routine.constants, e.constant));
        break;
      case Kind::name: {
        const auto [global, slot] = variable(e);
        emit(global ? Op::Code::load_global : Op::Code::load_local, e, slot,
             added(current_->routine.texts, e.name));
        break;
      }
      case Kind::list:
      case Kind::pose:
        operands(e, 0);
        emit(e.kind == Kind::list ? Op::Code::make_list : Op::Code::make_pose, e,
             static_cast<int>(e.operands.size()));
        break;
      case Kind::unary:
      case Kind::binary:
        operands(e, 0);
        emit(e.kind == Kind::unary ? Op::Code::unary : Op::Code::binary, e, static_cast<int>(e.op));
        break;
      case Kind::logical_and:
      case Kind::logical_or: {
        value(e.operands[0]);
        const std::size_t end =
            emit(e.kind == Kind::logical_and ? Op::Code::keep_if_false : Op::Code::keep_if_true, e);
        value(e.operands[1]);
        emit(Op::Code::check_flag, e);
        land(end);
        break;
      }
      case Kind::call:
        call(e);
        break;
      case Kind::run: {
        const int found = routine_named(e.name);
        if (found < 0 || !symbols_.routines[static_cast<std::size_t>(found)]->is_thread) not_found(e, e.name);
        if (symbols_.routines[static_cast<std::size_t>(found)]->required > 0)
          fail(e.line, e.column, "syntax_error: a thread has no parameters");
        emit(Op::Code::run, e, found);
        break;
      }
      case Kind::index:
      case Kind::member: {
        operands(e, 0);
        Path path;
        path.indices = e.operands.size() - 1;
        path.steps.push_back({path.indices, e.name});
        emit(Op::Code::part, e, added(current_->routine.paths, std::move(path)));
        break;
      }
      case Kind::method:
        method(e);
        break;
    }
  }

  void operands(const Expression& e, std::size_t first) {
    for (std::size_t i = first; i < e.operands.size(); ++i) value(e.operands[i]);
  }

  void method(const Expression& e) {
    if (!is_list_method(e.name)) {
      value(e.operands.front());
      emit(Op::Code::constant, e, added(current_->routine.constants, Value(e.name)));
      operands(e, 1);
      emit(Op::Code::native, e, static_cast<int>(find_function(kRemoteCall) - functions().data()),
           static_cast<int>(e.operands.size()) + 1);
      return;
    }
    if (!is_mutator(e.name)) {
      operands(e, 0);
      emit(Op::Code::method, e, added(current_->routine.texts, e.name),
           static_cast<int>(e.operands.size()) - 1);
      return;
    }
    if (base_of(e.operands.front()).kind != Expression::Kind::name)
      fail(e.line, e.column,
           "syntax_error: " + e.name + " changes a variable; a value without a name has none");
    const int path = path_to(e.operands.front());
    operands(e, 1);
    Path& mutated = current_->routine.paths[static_cast<std::size_t>(path)];
    mutated.method = e.name;
    mutated.arguments = e.operands.size() - 1;
    emit(Op::Code::mutate, e, path);
  }

  // --- calls ---

  void call(const Expression& e) {
    if (e.name == "struct") {
      const std::set<std::string_view> different(e.names.begin(), e.names.end());
      if (different.size() < e.names.size() || different.count("") > 0)
        fail(e.line, e.column, "struct: allowed: struct(NAME = VALUE, ..), each name once");
      operands(e, 0);
      const auto names = std::make_shared<const std::vector<std::string>>(e.names);
      emit(Op::Code::make_record, e, static_cast<int>(e.operands.size()),
           added(current_->routine.member_names, names));
      return;
    }
    if (const int found = routine_named(e.name); found >= 0) {
      const Routine& routine = *symbols_.routines[static_cast<std::size_t>(found)];
      if (routine.is_thread)
        fail(e.line, e.column, "syntax_error: " + e.name + " is a thread; run " + e.name + "() starts it");
      std::vector<std::string_view> names(routine.parameters.begin(), routine.parameters.end());
      arguments(e, names, routine.required);
      emit(Op::Code::call, e, found);
      return;
    }
    const Function* function = find_function(e.name);
    if (function == nullptr) not_found(e, e.name);
    if (function->kind == Function::Kind::refused)
      fail(e.line, e.column, e.name + " is not supported by takt: " + std::string(function->does));
    const Signature& signature = signature_of(*function);
    arguments(e, signature.names, signature.required);
    native(*function, e);
  }

  template <class At>
  void native(const Function& function, const At& at) {
    moves_ = moves_ || function.kind == Function::Kind::moves;
    emit(Op::Code::native, at, static_cast<int>(&function - functions().data()),
         static_cast<int>(signature_of(function).names.size()));
  }

  /// One value for each parameter.
  void arguments(const Expression& e, const std::vector<std::string_view>& names, std::size_t required) {
    std::vector<const Expression*> given(names.size(), nullptr);
    const auto allowed = [&] {
      std::string text = e.name + ": allowed: (";
      for (std::size_t i = 0; i < names.size(); ++i) text += (i == 0 ? "" : ", ") + std::string(names[i]);
      return text + "), " + std::to_string(required) + " of them needed";
    };
    for (std::size_t i = 0; i < e.operands.size(); ++i) {
      std::size_t at = i;
      if (!e.names[i].empty())
        at = static_cast<std::size_t>(std::find(names.begin(), names.end(), e.names[i]) - names.begin());
      if (at >= names.size() || given[at] != nullptr)
        fail(e.operands[i].line, e.operands[i].column, allowed());
      given[at] = &e.operands[i];
    }
    for (std::size_t i = 0; i < required; ++i)
      if (given[i] == nullptr) fail(e.line, e.column, allowed());
    for (const Expression* one : given) {
      if (one == nullptr)
        emit(Op::Code::no_value, e);
      else
        value(*one);
    }
  }

  Symbols& symbols_;
  std::vector<Names> scopes_{};
  Names root_names_{};
  std::map<const Definition*, std::shared_ptr<Routine>> pending_{};
  Current* current_ = nullptr;
  bool moves_ = false;
};

}  // namespace

Code compile(const Definition& program) {
  Code code;
  Compiler compiler(code.symbols);
  code.main = compiler.main(program);
  code.moves = compiler.moves();
  return code;
}

Code compile(const std::vector<Call>& calls) {
  Definition program;
  for (const Call& call : calls) {
    Expression expression;
    expression.kind = Expression::Kind::call;
    expression.name = call.function;
    const auto add = [&](const std::string& name, const Value& value) {
      Expression argument;
      argument.constant = value;
      expression.operands.push_back(std::move(argument));
      expression.names.push_back(name);
    };
    for (const Value& argument : call.arguments) add("", argument);
    for (const auto& [name, argument] : call.named) add(name, argument);
    Statement statement;
    statement.expressions.push_back(std::move(expression));
    program.body.push_back(std::move(statement));
  }
  return compile(program);
}

RoutinePointer compile_statement(std::string_view text, Symbols& symbols) {
  const Definition definition = parse(text);
  Symbols extended = symbols;
  RoutinePointer routine;
  if (definition.name.empty()) {
    routine = Compiler(extended).main(definition);
  } else {  // the definition of a function is a statement
    Definition outer;
    Statement statement;
    statement.kind = Statement::Kind::definition;
    statement.definition = std::make_shared<const Definition>(definition);
    outer.body.push_back(std::move(statement));
    routine = Compiler(extended).main(outer);
  }
  symbols = std::move(extended);
  return routine;
}

}  // namespace takt::urscript

#include "client_lib/gateway/urscript/interpreter.h"

#include <algorithm>

#include "client_lib/gateway/urscript/popup.h"

namespace takt::urscript {
namespace {

/// Instructions of a look ahead.
constexpr int kMostLookAhead = 2000;
/// An operator on lists of this many cells counts twice.
constexpr std::size_t kCellsPerWork = 2;
/// The same of cells times cells, for products of matrices.
constexpr std::size_t kProductsPerWork = 64;

Value pop(std::vector<Value>& stack) {
  Value top = std::move(stack.back());
  stack.pop_back();
  return top;
}

std::span<const Value> top_of(const std::vector<Value>& stack, std::size_t count) {
  return std::span<const Value>(stack).last(count);
}

void shorten(std::vector<Value>& stack, std::size_t count) {
  stack.resize(stack.size() - count);
}

/// A call of the controller does more than an instruction.
int work_of(Function::Kind kind) {
  constexpr int kSolves = 100, kActs = 100, kReports = 500, kOthers = 10;
  switch (kind) {
    case Function::Kind::computes:
      return 1;
    case Function::Kind::solves:
      return kSolves;
    case Function::Kind::acts:
    case Function::Kind::moves:
      return kActs;
    case Function::Kind::reports:
      return kReports;
    default:
      return kOthers;
  }
}

/// Of the values on the stack; what changes a variable counts it itself.
int work_of(const Op& op, const std::vector<Value>& stack) {
  using enum Op::Code;
  std::size_t work = 1;
  switch (op.code) {
    case binary: {
      const Value &a = stack[stack.size() - 2], &b = stack.back();
      work += (a.weight() + b.weight() - 2) / kCellsPerWork;
      const Items *left = a.list(), *right = b.list();
      if (static_cast<Operator>(op.a) == Operator::multiply && left != nullptr && right != nullptr &&
          !left->values.empty() && left->values.front().list() != nullptr)
        work += a.weight() * b.weight() / kProductsPerWork;
      break;
    }
    case make_list:
    case make_pose:
    case make_record:
      for (const Value& value : top_of(stack, static_cast<std::size_t>(op.a)))
        work += (1 + value.weight()) / kCellsPerWork;
      break;
    case native:
      work = static_cast<std::size_t>(work_of(functions()[static_cast<std::size_t>(op.a)].kind));
      for (const Value& value : top_of(stack, static_cast<std::size_t>(op.b))) work += value.weight();
      break;
    case unary:
      work += stack.back().weight();
      break;
    case method:
      work += stack[stack.size() - static_cast<std::size_t>(op.b) - 1].weight();
      break;
    default:
      break;
  }
  return static_cast<int>(work);
}

}  // namespace

Interpreter::Interpreter(Code code, Host& host) : code_(std::move(code)), host_(host) {
  globals_.resize(code_.symbols.globals.size());
  if (code_.main == nullptr) return;
  start(code_.main, {Op::Code::run}, kMostWork);
}

const Value* Interpreter::global(std::string_view name) const {
  const auto found = code_.symbols.globals.find(name);
  return found == code_.symbols.globals.end() ? nullptr
                                              : &globals_.at(static_cast<std::size_t>(found->second));
}

std::uint64_t Interpreter::start(const RoutinePointer& routine, const Op& op, int work) {
  if (static_cast<std::size_t>(std::count_if(threads_.begin(), threads_.end(),
                                             [](const auto& one) { return !one->ended; })) >= kMostThreads)
    throw ScriptError(op.line, op.column, "more than " + std::to_string(kMostThreads) + " threads run");
  auto thread = std::make_unique<Thread>();
  thread->number = next_thread_++;
  thread->work = work;
  push_frame(*thread, routine);
  threads_.push_back(std::move(thread));
  return threads_.back()->number;
}

void Interpreter::end(Thread& thread) {
  thread.ended = true;
  if (critical_ == thread.number) critical_.reset();
  host_.ended(thread.number);
}

bool Interpreter::is_alive(std::uint64_t number) const {
  return std::any_of(threads_.begin(), threads_.end(),
                     [&](const auto& one) { return one->number == number && !one->ended; });
}

bool Interpreter::advance() {
  if (threads_.empty() || halted_) return false;
  const int part = kMostWork / static_cast<int>(threads_.size());
  for (const auto& thread : threads_) {
    thread->work = part;
    thread->waits = false;
  }
  for (bool progresses = true; progresses;) {
    progresses = false;
    std::erase_if(threads_, [](const auto& thread) { return thread->ended; });
    for (std::size_t i = 0; i < threads_.size(); ++i) {  // a thread that is started comes to the end
      Thread& thread = *threads_[i];
      if (thread.ended || thread.waits || (critical_ && critical_ != thread.number)) continue;
      if (thread.joins && is_alive(*thread.joins)) continue;
      thread.joins.reset();
      progresses = true;
      run(thread);
      if (halted_ || threads_.front()->ended) {
        for (const auto& one : threads_)
          if (!one->ended) end(*one);
        threads_.clear();
        return false;
      }
    }
  }
  check_cells();
  return true;
}

void Interpreter::check_cells() const {
  std::size_t cells = 0;
  for (const Value& value : globals_) cells += value.weight();
  for (const auto& thread : threads_)
    for (const Value& value : thread->stack) cells += value.weight();
  if (cells <= kMostCells) return;
  const Frame& frame = threads_.front()->frames.back();
  const Op& op = frame.routine->ops[frame.op];
  throw ScriptError(
      op.line, op.column,
      "the variables hold more than " + std::to_string(kMostCells) + " cells (a number is one)");
}

std::size_t Interpreter::count_values() const {
  std::size_t count = 0;
  for (const auto& thread : threads_) count += thread->stack.size();
  return count;
}

void Interpreter::run(Thread& thread) {
  std::size_t others = count_values() - thread.stack.size();
  const std::size_t started = threads_.size();
  while (!thread.ended) {
    if (thread.work <= 0) {
      thread.waits = true;
      return;
    }
    const Frame& frame = thread.frames.back();
    const Op op = frame.routine->ops[frame.op];
    thread.work -= work_of(op, thread.stack);
    try {
      if (!execute(thread, op)) return;
    } catch (const ValueError& error) {
      throw ScriptError(op.line, op.column, error.what());
    }
    if (threads_.size() != started) others = count_values() - thread.stack.size();
    if (others + thread.stack.size() > kMostValues)
      throw ScriptError(
          op.line, op.column,
          "the functions and lists in work hold more than " + std::to_string(kMostValues) + " values");
  }
}

bool Interpreter::execute(Thread& thread, const Op& op) {
  if (op.code == Op::Code::native) {
    const Function& function = functions()[static_cast<std::size_t>(op.a)];
    if (function.kind != Function::Kind::computes) return native(thread, op);
  }
  return compute(thread, op, globals_) || control(thread, op);
}

// --- instructions that compute ---

void Interpreter::push_frame(Thread& thread, RoutinePointer routine) {
  if (thread.frames.size() >= kMostFrames)
    throw ValueError("functions call one another more than " + std::to_string(kMostFrames) + " deep");
  const std::size_t base = thread.stack.size() - routine->parameters.size();
  thread.stack.resize(base + routine->locals);
  thread.frames.push_back({std::move(routine), 0, base, false});
}

void Interpreter::leave_frame(Thread& thread) {
  Value result = pop(thread.stack);
  thread.stack.resize(thread.frames.back().base);
  thread.frames.pop_back();
  if (thread.frames.empty() || thread.frames.back().waits) return;  // a statement has no result
  thread.stack.push_back(std::move(result));
}

void Interpreter::finish_call(Thread& thread, std::size_t arguments, Value result) {
  shorten(thread.stack, arguments);
  thread.stack.push_back(std::move(result));
  Frame& frame = thread.frames.back();
  frame.waits = false;
  ++frame.op;
}

void Interpreter::combine(Thread& thread, const Op& op, const Routine& routine) const {
  using enum Op::Code;
  std::vector<Value>& stack = thread.stack;
  const auto count = static_cast<std::size_t>(op.a);
  if (op.code == binary) {
    const Value b = pop(stack), a = pop(stack);
    stack.push_back(apply(static_cast<Operator>(op.a), a, b));
  } else if (op.code == unary) {
    stack.push_back(apply(static_cast<Operator>(op.a), pop(stack)));
  } else if (op.code == part) {
    const Path& path = routine.paths[count];
    Value result =
        part_of(stack[stack.size() - path.indices - 1], path.steps.front(), top_of(stack, path.indices));
    shorten(stack, path.indices + 1);
    stack.push_back(std::move(result));
  } else if (op.code == method) {
    const auto arguments = static_cast<std::size_t>(op.b);
    MethodResult result =
        call_method(stack[stack.size() - arguments - 1], routine.texts[count], top_of(stack, arguments));
    shorten(stack, arguments + 1);
    stack.push_back(std::move(result.result));
  } else {
    const auto top = top_of(stack, count);
    std::vector<Value> values(top.begin(), top.end());
    shorten(stack, count);
    if (op.code == make_list) {
      stack.push_back(Value::list(std::move(values)));
    } else if (op.code == make_pose) {
      stack.push_back(Value::pose(std::move(values)));
    } else {
      stack.push_back(Value::record(std::move(values), routine.member_names[static_cast<std::size_t>(op.b)]));
    }
  }
}

void Interpreter::change_part(Thread& thread, const Op& op, std::vector<Value>& globals) const {
  std::vector<Value>& stack = thread.stack;
  const Frame& frame = thread.frames.back();
  const Path& path = frame.routine->paths[static_cast<std::size_t>(op.a)];
  const std::size_t slot =
      path.global ? static_cast<std::size_t>(path.slot) : frame.base + static_cast<std::size_t>(path.slot);
  const Value variable = path.global ? globals.at(slot) : stack.at(slot);
  if (variable.is_none()) throw ValueError("the variable has no value yet");
  thread.work -= static_cast<int>(variable.weight()) * (path.method.empty() ? 1 : 2);
  const std::size_t behind = path.method.empty() ? 1 : path.arguments;
  const std::span<const Value> top = top_of(stack, path.indices + behind), indices = top.first(path.indices);
  Value changed, result;
  if (path.method.empty()) {
    changed = with_part(variable, path.steps, indices, top.back());
  } else {
    Value list = variable;
    std::span<const Value> left = indices;
    for (const Step& step : path.steps) {
      list = part_of(list, step, left);
      left = left.subspan(step.indices);
    }
    MethodResult called = call_method(list, path.method, top.subspan(path.indices));
    changed = with_part(variable, path.steps, indices, called.list);
    result = std::move(called.result);
  }
  shorten(stack, path.indices + behind);
  (path.global ? globals.at(slot) : stack.at(slot)) = std::move(changed);
  if (!path.method.empty()) stack.push_back(std::move(result));
}

bool Interpreter::compute(Thread& thread, const Op& op, std::vector<Value>& globals) const {
  using enum Op::Code;
  Frame& frame = thread.frames.back();
  const Routine& routine = *frame.routine;
  std::vector<Value>& stack = thread.stack;
  const auto a = static_cast<std::size_t>(op.a);
  const auto loaded = [&](const Value& value) {
    if (value.is_none())
      throw ValueError(routine.texts[static_cast<std::size_t>(op.b)] + " has no value yet");
    stack.push_back(Value(value));
  };
  switch (op.code) {
    case constant:
      stack.push_back(routine.constants[a]);
      break;
    case no_value:
      stack.emplace_back();
      break;
    case load_global:
      loaded(globals.at(a));
      break;
    case load_local:
      loaded(stack[frame.base + a]);
      break;
    case store_global:
    case store_local:
      if (stack.back().is_none()) throw ValueError("the function has returned no value");
      (op.code == store_global ? globals.at(a) : stack[frame.base + a]) = Value(stack.back());
      stack.pop_back();
      break;
    case make_list:
    case make_pose:
    case make_record:
    case binary:
    case unary:
    case part:
    case method:
      combine(thread, op, routine);
      break;
    case jump:
      frame.op = a;
      return true;
    case jump_if_false:
      if (!truth_of(pop(stack))) {
        frame.op = a;
        return true;
      }
      break;
    case keep_if_false:
    case keep_if_true:
      if (truth_of(stack.back()) == (op.code == keep_if_true)) {
        frame.op = a;
        return true;
      }
      stack.pop_back();
      break;
    case check_flag:
      (void)truth_of(stack.back());
      break;
    case assign_part:
    case mutate:
      change_part(thread, op, globals);
      break;
    case jump_if_given:
      if (!stack[frame.base + a].is_none()) {
        frame.op = static_cast<std::size_t>(op.b);
        return true;
      }
      break;
    case call:
      ++frame.op;
      push_frame(thread, code_.symbols.routines[a]);
      return true;
    case native: {
      const Function& function = functions()[a];
      if (function.kind != Function::Kind::computes) return false;
      const auto count = static_cast<std::size_t>(op.b);
      Value result = urscript::compute(function, top_of(stack, count));
      thread.work -= static_cast<int>(result.weight());
      finish_call(thread, count, std::move(result));
      return true;
    }
    case give_back:
      if (thread.frames.size() == 1) return false;
      leave_frame(thread);
      return true;
    case drop:
      stack.pop_back();
      break;
    default:
      return false;
  }
  ++frame.op;
  return true;
}

// --- threads and the host ---

bool Interpreter::control(Thread& thread, const Op& op) {
  using enum Op::Code;
  ++thread.frames.back().op;
  switch (op.code) {
    case run: {
      const int work = std::min(thread.work, kMostWork / static_cast<int>(kMostThreads));
      thread.work -= work;
      thread.stack.push_back(Value::whole(
          static_cast<double>(start(code_.symbols.routines[static_cast<std::size_t>(op.a)], op, work))));
      return true;
    }
    case join:
    case kill: {
      const Value handle = pop(thread.stack);
      if (!handle.is_number())
        throw ValueError(std::string("type_error: a thread is expected, found ") + handle.type_name());
      // Programs write 0 where they have no thread.
      const auto found = std::find_if(threads_.begin(), threads_.end(), [&](const auto& one) {
        return one->number > 0 && static_cast<double>(one->number) == handle.number() && !one->ended;
      });
      if (found == threads_.end()) return true;
      if (op.code == kill)
        end(**found);
      else
        thread.joins = (*found)->number;
      return op.code == kill && !thread.ended;
    }
    case enter_critical:
      ++thread.critical;
      critical_ = thread.number;
      return true;
    case exit_critical:
      if (thread.critical == 0) throw ValueError("exit_critical: the thread is in no critical section");
      if (--thread.critical == 0) critical_.reset();
      return true;
    case halt:
      halted_ = true;
      return false;
    default:  // the last routine of the thread has ended
      end(thread);
      return false;
  }
}

bool Interpreter::native(Thread& thread, const Op& op) {
  const Function& function = functions()[static_cast<std::size_t>(op.a)];
  const auto count = static_cast<std::size_t>(op.b);
  const std::span<const Value> arguments = top_of(thread.stack, count);
  if (function.name == kRemoteCall && !is_rpc_handle(arguments[0]))
    throw ValueError(std::string("type_error: ") + arguments[0].type_name() + " has no method " +
                     text_of(arguments[1]));
  Frame& frame = thread.frames.back();
  Outcome outcome = host_.call(
      {function, arguments, thread.number, {frame.routine, frame.op}, op.line, op.column, !frame.waits});
  if (outcome.statement != nullptr) {
    frame.waits = true;
    globals_.resize(code_.symbols.globals.size());
    push_frame(thread, std::move(outcome.statement));
    return true;
  }
  if (outcome.waits) {
    frame.waits = thread.waits = true;
    return false;
  }
  finish_call(thread, count, std::move(outcome.value));
  return true;
}

// --- look ahead ---

std::optional<Interpreter::Foreseen> Interpreter::next_move(std::uint64_t number) const {
  const auto found =
      std::find_if(threads_.begin(), threads_.end(), [&](const auto& one) { return one->number == number; });
  if (found == threads_.end()) return std::nullopt;
  Thread thread = **found;
  Look ahead{globals_};
  ahead.globals.resize(code_.symbols.globals.size());
  thread.work = kMostLookAhead;
  const Op& present = thread.frames.back().routine->ops[thread.frames.back().op];
  finish_call(thread, static_cast<std::size_t>(present.b), {});
  try {
    while (thread.work > 0 && !ahead.found) {
      const Frame& frame = thread.frames.back();
      const Op op = frame.routine->ops[frame.op];
      thread.work -= work_of(op, thread.stack);
      if (!look(thread, op, ahead) || thread.stack.size() > kMostValues) break;
    }
  } catch (const ValueError&) {
    // The statement fails when it is its turn.
  }
  return std::move(ahead.found);
}

bool Interpreter::look(Thread& thread, const Op& op, Look& ahead) const {
  return compute(thread, op, ahead.globals) ||
         (op.code == Op::Code::native && look_at_native(thread, op, ahead));
}

bool Interpreter::look_at_native(Thread& thread, const Op& op, Look& ahead) const {
  const Function& function = functions()[static_cast<std::size_t>(op.a)];
  const auto count = static_cast<std::size_t>(op.b);
  const std::span<const Value> arguments = top_of(thread.stack, count);
  Frame& frame = thread.frames.back();
  switch (function.kind) {
    case Function::Kind::moves: {
      if (function.name == "interpreter_mode" && frame.waits) {
        RoutinePointer statement = host_.statement_ahead(ahead.statements++);
        if (statement == nullptr) return false;
        push_frame(thread, std::move(statement));
        return true;
      }
      ahead.found = Foreseen{
          &function, {arguments.begin(), arguments.end()}, {frame.routine, frame.op}, op.line, op.column};
      return false;
    }
    case Function::Kind::solves:
    case Function::Kind::reads: {
      std::optional<Value> value = host_.foresee(function, arguments);
      if (!value) return false;
      finish_call(thread, count, std::move(*value));
      return true;
    }
    case Function::Kind::sets:
    case Function::Kind::reports:
    case Function::Kind::ignored:
      if (is_blocking_popup(function, arguments)) return false;
      finish_call(thread, count, {});
      return true;
    default:
      return false;
  }
}

}  // namespace takt::urscript

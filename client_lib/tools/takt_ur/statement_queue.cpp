#include "client_lib/tools/takt_ur/statement_queue.h"

#include <algorithm>

namespace takt::ur {
namespace {

std::string reply(std::string_view kind, std::uint64_t number, std::string_view line) {
  return std::string(kind) + ": " + std::to_string(number) + ": " + std::string(line);
}

}  // namespace

std::string discarded(std::string_view line, std::string_view reason) {
  return "discard: " + std::string(reason) + ": " + std::string(line);
}

std::string StatementQueue::answer(std::string_view line, urscript::Symbols& symbols) {
  if (line == "statelastinterpreted") return reply("state", last_interpreted_, line);
  if (line == "statelastexecuted") return reply("state", last_executed_, line);
  if (line == "statelastcleared") return reply("state", last_cleared_, line);
  if (line == "stateunexecuted") return reply("state", waiting(), line);
  if (statements_.size() >= kMostStatements) return discarded(line, "too many statements wait");
  urscript::RoutinePointer routine;
  try {
    routine = urscript::compile_statement(line, symbols);
  } catch (const urscript::ScriptError& error) {
    return discarded(line, error.what());
  }
  const auto enters = [](const urscript::Op& op) {
    return op.code == urscript::Op::Code::native &&
           urscript::functions()[static_cast<std::size_t>(op.a)].name == "interpreter_mode";
  };
  if (std::any_of(routine->ops.begin(), routine->ops.end(), enters))
    return discarded(line, "the program is in interpreter mode");
  statements_.push_back({++last_interpreted_, std::move(routine)});
  return reply("ack", last_interpreted_, line);
}

urscript::RoutinePointer StatementQueue::begin() {
  last_executed_ = statements_.front().id;
  return statements_.front().routine;
}

urscript::RoutinePointer StatementQueue::ahead(std::size_t number) const {
  return number + 1 < statements_.size() ? statements_[number + 1].routine : nullptr;
}

std::size_t StatementQueue::waiting() const {
  const bool begun = !statements_.empty() && statements_.front().id == last_executed_;
  return statements_.size() - (begun ? 1 : 0);
}

void StatementQueue::skip() {
  const std::size_t kept = statements_.size() - waiting();
  statements_.erase(statements_.begin() + static_cast<std::ptrdiff_t>(kept), statements_.end());
}

void StatementQueue::clear_all() {
  statements_.clear();
  last_cleared_ = last_interpreted_;
}

}  // namespace takt::ur

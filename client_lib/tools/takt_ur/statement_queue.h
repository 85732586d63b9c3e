#pragma once
// Statements of URScript's interpreter mode: a program that calls interpreter_mode() executes what clients of the
// interpreter interface (TCP 30020) append to it, in order. Each line has one reply:
//
//   ack: 7: x = 2                                accepted as statement 7
//   discard: compile_error_name_not_found:f:: f()
//   state: 7: statelastexecuted                 the state commands
#include <cstdint>
#include <deque>
#include <string>
#include <string_view>

#include "client_lib/gateway/urscript/script.h"

namespace takt::ur {

/// The reply to a line that is not executed.
std::string discarded(std::string_view line, std::string_view reason);

class StatementQueue {
 public:
  /// Statements that wait; a client that sends more is answered with discard.
  static constexpr std::size_t kMostStatements = 10'000;

  /// Takes a statement of a program with these names, or answers a state command. `abort` and `skipbuffer` belong to the
  /// caller.
  std::string answer(std::string_view line, urscript::Symbols& symbols);
  bool is_empty() const { return statements_.empty(); }
  /// The first statement is executed from now on.
  urscript::RoutinePointer begin();
  /// The statement that follows the one that is executed by so many; nullptr: there is none.
  urscript::RoutinePointer ahead(std::size_t number) const;
  /// It has ended.
  void pop() { statements_.pop_front(); }
  /// Removes statements that have not begun.
  void skip();
  /// clear_interpreter() as the first statement: what was interpreted before it is forgotten.
  void clear() { last_cleared_ = statements_.front().id - 1; }
  /// All statements, at the entry to interpreter mode or at its end.
  void clear_all();

 private:
  struct Statement {
    std::uint64_t id;
    urscript::RoutinePointer routine;
  };
  std::size_t waiting() const;

  std::deque<Statement> statements_;
  std::uint64_t last_interpreted_ = 0, last_executed_ = 0, last_cleared_ = 0;
};

}  // namespace takt::ur

#pragma once
// Executes control requests between two steps: one function per request, in request_executor.cpp.
//
// What takes longer than a look (explain_part, get_entity_state) waits in a queue of which at most one is answered
// before a step, so that no client can hold up the simulation with queries.
#include <cstdint>
#include <deque>

#include "server/runtime/loop/loop_control.h"
#include "server/runtime/loop/request_inbox.h"

namespace takt {

class RequestExecutor {
 public:
  /// The control outlives it.
  explicit RequestExecutor(LoopControl& control) : control_(control) {}

  // The loop's thread; execute() of GetEntities any.

  void execute(const RequestInbox::Request& request);
  bool has_queries() const { return !queries_.empty(); }
  void answer_query();
  /// The loop has ended: refuses the request, or all queries that wait.
  void refuse(std::uint64_t id);
  void refuse_queries();

 private:
  struct Execution;
  struct Query {
    std::uint64_t id = 0;
    int component = -1;
    bool explains = false;  ///< explain_part; else get_entity_state
  };

  LoopControl& control_;
  std::deque<Query> queries_;
};

}  // namespace takt

#pragma once
// Executes control requests between two steps: one function per request, chosen by its type.
//
// Queries take longer than other requests: they wait in a queue of which at most one is answered per step, so
// that no client can stall the simulation with them.
#include <cstdint>
#include <deque>
#include <optional>
#include <string>
#include <utility>

#include "server/runtime/loop/loop_control.h"
#include "server/runtime/loop/request_inbox.h"

namespace takt {

class RequestExecutor {
 public:
  static constexpr std::size_t kMaxQueries = 64;

  /// The control outlives it.
  explicit RequestExecutor(LoopControl& control) : control_(control), loop_(control.context) {}

  // The loop's thread:

  void execute(std::uint64_t id, const requests::Any& request);
  bool has_queries() const { return !queries_.empty(); }
  void answer_query();
  /// The loop has ended: refuses the request, or all queries that wait.
  void refuse(std::uint64_t id);
  void refuse_queries();

 private:
  /// std::nullopt: the reply follows later.
  template <Request Type>
  using Answer = std::optional<Outcome<Type>>;

  template <typename Type>
  void execute_and_reply(std::uint64_t id, const Type& request);

  /// By apply() of bit_changes.h, whose event is the answer.
  template <Request Type>
  requires(request_info<Type>().changes == RequestChanges::bits) Outcome<Type> execute(const Type& request);
  Outcome<requests::GetState> execute(const requests::GetState& request);
  Outcome<requests::SetState> execute(const requests::SetState& request);
  Answer<requests::Step> execute(const requests::Step& request);
  Outcome<requests::Reset> execute(const requests::Reset& request);
  Outcome<requests::SetPace> execute(const requests::SetPace& request);
  Outcome<requests::RegisterController> execute(const requests::RegisterController& request);
  Outcome<requests::UnregisterController> execute(const requests::UnregisterController& request);
  Outcome<requests::WatchInstants> execute(const requests::WatchInstants& request);
  Outcome<requests::ExplainPart> execute(const requests::ExplainPart& request);
  Outcome<requests::GetEntityState> execute(const requests::GetEntityState& request);

  /// Emits the event, and returns its sentence.
  std::string report(const events::OfLoop& event);
  int component(const std::string& name) const { return loop_.cell().find_component(name); }
  Refusal faulted() const;

  LoopControl& control_;
  LoopContext& loop_;
  std::uint64_t executing_ = 0;  ///< id of the request
  std::deque<RequestInbox::Request> queries_;
};

}  // namespace takt

#pragma once
// Interface through which the core submits tasks. The runtime implements it with threads; the core does not
// depend on the implementation, so tasks share only data that they read.
#include <cstddef>
#include <cstdint>

namespace takt {

class Executor {
 public:
  /// One task: its number, and the `context` of the caller. Must not throw, allocate or wait.
  using Task = void (*)(std::size_t task, void* context);

  virtual ~Executor() = default;

  /// Called at the start of a stage of work that could be shared; `work` is an estimate in any unit. True:
  /// the caller passes the tasks to run(). False: the caller does the work itself, without dividing it. The
  /// answer may depend on anything, also on time: results do not depend on it.
  virtual bool begin(std::uint64_t work) = 0;
  /// Ends the stage, whichever way the work was done.
  virtual void end() = 0;

  /// Calls task(0, context) to task(count - 1, context), each once, in any order, possibly at the same time;
  /// returns after the last one, and their writes are visible to the caller. Runs must not overlap.
  virtual void run(std::size_t count, Task task, void* context) = 0;
};

}  // namespace takt

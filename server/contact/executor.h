#pragma once
// How the core hands work to threads without knowing any: it says what is to be done, somebody else who does
// it. The core must not depend on who that is, so tasks share nothing but what they only read.
#include <cstddef>
#include <cstdint>

namespace takt {

class Executor {
 public:
  /// One piece of work: its number, and whatever `context` the caller gave. Must not throw, allocate or wait.
  using Task = void (*)(std::size_t task, void* context);

  virtual ~Executor() = default;

  /// Asked before a stage of work that could be shared, `work` being an estimate of it in any unit. True:
  /// what there is to do will be given to run(). False: the caller does it in its own way, without preparing
  /// it for others. The answer may depend on anything, also on time: results do not depend on it.
  virtual bool begin(std::uint64_t work) = 0;
  /// The stage is over, however it was done.
  virtual void end() = 0;

  /// Calls task(0, context) to task(count - 1, context), each once, in any order, possibly at the same time;
  /// returns when all are done, and everything they wrote is visible to the caller. Only one run at a time.
  virtual void run(std::size_t count, Task task, void* context) = 0;
};

}  // namespace takt

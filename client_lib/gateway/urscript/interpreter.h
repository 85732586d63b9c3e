#pragma once
// Runs a compiled program in cycles. Deterministic: threads run in the order in which they were started, each until it waits,
// ends, or has used up its part of the cycle; what does not fit goes on in the next cycle.
//
//   Interpreter interpreter(code, host);
//   while (interpreter.advance()) {}   // once each cycle of 2 ms
#include <optional>

#include "client_lib/gateway/urscript/code.h"

namespace takt::urscript {

/// Where a call stands.
struct Place {
  RoutinePointer routine{};
  std::size_t op = 0;
  bool operator==(const Place&) const = default;
};

/// A call of a function that the robot's controller executes.
struct HostCall {
  const Function& function;
  std::span<const Value> arguments;  ///< one for each parameter, no value where it is left out
  std::uint64_t thread = 0;
  Place place{};
  int line = 1, column = 1;
  bool begins = true;  ///< else the call has waited
};

/// What becomes of it.
struct Outcome {
  bool waits = false;  ///< for the next cycle
  Value value{};
  RoutinePointer statement{};  ///< that is executed first; then the call goes on
};

class Host {
 public:
  virtual ~Host() = default;
  /// May throw ValueError and ScriptError.
  virtual Outcome call(const HostCall& call) = 0;
  /// The value of a function that solves or reads, before it is its turn; nothing where it may differ then.
  virtual std::optional<Value> foresee(const Function& function, std::span<const Value> arguments) = 0;
  /// A statement of interpreter mode behind the present one; 0 is the next. nullptr: there is none.
  virtual RoutinePointer statement_ahead(std::size_t number) = 0;
  virtual void ended(std::uint64_t thread) = 0;
};

class Interpreter {
 public:
  /// Instructions of all threads in a cycle; one that handles long values counts for several.
  static constexpr int kMostWork = 10'000;
  static constexpr std::size_t kMostThreads = 50, kMostFrames = 200, kMostValues = 4096;
  /// Of all variables and values in work, at the end of a cycle.
  static constexpr std::size_t kMostCells = 1'000'000;

  /// The host outlives it.
  Interpreter(Code code, Host& host);
  /// One cycle. False when the program has ended. Throws ScriptError, which ends it.
  bool advance();
  /// For statements of interpreter mode.
  Symbols& symbols() { return code_.symbols; }

  /// The next call of a function that moves the robot, behind the call that a thread executes; nothing where a function
  /// comes first that may not stand between two moves.
  struct Foreseen {
    const Function* function = nullptr;
    std::vector<Value> arguments{};
    Place place{};
    int line = 1, column = 1;
  };
  std::optional<Foreseen> next_move(std::uint64_t thread) const;
  const Value* global(std::string_view name) const;

 private:
  struct Frame {
    RoutinePointer routine;
    std::size_t op = 0, base = 0;
    bool waits = false;  ///< in a call of the host
  };
  struct Thread {
    std::uint64_t number = 0;
    std::vector<Frame> frames{};
    std::vector<Value> stack{};
    std::optional<std::uint64_t> joins{};
    int critical = 0;
    int work = 0;        ///< left in this cycle
    bool waits = false;  ///< for the next cycle
    bool ended = false;
  };
  /// Copies that a look ahead changes.
  struct Look {
    std::vector<Value> globals;
    std::size_t statements = 0;
    std::optional<Foreseen> found{};
  };

  void run(Thread& thread);
  /// False where the thread stops for now.
  bool execute(Thread& thread, const Op& op);
  bool control(Thread& thread, const Op& op);
  bool native(Thread& thread, const Op& op);
  /// False where the look ahead ends.
  bool look(Thread& thread, const Op& op, Look& look) const;
  bool look_at_native(Thread& thread, const Op& op, Look& look) const;
  /// Instructions that neither end, start nor ask anything; false for others.
  bool compute(Thread& thread, const Op& op, std::vector<Value>& globals) const;
  void combine(Thread& thread, const Op& op, const Routine& routine) const;
  void change_part(Thread& thread, const Op& op, std::vector<Value>& globals) const;
  static void push_frame(Thread& thread, RoutinePointer routine);
  static void leave_frame(Thread& thread);
  static void finish_call(Thread& thread, std::size_t arguments, Value result);
  /// Its number, from 0 on: the program itself has 0.
  std::uint64_t start(const RoutinePointer& routine, const Op& op, int work);
  void end(Thread& thread);
  bool is_alive(std::uint64_t number) const;
  std::size_t count_values() const;
  void check_cells() const;

  Code code_;
  Host& host_;
  std::vector<Value> globals_;
  std::vector<std::unique_ptr<Thread>> threads_;
  std::uint64_t next_thread_ = 0;
  std::optional<std::uint64_t> critical_;  ///< the thread that is in its critical section
  bool halted_ = false;
};

}  // namespace takt::urscript

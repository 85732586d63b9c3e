#pragma once
// Counts forbidden actions of a step loop in steady state: allocations, locks, system calls and page faults,
// while counting is on in that thread. Linked into the tests of the step loop, where
// the functions counted are replaced for the whole program (tests/support/step_path_counts.cpp).
#include <array>
#include <cstdint>
#include <string>

namespace takt::test {

inline thread_local bool counting = false;
inline thread_local std::uint64_t allocations = 0;  ///< by operator new, while counting
inline thread_local std::uint64_t locks = 0;        ///< taken of mutexes and read-write locks, while counting

/// System calls of the calling thread, by their number: the kernel hands each of them to a signal handler
/// (PR_SET_SYSCALL_USER_DISPATCH, Linux 5.11, x86-64), which executes it. One object at a time, and begin()
/// and end() in the same thread.
class SystemCallCount {
 public:
  /// Whether this machine can.
  static bool possible();
  void begin();
  void end();
  /// Of futex those apart that wake another thread: they never wait.
  std::uint64_t wakes() const;
  /// All others.
  std::uint64_t others() const;
  /// "number times" of each of the others.
  std::string listed() const;
};

struct ThreadUsage {
  std::int64_t page_faults = 0;  ///< with and without a disk
  std::int64_t waits = 0;        ///< voluntary switches to another thread
};
/// Of the calling thread since it began.
ThreadUsage thread_usage();

}  // namespace takt::test

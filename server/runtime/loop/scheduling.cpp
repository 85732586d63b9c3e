#include "server/runtime/loop/scheduling.h"

#include <pthread.h>
#include <sched.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

namespace takt {
namespace {

std::string lock_memory() {
  // With a limit on locked memory, locking future memory would make later allocations fail: then nothing is
  // locked.
  rlimit limit{};
  if (geteuid() != 0 && (getrlimit(RLIMIT_MEMLOCK, &limit) != 0 || limit.rlim_cur != RLIM_INFINITY)) {
    return "memory not locked (limit memlock)";
  }
  if (mlockall(MCL_CURRENT | MCL_FUTURE) == 0) return "memory locked";
  return std::string("memory not locked (") + std::strerror(errno) + ")";
}

}  // namespace

std::string obtain_scheduling(int realtime_priority) {
  if (realtime_priority <= 0) return "SCHED_OTHER, memory not locked (real-time priority not asked for)";
  sched_param parameters{};
  parameters.sched_priority = realtime_priority;
  const int refused = pthread_setschedparam(pthread_self(), SCHED_FIFO, &parameters);
  const std::string scheduling =
      refused == 0 ? "SCHED_FIFO priority " + std::to_string(realtime_priority)
                   : std::string("SCHED_OTHER (SCHED_FIFO refused: ") + std::strerror(refused) + ")";
  return scheduling + ", " + lock_memory();
}

}  // namespace takt

#include "idl/transport/fastdds/thread_room.h"

#include <pthread.h>
#include <sys/mman.h>

#include <cstddef>

namespace takt {

std::string lack_of_thread_room() {
  constexpr std::size_t kThreads = 12;  // receivers of each port and way, timers, writers, shared memory
  std::size_t stack_bytes = 8U << 20U;
  pthread_attr_t defaults;
  if (pthread_getattr_default_np(&defaults) == 0) {
    (void)pthread_attr_getstacksize(&defaults, &stack_bytes);
    (void)pthread_attr_destroy(&defaults);
  }
  // glibc maps so much to align a heap of the threads, and keeps half.
  constexpr std::size_t kHeap_bytes = 128U << 20U;
  const std::size_t bytes = kThreads * stack_bytes + kHeap_bytes;
  void* room = mmap(nullptr, bytes, PROT_NONE, MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
  if (room == MAP_FAILED)
    return "The threads of DDS need " + std::to_string(bytes >> 20U) +
           " MB of address space, and the limit of this process leaves less; raise it (ulimit -v), or set "
           "shorter stacks (ulimit -s).";
  (void)munmap(room, bytes);
  return {};
}

}  // namespace takt

#pragma once
// Processor time, because other programs may share the machine.
#include <time.h>

namespace takt::bench {

/// Of all threads of this program (s).
inline double processor_s() {
  timespec now{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

}  // namespace takt::bench

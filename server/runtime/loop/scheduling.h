#pragma once
// Asks the operating system for what soft real time needs, and says plainly what was obtained.
#include <string>

namespace takt {

/// For the calling thread. Priority 0 asks for nothing; 1 to 99 asks for SCHED_FIFO with that priority and
/// for the process' memory to be locked. What is refused is left as it was: the service runs either way.
std::string obtain_scheduling(int realtime_priority);

}  // namespace takt

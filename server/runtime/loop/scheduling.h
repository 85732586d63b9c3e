#pragma once
// Requests soft real-time scheduling from the operating system, and reports the result.
#include <string>

namespace takt {

/// For the calling thread. Priority 0 requests nothing; 1 to 99 requests SCHED_FIFO with that priority and
/// locked memory of the process. A refused request changes nothing: the service runs in any case. Returns a
/// sentence with the result.
std::string obtain_scheduling(int realtime_priority);

}  // namespace takt

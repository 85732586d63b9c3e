#pragma once
// Room for threads. Fast DDS 2.9.1 ends the process with std::terminate when one of its threads cannot be made.
#include <string>

namespace takt {

/// A sentence if the limit on the address space of this process leaves no room for the stacks of a participant's threads,
/// else nothing.
std::string lack_of_thread_room();

}  // namespace takt

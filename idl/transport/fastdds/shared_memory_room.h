#pragma once
// Room in shared memory for a profile that asks for it. Fast DDS makes its segment as a sparse file: the first write to a
// page for which a full /dev/shm has no room ends the process with SIGBUS, at its start or hours later.
#include <filesystem>

namespace takt {

/// Gives all pages to the files of Fast DDS that this process has mapped. False if there is no room for one of them.
bool reserve_shared_memory(const std::filesystem::path& directory = "/dev/shm");

}  // namespace takt

#pragma once
// Shared memory of killed processes: Fast DDS removes a participant's segment (half a megabyte) and ports at
// its end, but those of a killed process stay. The owner of a file holds a lock on the file NAME_el beside
// it, which the system releases with the process; a free lock marks a stale file.
#include <cstddef>
#include <filesystem>

namespace takt {

/// Removes from `directory` segments and ports of Fast DDS without owner, and ports without a lock that no process has
/// mapped, that were not touched for
/// `older_than_s` (so that files under construction are safe). Returns the number of files. Never throws;
/// files that must not be removed stay.
std::size_t remove_stale_shared_memory(const std::filesystem::path& directory = "/dev/shm",
                                       double older_than_s = 10.0);

}  // namespace takt

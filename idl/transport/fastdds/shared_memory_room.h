#pragma once
// Room in shared memory. Fast DDS makes its segment as a sparse file: the first write to a page for which a full /dev/shm
// has no room ends the process with SIGBUS, at its start or hours later.
#include <cstddef>
#include <filesystem>

namespace takt {

/// Whether so many bytes are free, beside some for the ports. True where the directory does not exist: Fast DDS says so.
bool shared_memory_has_room(std::size_t bytes, const std::filesystem::path& directory = "/dev/shm");

/// Gives all pages to the files of Fast DDS that this process has mapped. False if there is no room for one of them.
bool reserve_shared_memory(const std::filesystem::path& directory = "/dev/shm");

}  // namespace takt

#pragma once
// What killed processes leave in shared memory: Fast DDS removes a participant's segment (half a megabyte)
// and ports when it ends, and nobody removes those of one that was killed. Who owns a file holds a lock on
// the file NAME_el beside it, which the system takes back when the process is gone; that tells which are
// left.
#include <cstddef>
#include <filesystem>

namespace takt {

/// Removes from `directory` segments and ports of Fast DDS whose owner is gone and that nobody has touched
/// for `older_than_s` (so that none that is just being made is taken for one). Returns how many files. Never
/// throws; what may not be removed stays.
std::size_t remove_shared_memory_remains(const std::filesystem::path& directory = "/dev/shm",
                                         double older_than_s = 10.0);

}  // namespace takt

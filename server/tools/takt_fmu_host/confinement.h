#pragma once
// What the process of an FMU may not do. Limits that the system cannot set are left out: an FMU is code of the user's choice
// (--allow-fmus), and these limits are for accidents and for what few attackers expect, not a prison.
#include <cstdint>
#include <string>

namespace takt::fmu_host {

/// For this thread and all that it starts: no new privileges or capabilities, no core dumps, at most 256 open files of 1 GiB each,
/// no sockets but local ones, no processes, no signals to others, no writing outside of `writable` (where the system has
/// Landlock). Empty, or a sentence (without its subject) on what the kernel refuses.
std::string confine(const std::string& writable);
/// Address space (RLIMIT_AS).
void limit_memory(std::uint64_t bytes);

}  // namespace takt::fmu_host

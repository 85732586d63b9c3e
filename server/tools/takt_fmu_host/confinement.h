#pragma once
// What the process of an FMU may not do. Limits that the system cannot set are left out: an FMU is code of the user's choice
// (--allow-fmus), and these limits are for accidents and for what few attackers expect, not a prison.
#include <cstdint>
#include <string>

namespace takt::fmu_host {

/// For this process and all that it starts: no new privileges, no core dumps, at most 256 open files, no sockets but local ones,
/// no writing outside of `writable` (where the system has Landlock).
void confine(const std::string& writable);
/// Address space (RLIMIT_AS).
void limit_memory(std::uint64_t bytes);

}  // namespace takt::fmu_host

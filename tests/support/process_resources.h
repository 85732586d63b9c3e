#pragma once
// Present resources of this process.
#include <malloc.h>

#include <cstddef>
#include <filesystem>

namespace takt::test {

struct ProcessResources {
  std::size_t threads = 0, file_descriptors = 0;
  double allocated_bytes = 0.0;  ///< by malloc, of all threads
};

inline ProcessResources process_resources() {
  const auto entries = [](const char* directory) {
    std::size_t count = 0;
    for (const auto& entry : std::filesystem::directory_iterator(directory))
      count += entry.exists() ? 1U : 0U;
    return count;
  };
  const struct mallinfo2 heap = mallinfo2();
  return {entries("/proc/self/task"), entries("/proc/self/fd"),
          static_cast<double>(heap.uordblks) + static_cast<double>(heap.hblkhd)};
}

}  // namespace takt::test

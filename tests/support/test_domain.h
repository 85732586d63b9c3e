#pragma once
// A DDS domain and a cell name that no other process of these tests uses at the same time: tests run side by side.
#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <cstdint>
#include <filesystem>
#include <stdexcept>
#include <string>

namespace takt::test {

/// 215 to 231, whose ports lie above those that Linux gives to sockets of other programs (32768 to 60999); one of them is
/// taken by the lock of a file until this process ends. Programs that it starts do not hold it.
inline std::uint32_t test_domain() {
  static const std::uint32_t taken = [] {
    constexpr std::uint32_t first = 215, count = 17;
    for (std::uint32_t i = 0; i < count; ++i) {
      const std::uint32_t domain = first + (static_cast<std::uint32_t>(getpid()) + i) % count;
      const auto file =
          std::filesystem::temp_directory_path() / ("takt_test_domain_" + std::to_string(domain));
      const int handle = open(file.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666);
      if (handle < 0) continue;
      if (flock(handle, LOCK_EX | LOCK_NB) == 0) return domain;
      close(handle);
    }
    throw std::runtime_error("All DDS domains of tests (215 to 231) are in use.");
  }();
  return taken;
}

inline std::string test_cell() {
  return "cell_" + std::to_string(getpid());
}

}  // namespace takt::test

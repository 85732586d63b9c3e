#pragma once
// Output of the soaks: lines with a figure, its goal if there is one, and the number of missed goals; and the
// resources of the server's process.
#include <unistd.h>

#include <cinttypes>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <string>

namespace takt::test {

struct Resources {
  double resident_MB = 0.0;
  std::size_t descriptors = 0, shared_memory_files = 0;
};
inline Resources resources(int pid) {
  const std::string process = "/proc/" + std::to_string(pid);
  std::ifstream file(process + "/statm");
  std::uint64_t total = 0, resident = 0;
  file >> total >> resident;
  const auto count = [](const std::string& directory) {
    std::error_code error;
    return static_cast<std::size_t>(std::distance(std::filesystem::directory_iterator(directory, error),
                                                  std::filesystem::directory_iterator()));
  };
  return {static_cast<double>(resident) * static_cast<double>(sysconf(_SC_PAGESIZE)) / 1e6,
          count(process + "/fd"), count("/dev/shm")};
}

class Report {
 public:
  void line(const char* what, double value, const char* unit, double limit = 0.0) {
    const bool good = limit <= 0.0 || value <= limit;
    if (!good) ++missed_;
    if (limit > 0.0) {
      std::printf("%-52s %12.4g %-4s (goal %g%s)\n", what, value, unit, limit, good ? "" : ", MISSED");
    } else {
      std::printf("%-52s %12.4g %s\n", what, value, unit);
    }
  }
  void must_be_zero(const char* what, std::uint64_t value) {
    if (value != 0) ++missed_;
    std::printf("%-52s %12" PRIu64 "      (goal 0%s)\n", what, value, value == 0 ? "" : ", MISSED");
  }
  int missed() const { return missed_; }

 private:
  int missed_ = 0;
};

/// The resources of the server at the end, compared with the beginning.
inline void report_growth(Report& report, const Resources& first, const Resources& last) {
  const auto more = [](std::size_t now, std::size_t then) {
    return static_cast<double>(now) - static_cast<double>(then);
  };
  report.line("server's memory at the beginning", first.resident_MB, "MB");
  report.line("server's memory, growth", 100.0 * (last.resident_MB / first.resident_MB - 1.0), "%");
  report.line("server's file descriptors, more than then", more(last.descriptors, first.descriptors), "");
  report.line("shared memory files, more than then",
              more(last.shared_memory_files, first.shared_memory_files), "");
}

}  // namespace takt::test

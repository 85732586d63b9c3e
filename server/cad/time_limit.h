#pragma once
// A limit of this process's own time on the processor.
#include <string>

#include <sys/resource.h>
#include <csignal>

namespace takt::cad {

/// While it exists, the process ends after `cpu_limit_s` more of its own time on the processor (whole seconds, at least 1),
/// with the sentence on standard error and exit code 2: a library that does not return cannot be left in another way. One
/// at a time, in a process without threads.
class TimeLimit {
 public:
  TimeLimit(const std::string& sentence, int cpu_limit_s);
  ~TimeLimit();
  TimeLimit(const TimeLimit&) = delete;
  TimeLimit& operator=(const TimeLimit&) = delete;

 private:
  rlimit before_{};
  struct sigaction action_before_ {};
};

}  // namespace takt::cad

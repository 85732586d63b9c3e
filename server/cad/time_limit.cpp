#include "server/cad/time_limit.h"

#include <unistd.h>

#include <algorithm>

namespace takt::cad {

namespace {

constexpr int kEnded = 2;

std::string& ending() {  // a signal handler has no argument
  static std::string sentence;
  return sentence;
}

void end_process(int /*signal*/) {
  const std::string& sentence = ending();
  const ssize_t written = ::write(STDERR_FILENO, sentence.data(), sentence.size());
  ::_exit(written < 0 ? kEnded + 1 : kEnded);
}

rlim_t used_s() {
  rusage usage{};
  ::getrusage(RUSAGE_SELF, &usage);
  return static_cast<rlim_t>(usage.ru_utime.tv_sec + usage.ru_stime.tv_sec + 1);
}

}  // namespace

TimeLimit::TimeLimit(const std::string& sentence, int cpu_limit_s) {
  ending() = sentence + "\n";
  struct sigaction action {};
  action.sa_handler = end_process;
  ::sigaction(SIGXCPU, &action, &action_before_);
  ::getrlimit(RLIMIT_CPU, &before_);
  rlimit limit = before_;  // RLIM_INFINITY is the largest number
  limit.rlim_cur = std::min(before_.rlim_cur, used_s() + static_cast<rlim_t>(cpu_limit_s));
  ::setrlimit(RLIMIT_CPU, &limit);
}

TimeLimit::~TimeLimit() {
  ::setrlimit(RLIMIT_CPU, &before_);
  ::sigaction(SIGXCPU, &action_before_, nullptr);
}

}  // namespace takt::cad

#include "server/cad/child_process.h"

#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <csignal>
#include <cstddef>
#include <cstring>
#include <exception>

namespace takt::cad {

namespace {

constexpr char kWhole = 'w';  ///< the last byte of a whole result
constexpr int kFailed = 3;

[[noreturn]] void be_child(int pipe, const std::function<std::string()>& work, int cpu_limit_s) {
  for (const int signal : {SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT, SIGXCPU}) std::signal(signal, SIG_DFL);
  const auto seconds = static_cast<rlim_t>(cpu_limit_s);
  const rlimit time{seconds, seconds + 1}, no_core{0, 0};
  ::setrlimit(RLIMIT_CPU, &time);
  ::setrlimit(RLIMIT_CORE, &no_core);
  std::string bytes;
  try {
    bytes = work() + kWhole;
  } catch (const std::exception&) {
    ::_exit(kFailed);
  }
  for (std::size_t at = 0; at < bytes.size();) {
    const ssize_t written = ::write(pipe, bytes.data() + at, bytes.size() - at);
    if (written < 0 && errno != EINTR) ::_exit(kFailed);
    at += written > 0 ? static_cast<std::size_t>(written) : 0;
  }
  ::_exit(0);
}

}  // namespace

ChildResult run_in_child(const std::function<std::string()>& work, int cpu_limit_s) {
  std::array<int, 2> ends{};
  if (::pipe(ends.data()) != 0) return {"", std::string("no pipe: ") + std::strerror(errno)};
  const pid_t child = ::fork();
  if (child < 0) {
    ::close(ends[0]), ::close(ends[1]);
    return {"", std::string("no process: ") + std::strerror(errno)};
  }
  if (child == 0) {
    ::close(ends[0]);
    be_child(ends[1], work, cpu_limit_s);
  }
  ::close(ends[1]);
  ChildResult result;
  std::array<char, 65536> part{};
  while (true) {
    const ssize_t count = ::read(ends[0], part.data(), part.size());
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) break;
    result.bytes.append(part.data(), static_cast<std::size_t>(count));
  }
  ::close(ends[0]);
  int status = 0;
  while (::waitpid(child, &status, 0) < 0 && errno == EINTR) continue;
  if (WIFEXITED(status) && WEXITSTATUS(status) == 0 && !result.bytes.empty() &&
      result.bytes.back() == kWhole) {
    result.bytes.pop_back();
    return result;
  }
  result.bytes.clear();
  if (WIFSIGNALED(status) && (WTERMSIG(status) == SIGXCPU || WTERMSIG(status) == SIGKILL))
    result.problem = "it takes more than " + std::to_string(cpu_limit_s) + " s of computing";
  else if (WIFSIGNALED(status))
    result.problem = std::string("it crashes: ") + ::strsignal(WTERMSIG(status));
  else
    result.problem = "it fails";
  return result;
}

}  // namespace takt::cad

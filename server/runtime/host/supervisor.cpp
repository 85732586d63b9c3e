#include "server/runtime/host/supervisor.h"

#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <deque>

#include "server/runtime/monotonic_clock.h"

namespace takt {
namespace {

pid_t start(const std::function<int(const std::string& crash)>& serve, const std::string& crash,
            const sigset_t& mask_of_child) {
  std::fflush(nullptr);  // else both processes would write the buffered output
  const pid_t parent = ::getpid();
  const pid_t child = ::fork();
  if (child != 0) return child;
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (::getppid() != parent) ::_exit(kCrashed);  // the parent died earlier
  ::pthread_sigmask(SIG_SETMASK, &mask_of_child, nullptr);
  std::exit(serve(crash));
}

/// How the child ended; empty: not by a crash.
std::string crash_of(int status) {
  if (WIFSIGNALED(status)) {
    const int number = WTERMSIG(status);
    return "was killed by signal " + std::to_string(number) + " (" + ::strsignal(number) + ")";
  }
  return WEXITSTATUS(status) == kCrashed ? "ended with exit code " + std::to_string(kCrashed) : "";
}

}  // namespace

std::vector<int> ending_signals() {
  std::vector<int> signals{SIGINT, SIGTERM};
  struct sigaction hang_up {};
  if (::sigaction(SIGHUP, nullptr, &hang_up) == 0 && hang_up.sa_handler != SIG_IGN) signals.push_back(SIGHUP);
  return signals;
}

int supervise(const std::function<int(const std::string& crash)>& serve, const SupervisorOptions& options) {
  const auto note = [&](const std::string& sentence) {
    if (options.on_note) options.on_note(sentence);
  };
  sigset_t waited, before;
  ::sigemptyset(&waited);
  for (const int number : ending_signals()) ::sigaddset(&waited, number);
  ::sigaddset(&waited, SIGCHLD);
  ::pthread_sigmask(SIG_BLOCK, &waited, &before);

  std::deque<std::int64_t> crashes_ns;
  std::string crash;
  for (;;) {
    const pid_t child = start(serve, crash, before);
    if (child < 0) {
      note(std::string("no process can be started: ") + std::strerror(errno));
      return kCrashed;
    }
    note("the server is process " + std::to_string(child));
    bool ending = false;
    int status = 0;
    pid_t ended = 0;
    while ((ended = ::waitpid(child, &status, WNOHANG)) == 0) {
      int number = 0;
      ::sigwait(&waited, &number);
      if (number == SIGCHLD) continue;
      ending = true;
      ::kill(child, SIGTERM);
    }
    if (ended < 0) return kCrashed;
    crash = crash_of(status);
    if (ending || crash.empty()) return WIFEXITED(status) ? WEXITSTATUS(status) : kCrashed;
    const std::int64_t now = monotonic_now_ns();
    crashes_ns.push_back(now);
    while (static_cast<double>(now - crashes_ns.front()) > options.within_s * 1e9) crashes_ns.pop_front();
    if (static_cast<int>(crashes_ns.size()) >= options.most_crashes) {
      note("the server " + crash + ", for the " + std::to_string(options.most_crashes) +
           "th time within a short while; it is not started again");
      return kCrashed;
    }
    note("the server " + crash + " and is started again");
  }
}

}  // namespace takt

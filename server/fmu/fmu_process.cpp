#include "server/fmu/fmu_process.h"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstring>

#include "idl/common/text.h"

namespace takt {
namespace {

using fmu_wire::Answer;
using fmu_wire::Request;

/// Loading a large library, its initialisation and its first step may take longer than a step.
constexpr double kLeastStart_s = 30.0;

double monotonic_s() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

}  // namespace

std::string FmuProcess::spawn() {
  std::array<int, 2> sockets{};
  if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, sockets.data()) != 0)
    return std::string("the FMU cannot be started: ") + std::strerror(errno);
  posix_spawn_file_actions_t actions;
  posix_spawnattr_t attributes;
  posix_spawn_file_actions_init(&actions);
  posix_spawnattr_init(&attributes);
  // What an FMU prints must not be taken for output of takt; its messages come through FMI.
  posix_spawn_file_actions_addopen(&actions, 0, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_addopen(&actions, 1, "/dev/null", O_WRONLY, 0);
  posix_spawn_file_actions_adddup2(&actions, 1, 2);
  posix_spawn_file_actions_adddup2(&actions, sockets[1], fmu_wire::kSocket);
  posix_spawn_file_actions_addclosefrom_np(&actions, fmu_wire::kSocket + 1);
  sigset_t none, usual;
  sigemptyset(&none);
  sigfillset(&usual);
  posix_spawnattr_setsigmask(&attributes, &none);
  posix_spawnattr_setsigdefault(&attributes, &usual);
  // A session of its own, without terminal: Ctrl-C is for takt, which ends the FMU itself.
  posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF | POSIX_SPAWN_SETSID);
  std::string program = p_->host.string();
  std::array<char*, 2> arguments{program.data(), nullptr};
  const int failed =
      ::posix_spawn(&child_, program.c_str(), &actions, &attributes, arguments.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  posix_spawnattr_destroy(&attributes);
  ::close(sockets[1]);
  if (failed != 0) {
    child_ = -1;
    ::close(sockets[0]);
    return "the FMU cannot be started: " + program + ": " + std::strerror(failed);
  }
  socket_ = sockets[0];
  return {};
}

void FmuProcess::end() {
  if (socket_ >= 0) ::close(socket_);
  socket_ = -1;
  if (child_ <= 0) return;
  ::kill(child_, SIGKILL);
  while (::waitpid(child_, nullptr, 0) < 0 && errno == EINTR) {
  }
  child_ = -1;
}

std::string FmuProcess::how_it_ended() {
  int status = 0;
  ::kill(child_, SIGKILL);  // of a process that has ended it changes nothing
  while (::waitpid(child_, &status, 0) < 0 && errno == EINTR) {
  }
  child_ = -1;
  end();
  if (WIFSIGNALED(status) && WTERMSIG(status) != SIGKILL)
    return "crashed: signal " + std::to_string(WTERMSIG(status)) + " (" + ::strsignal(WTERMSIG(status)) + ")";
  if (WIFEXITED(status)) return "ended its process with exit code " + std::to_string(WEXITSTATUS(status));
  return "was killed, or closed its connection to takt,";
}

/// Waits for the socket; false at the deadline (monotonic, s).
bool FmuProcess::wait(short for_what, double deadline_s) {
  while (true) {
    const double left_s = deadline_s - monotonic_s();
    if (left_s <= 0.0) return false;
    pollfd one{socket_, for_what, 0};
    const int ready = ::poll(&one, 1, static_cast<int>(std::ceil(1e3 * std::min(left_s, 1e6))));
    if (ready > 0) return true;
    if (ready < 0 && errno != EINTR) return false;
  }
}

std::string FmuProcess::too_late(const char* what, double timeout_s) {
  end();
  return std::string("the FMU did not answer ") + what + " within " + number_text(timeout_s, 6) +
         " s (timeout_s), and was ended";
}

std::string FmuProcess::send(const void* from, std::size_t size, double deadline_s, const char* what,
                             double timeout_s) {
  const auto* bytes = static_cast<const char*>(from);
  while (size > 0) {
    const ssize_t sent = ::send(socket_, bytes, size, MSG_NOSIGNAL | MSG_DONTWAIT);
    if (sent > 0) {
      bytes += sent, size -= static_cast<std::size_t>(sent);
    } else if (sent < 0 && errno == EAGAIN) {
      if (!wait(POLLOUT, deadline_s)) return too_late(what, timeout_s);
    } else if (sent == 0 || errno != EINTR) {
      return std::string("the FMU ") + how_it_ended() + " before " + what;
    }
  }
  return {};
}

std::string FmuProcess::receive(void* to, std::size_t size, double deadline_s, const char* what,
                                double timeout_s) {
  auto* bytes = static_cast<char*>(to);
  while (size > 0) {
    if (!wait(POLLIN, deadline_s)) return too_late(what, timeout_s);
    const ssize_t got = ::recv(socket_, bytes, size, 0);
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) return std::string("the FMU ") + how_it_ended() + " during " + what;
    bytes += got, size -= static_cast<std::size_t>(got);
  }
  return {};
}

std::string FmuProcess::exchange(const char* what, double timeout_s) {
  if (socket_ < 0) return "the FMU does not run";
  const double deadline_s = monotonic_s() + timeout_s;
  auto length = static_cast<std::uint32_t>(message_.size());
  if (std::string why = send(&length, sizeof length, deadline_s, what, timeout_s); !why.empty()) return why;
  if (std::string why = send(message_.data(), message_.size(), deadline_s, what, timeout_s); !why.empty())
    return why;
  if (std::string why = receive(&length, sizeof length, deadline_s, what, timeout_s); !why.empty())
    return why;
  if (length > fmu_wire::kLongestMessage) {
    end();
    return std::string("the FMU's process answered ") + what +
           " with bytes that are no answer, and was ended";
  }
  try {
    message_.resize(length);
  } catch (const std::exception&) {
    end();
    return "there is not enough memory for the answer of the FMU";
  }
  return receive(message_.data(), length, deadline_s, what, timeout_s);
}

std::string FmuProcess::answer(const std::function<void(StateReader&)>& rest) {
  try {
    StateReader in(message_, "the answer of the FMU's process");
    const bool good = in.integer(0, 1, "the answer") == static_cast<int>(Answer::good);
    const std::string sentence = in.text(fmu_wire::kMost, "letters");
    const std::string notice = in.text(fmu_wire::kMost, "letters");
    if (!notice.empty()) notice_ = notice;
    if (!good) return sentence;
    rest(in);
    in.expect_end();
    return {};
  } catch (const std::exception& error) {
    end();
    return error.what();
  }
}

std::string FmuProcess::restart(std::span<double> outputs) {
  // Not every FMU comes back from fmi2Reset or fmi3Reset to what it was; a fresh process does.
  end();
  if (std::string why = spawn(); !why.empty()) return why;
  has_stepped_ = false;
  message_.clear();
  StateWriter out(message_);
  out.put(Request::start);
  fmu_wire::put(out, p_->start);
  if (std::string why = exchange("its start", std::max(p_->timeout_s, kLeastStart_s)); !why.empty())
    return why;
  std::string why = answer([&](StateReader& in) { in.numbers(outputs, "an output"); });
  if (!why.empty()) end();
  return why;
}

std::string FmuProcess::step(double t, double h, std::span<const double> inputs, std::span<double> outputs) {
  message_.clear();
  StateWriter out(message_);
  out.put(Request::step), out.put(t), out.put(h), out.put(inputs);
  const bool first = !std::exchange(has_stepped_, true);
  const double timeout_s = first ? std::max(p_->timeout_s, kLeastStart_s) : p_->timeout_s;
  if (std::string why = exchange(first ? "its first step" : "a step", timeout_s); !why.empty()) return why;
  std::string why = answer([&](StateReader& in) { in.numbers(outputs, "an output"); });
  // After an error FMI allows few calls and after a fatal one none: a restart begins with a fresh process.
  if (!why.empty()) end();
  return why;
}

std::string FmuProcess::save(std::vector<std::byte>& state) {
  if (!p_->start.can_serialise_state)
    return "the state of the FMU '" + p_->start.instance + "' cannot be saved: it does not state " +
           (p_->start.version == 2 ? "canSerializeFMUstate" : "canSerializeFMUState") +
           ". A cell with it has no snapshots; a recording (command log) can be replayed from the start";
  message_.clear();
  StateWriter out(message_);
  out.put(Request::save);
  if (std::string why = exchange("the request for its state", p_->timeout_s); !why.empty()) return why;
  return answer([&](StateReader& in) {
    const std::span<const std::byte> rest = in.rest();
    state.assign(rest.begin(), rest.end());
  });
}

std::string FmuProcess::load(std::span<const std::byte> state) {
  if (socket_ < 0) {  // it has failed since
    std::vector<double> outputs(p_->start.outputs.size());
    if (std::string why = restart(outputs); !why.empty()) return why;
  }
  message_.clear();
  StateWriter out(message_);
  out.put(Request::load);
  message_.insert(message_.end(), state.begin(), state.end());
  if (std::string why = exchange("its state", p_->timeout_s); !why.empty()) return why;
  return answer([](StateReader&) {});
}

}  // namespace takt

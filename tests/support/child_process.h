#pragma once
// A program started by a test, with its output on a pipe. Ended at the latest by the destructor.
#include <fcntl.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <stdexcept>
#include <string>
#include <vector>

namespace takt::test {

class ChildProcess {
 public:
  explicit ChildProcess(const std::vector<std::string>& command) {
    std::array<int, 2> ends{};
    if (pipe2(ends.data(), O_CLOEXEC) != 0) throw std::runtime_error("no pipe");
    std::vector<char*> arguments;
    for (const auto& argument : command) arguments.push_back(const_cast<char*>(argument.c_str()));
    arguments.push_back(nullptr);
    pid_ = fork();
    if (pid_ == 0) {
      dup2(ends[1], STDOUT_FILENO);
      dup2(ends[1], STDERR_FILENO);
      execv(arguments[0], arguments.data());
      _exit(127);
    }
    close(ends[1]);
    output_ = ends[0];
  }
  ~ChildProcess() {
    if (!ended_) {
      signal(SIGKILL);
      wait();
    }
    close(output_);
  }
  ChildProcess(const ChildProcess&) = delete;
  ChildProcess& operator=(const ChildProcess&) = delete;

  void signal(int number) { kill(pid_, number); }
  pid_t pid() const { return pid_; }

  /// Reads output until the words appear; false if the program ended first.
  bool wait_for_output(const std::string& words) {
    while (text.find(words) == std::string::npos) {
      std::array<char, 512> buffer{};
      const ssize_t count = read(output_, buffer.data(), buffer.size());
      if (count <= 0) return false;
      text.append(buffer.data(), static_cast<std::size_t>(count));
    }
    return true;
  }
  /// Reads the rest of the output and returns the exit code, or 128 + the signal.
  int wait() {
    (void)wait_for_output("\x01");  // a character that never comes: everything up to the end
    int status = 0;
    waitpid(pid_, &status, 0);
    ended_ = true;
    return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  }

  std::string text;

 private:
  pid_t pid_ = -1;
  int output_ = -1;
  bool ended_ = false;
};

}  // namespace takt::test

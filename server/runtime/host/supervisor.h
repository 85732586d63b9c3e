#pragma once
// A parent process that restarts the server after a crash. The parent only waits: it has no threads, no DDS
// and no scenario that could fail.
//
// The child has crashed if a signal ended it (a fault, an abort, kill -9, the kernel short of memory) or it
// returned kCrashed. Any other end of the child ends the parent. Signals that end the server are passed on.
// If the parent dies, the kernel ends the child.
#include <functional>
#include <string>
#include <vector>

namespace takt {

struct SupervisorOptions {
  /// After this many crashes within this time (s) the parent gives up.
  int most_crashes = 5;
  double within_s = 60.0;
  /// Called in the parent with messages for the user.
  std::function<void(const std::string& sentence)> on_note{};
};

/// The exit code of a child that is to be started again.
inline constexpr int kCrashed = 1;

/// Signals that end the server: SIGINT, SIGTERM, and SIGHUP (the terminal is closed) unless it is ignored
/// (nohup).
std::vector<int> ending_signals();

/// Runs `serve` in a child process, repeatedly; `crash` describes the end of the previous child ("was killed
/// by signal 11 (Segmentation fault)"), empty for the first. Call it ahead of any thread's start, with
/// ending_signals() blocked. Returns the exit code for the process.
int supervise(const std::function<int(const std::string& crash)>& serve, const SupervisorOptions& options);

}  // namespace takt

#pragma once
// A parent process that starts the server again when it has crashed. The parent only waits: it has no
// threads, no DDS and no scenario that could fail.
//
// The child has crashed when a signal ended it (a fault, an abort, kill -9, the kernel short of memory) or it
// returned kCrashed. Any other end is the end of both. Signals that are to end the server are passed on.
// Should the parent die, the kernel ends the child too, so that none is left behind.
#include <functional>
#include <string>
#include <vector>

namespace takt {

struct SupervisorOptions {
  /// So many crashes within this time (s), and the parent gives up.
  int most_crashes = 5;
  double within_s = 60.0;
  /// Called in the parent, with what is to be said to people.
  std::function<void(const std::string& sentence)> on_note{};
};

/// The exit code of a child that is to be started again.
inline constexpr int kCrashed = 1;

/// That are to end the server: SIGINT, SIGTERM, and SIGHUP (the terminal is closed) unless it is ignored
/// (nohup).
std::vector<int> ending_signals();

/// Runs `serve` in a child process, again and again; `crash` says how the one before ended ("was killed by
/// signal 11 (Segmentation fault)"), empty for the first. Call it before any thread is started, with
/// ending_signals() blocked. Returns the exit code for the process.
int supervise(const std::function<int(const std::string& crash)>& serve, const SupervisorOptions& options);

}  // namespace takt

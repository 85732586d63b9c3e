#pragma once
// Work in a process of its own: what hangs or crashes there leaves this one as it is.
#include <functional>
#include <string>

namespace takt::cad {

struct ChildResult {
  std::string bytes;    ///< what the work returned; empty if it did not end
  std::string problem;  ///< empty: it ended; else one phrase
};

/// Runs the work in a copy of this process, which has no threads. It ends at `cpu_limit_s` of its own time on the
/// processor (whole seconds, at least 1), so that a busy machine ends no work.
ChildResult run_in_child(const std::function<std::string()>& work, int cpu_limit_s);

}  // namespace takt::cad

#pragma once
// Which pairs clients want to see pressed element by element, and for how long; what is asked for and not
// renewed ceases of itself, so that a client that dies leaves nothing behind. The step loop knows nothing of
// it: whoever writes samples looks here, at most so often that it costs a tenth of its time.
#include <cstdint>
#include <map>
#include <mutex>
#include <string>
#include <vector>

#include "server/runtime/requests/control.h"
#include "server/simulation/model/cell_model.h"
#include "server/simulation/model/pressed_elements.h"

namespace takt {

class PressureSubscriptions {
 public:
  static constexpr std::int64_t kPeriod_ns = 100'000'000;  ///< wall time between two looks, at least
  static constexpr std::size_t kMaxPairs = PressedElements::kMaxPairs;

  /// The model must outlive it.
  explicit PressureSubscriptions(const CellModel& model) : model_(model), elements_(model.contact) {}

  /// Any thread.
  Outcome<requests::WatchPressures> watch(const requests::WatchPressures& request, std::int64_t now_ns);
  /// Any thread: whether anything is watched now.
  bool watches(std::int64_t now_ns);

  // One thread, the one that writes samples:

  /// Whether it is time for another look.
  bool due(std::int64_t now_ns) const { return now_ns >= due_ns_; }
  /// What presses in this instant of what is watched; notes what the look cost. `clock_ns` is a monotonic
  /// clock.
  const std::vector<PressedPair>& look(const Snapshot& snapshot, std::int64_t (*clock_ns)());

 private:
  const CellModel& model_;
  std::mutex mutex_;
  std::map<std::size_t, std::int64_t> until_ns_;  ///< by pair; guarded by mutex_
  PressedElements elements_;
  std::vector<std::size_t> pairs_;
  std::int64_t due_ns_ = 0;
};

}  // namespace takt

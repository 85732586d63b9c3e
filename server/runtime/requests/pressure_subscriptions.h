#pragma once
// Pairs whose pressures clients have subscribed to, element by element, and the ends of the subscriptions:
// they expire unless renewed, so that a dead client leaves none behind. The step loop does not use it: the
// thread that writes samples evaluates it, at a rate that costs at most a tenth of its time.
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
  static constexpr std::int64_t kPeriod_ns = 100'000'000;  ///< shortest wall time between two evaluations
  static constexpr std::size_t kMaxPairs = PressedElements::kMaxPairs;

  /// The model must outlive it.
  explicit PressureSubscriptions(const CellModel& model) : model_(model), elements_(model.contact) {}

  /// Any thread.
  Outcome<requests::WatchPressures> watch(const requests::WatchPressures& request, std::int64_t now_ns);
  /// Any thread: whether any subscription is active.
  bool watches(std::int64_t now_ns);

  // For one thread, the one that writes samples:

  /// Whether the next evaluation is due.
  bool due(std::int64_t now_ns) const { return now_ns >= due_ns_; }
  /// The pressures of the subscribed pairs at this instant; measures the cost. `clock_ns` is a monotonic
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

#pragma once
// Commands of registered controllers for boundaries that lie ahead: a controller that need not look at the cell sends
// them early (lookahead), and each waits for its boundary.
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "idl/common/lockstep.h"
#include "server/runtime/loop/command_buffer.h"

namespace takt {

/// For the loop's thread. Allocates in the constructor only.
class ScheduledCommands {
 public:
  explicit ScheduledCommands(int targets) : targets_(static_cast<std::size_t>(targets)) {
    for (Target& target : targets_) target.slots.resize(kMostLookahead);
  }

  /// `boundary` is at most kMostLookahead ahead of every boundary that was not taken yet. Replaces the command for it, and
  /// drops those for later ones: a sender that begins again there sends them again.
  void put(std::uint64_t boundary, ReceivedCommand&& received) {
    Target& target = at(received.target);
    for (std::uint64_t later = boundary; later <= target.last && later < boundary + kMostLookahead; ++later)
      slot(target, later).reset();
    target.last = boundary;
    slot(target, boundary).emplace(boundary, std::move(received));
  }
  bool has(int target, std::uint64_t boundary) const {
    const auto& held = at(target).slots[boundary % kMostLookahead];
    return held && held->first == boundary;
  }
  /// Gives away the command for this boundary.
  std::optional<ReceivedCommand> take(int target, std::uint64_t boundary) {
    if (!has(target, boundary)) return std::nullopt;
    auto& held = slot(at(target), boundary);
    std::optional<ReceivedCommand> result(std::move(held->second));
    held.reset();
    return result;
  }
  void drop(int target) {
    for (auto& held : at(target).slots) held.reset();
    at(target).last = 0;
  }
  void drop_all() {
    for (int target = 0; target < static_cast<int>(targets_.size()); ++target) drop(target);
  }

 private:
  using Slot = std::optional<std::pair<std::uint64_t, ReceivedCommand>>;
  struct Target {
    std::vector<Slot> slots;  ///< of boundary k: slots[k % kMostLookahead]
    std::uint64_t last = 0;   ///< boundary of the newest command
  };
  Target& at(int target) { return targets_[static_cast<std::size_t>(target)]; }
  const Target& at(int target) const { return targets_[static_cast<std::size_t>(target)]; }
  static Slot& slot(Target& target, std::uint64_t boundary) {
    return target.slots[boundary % kMostLookahead];
  }

  std::vector<Target> targets_;
};

}  // namespace takt

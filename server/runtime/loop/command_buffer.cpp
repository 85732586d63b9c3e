#include "server/runtime/loop/command_buffer.h"

#include <algorithm>
#include <string>
#include <utility>

#include "idl/common/text.h"
#include "server/runtime/requests/event.h"

namespace takt {
namespace {

std::string seconds(SimTime time) {
  return fixed_text(time.seconds(), 9) + " s";
}

}  // namespace

SimTime stamp_of(const Command& command) {
  return std::visit([](const auto& c) { return c.stamp; }, command);
}

CommandBuffer::CommandBuffer(const CellDescription& cell, std::size_t capacity)
    : cell_(cell),
      capacity_(capacity),
      targets_(static_cast<std::size_t>(target_count(cell))),
      missing_(targets_.size(), false) {
  waiting_.reserve(capacity_);
}

std::optional<Rejection> CommandBuffer::append(const Command& command, std::uint64_t sender,
                                               std::int64_t received_ns, bool* wake, GoalPtr goal) {
  const int index = target_of(cell_, command);
  const auto subject = [&] { return std::string(target_name(cell_, index)); };
  const SimTime stamp = stamp_of(command);
  const SimTime present{present_ns_.load(std::memory_order_relaxed)};

  SimTime newest;
  {
    const std::lock_guard lock(mutex_);
    Target& target = targets_[static_cast<std::size_t>(index)];
    if (target.sender != sender) {
      target = {};
      target.sender = sender;
    }
    newest = target.newest_stamp;
    const bool older = stamp.given() && stamp < newest;
    const bool repeated = older && lockstep_.load(std::memory_order_relaxed) && target.has_accepted(stamp);
    // A newest stamp that lies in the future is outvoted by the present, and by two stamps in order.
    const bool outvoted =
        newest > present && (stamp <= present || (target.older_stamp.given() && stamp >= target.older_stamp));
    const bool stale = older && !outvoted && !repeated;
    target.older_stamp = stale && newest > present ? stamp : SimTime{};
    if (!stale && waiting_.size() < capacity_) {
      waiting_.push_back({command, index, sender, received_ns, std::move(goal)});
      if (stamp.given() && stamp != newest && !repeated) {
        target.newest_stamp = target.last_stamps[target.next] = stamp;
        target.next = (target.next + 1) % target.last_stamps.size();
      }
      empty_.store(false, std::memory_order_release);
      const bool expected =
          missing_count_ > 0 && missing_[static_cast<std::size_t>(index)] && stamp == expected_stamp_;
      if (expected) {
        missing_[static_cast<std::size_t>(index)] = false;
        --missing_count_;
      }
      const bool for_later = missing_count_ > 0 && stamp > expected_stamp_;
      if (wake != nullptr) *wake = !(expected || for_later) || missing_count_ == 0;
      return std::nullopt;
    }
    if (!stale) newest = {};
  }
  if (newest.given()) {
    return Rejection{RejectionCode::stale, subject(),
                     "The command for " + subject() + " is stamped " + seconds(stamp) +
                         ", which is older than the newest one accepted, " + seconds(newest) + "."};
  }
  return Rejection{RejectionCode::malformed, subject(),
                   "The command for " + subject() + " was dropped: " + std::to_string(capacity_) +
                       " commands already wait for the next step."};
}

void CommandBuffer::take_all(std::vector<ReceivedCommand>& out, bool may_wait) {
  out.clear();
  if (empty_.load(std::memory_order_acquire)) return;
  if (out.capacity() < capacity_) out.reserve(capacity_);
  std::unique_lock lock(mutex_, std::defer_lock);
  if (may_wait) {
    lock.lock();
  } else if (!lock.try_lock()) {
    return;
  }
  waiting_.swap(out);
  empty_.store(true, std::memory_order_relaxed);
  missing_count_ = 0;
}

void CommandBuffer::expect(SimTime stamp, std::span<const int> missing) {
  const std::lock_guard lock(mutex_);
  missing_.assign(missing_.size(), false);
  for (const int target : missing) missing_[static_cast<std::size_t>(target)] = true;
  missing_count_ = missing.size();
  expected_stamp_ = stamp;
}

void CommandBuffer::forget() {
  const std::lock_guard lock(mutex_);
  waiting_.clear();
  std::fill(targets_.begin(), targets_.end(), Target{});
  empty_.store(true, std::memory_order_relaxed);
}

}  // namespace takt

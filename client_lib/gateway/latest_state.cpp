#include "client_lib/gateway/latest_state.h"

#include <algorithm>

namespace takt::gateway {
namespace {

/// How long the thread sleeps at most without a new instant, so that it can end.
constexpr Seconds kPatience{0.1};
constexpr double kWindow_s = 1.0;
constexpr std::size_t kMostIntervals = 20000;

}  // namespace

LatestState::LatestState(const Client& client, std::function<void(const State&)> on_new)
    : client_(client), on_new_(std::move(on_new)), newest_(std::make_shared<State>(client.state())) {
  thread_ = std::thread([this] { run(); });
}

LatestState::~LatestState() {
  over_ = true;
  thread_.join();
}

std::shared_ptr<const State> LatestState::get() const {
  const std::lock_guard lock(mutex_);
  return newest_;
}

LatestState::Intervals LatestState::intervals() const {
  const std::lock_guard lock(mutex_);
  return intervals_;
}

void LatestState::run() {
  while (!over_) {
    try {
      receive();
    } catch (const ClientError&) {  // the server is gone: the newest state stays until it answers again
      measuring_ = false;
      static_cast<void>(client_.wait_for_connection(kPatience));
    }
  }
}

void LatestState::receive() {
  const std::uint64_t seen = get()->sample_number;
  auto state = client_.wait_for(
      topics::state, [&](const State& s) { return s.sample_number > seen; }, kPatience);
  if (!state) {
    measuring_ = false;
    return;
  }
  measure(*state);
  auto kept = std::make_shared<const State>(std::move(*state));
  {
    const std::lock_guard lock(mutex_);
    newest_ = kept;
  }
  if (on_new_) on_new_(*kept);
}

void LatestState::measure(const State& state) {
  const auto now = std::chrono::steady_clock::now();
  // An instant that is repeated: the cell stands still.
  const bool moves = state.step > previous_step_;
  if (moves && measuring_) {
    if (window_s_.size() < kMostIntervals)
      window_s_.push_back(std::chrono::duration<double>(now - previous_).count());
  } else {
    window_s_.clear();
    window_begin_ = now;
  }
  measuring_ = moves;
  previous_ = now;
  previous_step_ = state.step;
  if (std::chrono::duration<double>(now - window_begin_).count() < kWindow_s || window_s_.empty()) return;
  std::sort(window_s_.begin(), window_s_.end());
  const std::size_t n = window_s_.size();
  {
    const std::lock_guard lock(mutex_);
    intervals_ = {n, window_s_[n / 2], window_s_[std::min(n - 1, n * 99 / 100)], window_s_.back()};
  }
  window_s_.clear();
  window_begin_ = now;
}

}  // namespace takt::gateway

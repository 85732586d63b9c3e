#pragma once
// Recovery from a forged sample far ahead of the genuine ones, which a client would otherwise take for old ones.
#include <chrono>
#include <cstdint>
#include <utility>

namespace takt::client {

/// Counts samples that are older than the newest one. A few may come late; a sender that goes on in the past shows that
/// the newest sample was not its own.
class Outvoting {
 public:
  using Instant = std::pair<std::uint32_t, std::uint64_t>;  ///< epoch, or scenario; and step
  using Clock = std::chrono::steady_clock;
  static constexpr int kVotes = 3;
  static constexpr std::chrono::milliseconds kTime{500};

  /// An older sample has come. True if enough of them came in order, over a longer time than samples are under way.
  bool older(Instant instant, Clock::time_point now) {
    if (votes_ == 0 || instant < last_) {
      votes_ = 0;
      first_ = now;
    }
    last_ = instant;
    if (votes_ < kVotes) ++votes_;
    return votes_ == kVotes && now - first_ >= kTime;
  }
  /// A sample in order has come.
  void in_order() { votes_ = 0; }

 private:
  int votes_ = 0;
  Instant last_{};
  Clock::time_point first_{};
};

/// Whether `later` lies further ahead of `before` than a simulation comes in this wall time.
template <typename Sample>
bool leaps(const Sample& before, const Sample& later, std::chrono::duration<double> wall) {
  constexpr double kSlack_s = 10.0, kFastest = 1000.0;  // simulated time, and how often faster than wall time
  if (later.epoch != before.epoch) return later.epoch > before.epoch && later.epoch - before.epoch > 1;
  if constexpr (requires { later.time; })
    return !(later.time - before.time <= kSlack_s + kFastest * wall.count());
  return false;
}

}  // namespace takt::client

#pragma once
// Time stamps of an outside controller on the clock of their arrivals, so that jitter of the network does not reach the
// motion. Finds packets that were doubled or overtaken, and controllers that have restarted. Pure: the caller reads the
// clock.
#include <cmath>
#include <cstdint>

namespace takt::gateway {

struct PeerClockOptions {
  std::uint64_t jump_ms = 1000;  ///< a larger step of the stamp is a restart of the controller
  std::uint64_t old_ms =
      40;  ///< a stamp at most this far back was doubled or overtaken; further back is a restart
  /// Stamp and arrival may be this far apart. Beyond it stamps count from the arrival again: the controller's clock drifts,
  /// or its stamps are no milliseconds.
  double drift_s = 0.1;
};

class PeerClock {
 public:
  struct Reading {
    double time_s = 0.0;     ///< of the packet, on the clock of the arrivals
    bool old = false;        ///< the packet is no news
    bool restarted = false;  ///< first packet, or the controller has restarted
  };

  explicit PeerClock(const PeerClockOptions& options = {}) : options_(options) {}

  /// `begins`: the packet begins a session for another reason, e.g. after silence.
  Reading read(std::uint64_t stamp_ms, double arrival_s, bool begins) {
    Reading reading;
    const bool first = begins || !started_;
    reading.old = !first && stamp_ms <= last_ms_ && last_ms_ - stamp_ms <= options_.old_ms;
    if (reading.old) return reading;
    reading.restarted = first || stamp_ms < last_ms_ || stamp_ms - last_ms_ > options_.jump_ms;
    started_ = true;
    last_ms_ = stamp_ms;
    if (reading.restarted || stamp_ms < origin_ms_ ||
        std::abs(time_of(stamp_ms) - arrival_s) > options_.drift_s) {
      origin_ms_ = stamp_ms;
      origin_s_ = arrival_s;
    }
    reading.time_s = time_of(stamp_ms);
    return reading;
  }

 private:
  double time_of(std::uint64_t stamp_ms) const {
    return origin_s_ + 1e-3 * static_cast<double>(stamp_ms - origin_ms_);
  }

  PeerClockOptions options_;
  bool started_ = false;
  std::uint64_t last_ms_ = 0, origin_ms_ = 0;
  double origin_s_ = 0.0;
};

}  // namespace takt::gateway

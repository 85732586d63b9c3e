#pragma once
// The first command of an outside controller, without a jump. Pure: no clock, no transport.
//
// A controller that connects, or connects again, may command positions far from those of the robot. Resynchronisation
// refuses its commands until they are near (if configured so), and leads the robot to them with all joints together at
// a limited speed. Once the robot is at the commanded positions, commands pass unchanged.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace takt::gateway {

enum class OnJump : std::uint8_t { ramp, refuse };

struct ResynchronisationOptions {
  OnJump on_jump = OnJump::ramp;
  double nearness = 0.05;   ///< largest difference of one joint that is not refused, rad or m
  double ramp_speed = 0.5;  ///< of the joint with the longest way, rad/s or m/s
};

class Resynchronisation {
 public:
  explicit Resynchronisation(const ResynchronisationOptions& options) : options_(options) {}

  /// Forgets the controller: its next command is again the first one.
  void restart() {
    engaged_ = false;
    offset_.clear();
  }
  /// The robot follows the commands themselves.
  bool engaged() const { return engaged_; }

  /// The set-point for a command, `period_s` after the one before; nothing while commands are refused. `present`:
  /// positions of the robot. Of the difference at the first command, one period's part at the ramp's speed is removed
  /// with each command; the motion of the commands themselves passes unchanged.
  std::optional<std::vector<double>> next(std::span<const double> command, std::span<const double> present,
                                          double period_s) {
    std::vector<double> set_point(command.begin(), command.end());
    if (engaged_) return set_point;
    if (offset_.empty()) {
      std::vector<double> offset(command.size());
      for (std::size_t i = 0; i < command.size(); ++i) offset[i] = present[i] - command[i];
      if (options_.on_jump == OnJump::refuse && largest(offset) > options_.nearness) return std::nullopt;
      offset_ = std::move(offset);
    }
    const double way = largest(offset_), step = options_.ramp_speed * period_s;
    engaged_ = way <= step;
    for (std::size_t i = 0; i < set_point.size(); ++i) {
      offset_[i] -= engaged_ ? offset_[i] : offset_[i] * step / way;
      set_point[i] += offset_[i];
    }
    return set_point;
  }
  /// Largest difference of one joint between command and set-point, rad or m.
  double remaining() const { return largest(offset_); }

 private:
  static double largest(std::span<const double> values) {
    double most = 0.0;
    for (const double value : values) most = std::max(most, std::abs(value));
    return most;
  }

  ResynchronisationOptions options_;
  bool engaged_ = false;
  std::vector<double> offset_;  ///< set-point minus command
};

}  // namespace takt::gateway

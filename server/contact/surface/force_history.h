#pragma once
// A largest force between the points at which it is known.
#include <algorithm>
#include <array>
#include <cstddef>
#include <optional>

namespace takt {

/// The force of a pair at its last four points.
class ForceHistory {
 public:
  struct Vertex {
    double time_s = 0.0, force_N = 0.0;
  };

  /// A time before the last one starts afresh; the last one itself is passed over.
  void add(double time_s, double force_N) {
    if (count_ > 0 && time_s == times_[3]) return;
    if (count_ > 0 && time_s < times_[3]) count_ = 0;
    std::rotate(times_.begin(), times_.begin() + 1, times_.end());
    std::rotate(forces_.begin(), forces_.begin() + 1, forces_.end());
    times_[3] = time_s, forces_[3] = force_N;
    count_ = std::min<std::size_t>(count_ + 1, times_.size());
  }

  void forget() { count_ = 0; }

  /// The time of the last point but one.
  double middle_time_s() const { return times_[2]; }

  /// Of the parabola through the last three points, if the middle force is the largest. Nothing at a kink: the three points
  /// before the last must bend as the last three do, within a factor of 2. It exceeds the middle force by a share of the larger
  /// drop beside it, an eighth at most with equal distances h, r^2 / (4 + 4 r) with h and r h: here a quarter at most.
  std::optional<Vertex> vertex() const {
    if (count_ < times_.size() || !(forces_[2] > forces_[1] && forces_[2] >= forces_[3])) return {};
    constexpr double kAlike = 2.0, kMostOfDrop = 0.25;
    const double bend = bend_at(2), earlier = bend_at(1);
    if (!(bend < 0.0 && bend > kAlike * earlier && earlier > kAlike * bend)) return {};
    const double slope = rate_after(1) + bend * (times_[2] - times_[1]);
    const double drop_N = forces_[2] - std::min(forces_[1], forces_[3]);
    return Vertex{times_[2] - 0.5 * slope / bend,
                  forces_[2] + std::min(-0.25 * slope * slope / bend, kMostOfDrop * drop_N)};
  }

 private:
  double rate_after(std::size_t i) const {
    return (forces_[i + 1] - forces_[i]) / (times_[i + 1] - times_[i]);
  }
  /// The second divided difference.
  double bend_at(std::size_t i) const {
    return (rate_after(i) - rate_after(i - 1)) / (times_[i + 1] - times_[i - 1]);
  }

  std::size_t count_ = 0;
  std::array<double, 4> times_{}, forces_{};
};

}  // namespace takt

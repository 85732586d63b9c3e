#pragma once
// Which of two ways of doing a thing again and again is faster, from what they took so far. Knows no clock.
#include <array>

namespace takt {

/// Mostly the better way is chosen. The other one is tried for some stages now and then, ever more rarely
/// while it stays slower.
class AdaptiveDispatch {
 public:
  /// The way for the next stage: 0 or 1. Begins with 0.
  int choose();
  /// What that stage took, per unit of work.
  void note(double time_per_work);

 private:
  static constexpr int kTrial = 24;       ///< stages in a row
  static constexpr int kWarm = 8;         ///< of those, not counted: caches are cold, helpers asleep
  static constexpr int kFirstWait = 256;  ///< stages between trials
  static constexpr int kLongestWait = 16384;

  std::array<double, 2> cost_{};  ///< mean of what was noted lately
  std::array<int, 2> noted_{};
  int way_ = 0;  ///< of the present stage
  int best_ = 0;
  int stages_ = 0;  ///< since this way was begun
  int wait_ = kTrial;
};

}  // namespace takt

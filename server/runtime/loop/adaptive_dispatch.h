#pragma once
// Picks the faster of two implementations from their past run times. The caller measures the times.
#include <array>

namespace takt {

/// Mostly chooses the faster implementation. The other one is tried for some stages from time to time, ever
/// more rarely while it stays slower.
class AdaptiveDispatch {
 public:
  /// The implementation for the next stage: 0 or 1. Begins with 0.
  int choose();
  /// Run time of that stage, per unit of work.
  void note(double time_per_work);

 private:
  static constexpr int kTrial = 24;       ///< stages in a row
  static constexpr int kWarm = 8;         ///< of those, ignored: caches are cold, helpers asleep
  static constexpr int kFirstWait = 256;  ///< stages between trials
  static constexpr int kLongestWait = 16384;

  std::array<double, 2> cost_{};  ///< mean of recent run times
  std::array<int, 2> noted_{};
  int way_ = 0;  ///< of the present stage
  int best_ = 0;
  int stages_ = 0;  ///< since the last change of implementation
  int wait_ = kTrial;
};

}  // namespace takt

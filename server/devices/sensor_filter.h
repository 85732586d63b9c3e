#pragma once
// What all sensors do with a true value: noise, lag and resolution of a measured quantity; threshold, hysteresis and delays
// of a switched one. One sample a step; no sample depends on anything but the parameters, the seed and the true values.
#include <cstdint>
#include <limits>

#include "plant_models/state_bytes.h"
#include "server/fields/fields.h"

namespace takt {

/// Of a measured quantity.
struct MeasuringParameters {
  double noise = 0.0;       ///< standard deviation of each sample
  double lag_s = 0.0;       ///< time constant of first order; 0: none
  double resolution = 0.0;  ///< values are multiples of it; 0: continuous
  int seed = 1;
};

/// Of an output that is on or off.
struct SwitchParameters {
  double threshold = 0.0;
  double hysteresis = 0.0;  ///< width of the band in which the output stays as it is
  bool below = false;       ///< on below the threshold; else above
  double on_delay_s = 0.0, off_delay_s = 0.0;
};

class MeasuringFilter {
 public:
  MeasuringFilter() = default;
  explicit MeasuringFilter(const MeasuringParameters& parameters) : p_(parameters) {}
  void reset() { *this = MeasuringFilter(p_); }
  /// The sample a step of h (s) after the one before it. The lag is exact for a true value that is constant over a step.
  double sample(double value, double h);
  /// A value that does not change would give the same samples.
  bool settled(double value) const {
    return p_.noise == 0.0 && (p_.lag_s == 0.0 || lagged_ == value) && samples_ > 0;
  }
  void save(StateWriter& out) const { out.put(samples_), out.put(lagged_); }
  void load(StateReader& in);

 private:
  MeasuringParameters p_;
  std::uint64_t samples_ = 0;
  double lagged_ = 0.0;
};

class SwitchFilter {
 public:
  SwitchFilter() = default;
  explicit SwitchFilter(const SwitchParameters& parameters) : p_(parameters) {}
  void reset() { *this = SwitchFilter(p_); }
  /// By threshold and hysteresis, then delays. The first sample has no delay.
  bool sample(double value, double h);
  /// Delays alone.
  bool sample_flag(bool raw, double h);
  bool on() const { return on_; }
  /// Ahead of the delays.
  bool raw() const { return raw_; }
  void save(StateWriter& out) const { out.put(on_), out.put(raw_), out.put(started_), out.put(steps_); }
  void load(StateReader& in);

 private:
  SwitchParameters p_;
  bool on_ = false, raw_ = false, started_ = false;
  std::uint64_t steps_ = 0;  ///< for which raw_ has differed from on_
};

/// Keys of a measured quantity; `unit` also ends the keys ("N", "degC" is "K").
struct MeasuringKeys {
  const char *unit, *noise, *resolution;
};
void describe(Fields& f, MeasuringParameters& s, const MeasuringKeys& keys);
/// Keys on_delay_s and off_delay_s.
void describe_delays(Fields& f, SwitchParameters& s);

}  // namespace takt

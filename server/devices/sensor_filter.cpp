#include "server/devices/sensor_filter.h"

#include <cmath>

#include "server/devices/seeded_noise.h"

namespace takt {

double MeasuringFilter::sample(double value, double h) {
  if (p_.noise > 0.0) value += p_.noise * seeded_normal(static_cast<std::uint64_t>(p_.seed), samples_);
  const double share = p_.lag_s > 0.0 && samples_ > 0 ? 1.0 - std::exp(-h / p_.lag_s) : 1.0;
  lagged_ = share == 1.0 ? value : lagged_ + share * (value - lagged_);
  ++samples_;
  return p_.resolution > 0.0 ? p_.resolution * std::round(lagged_ / p_.resolution) : lagged_;
}

void MeasuringFilter::load(StateReader& in) {
  samples_ = in.get<std::uint64_t>();
  lagged_ = in.number("a value of a sensor");
}

bool SwitchFilter::sample(double value, double h) {
  const double beyond = p_.below ? p_.threshold - value : value - p_.threshold;
  return sample_flag(raw_ && started_ ? beyond >= -p_.hysteresis : beyond >= 0.0, h);
}

bool SwitchFilter::sample_flag(bool raw, double h) {
  raw_ = raw;
  if (!started_) {
    started_ = true;
    on_ = raw;
    return on_;
  }
  if (raw == on_) {
    steps_ = 0;
    return on_;
  }
  // The first sample that differs is that of the change. A hundredth of a step is rounding.
  const double delay_s = raw ? p_.on_delay_s : p_.off_delay_s;
  if (static_cast<double>(steps_) * h >= delay_s - 0.01 * h) {
    on_ = raw;
    steps_ = 0;
  } else {
    ++steps_;
  }
  return on_;
}

void SwitchFilter::load(StateReader& in) {
  on_ = in.flag("'a sensor is on'");
  raw_ = in.flag("'the value of a sensor is beyond its threshold'");
  started_ = in.flag("'a sensor has a sample'");
  steps_ = in.get<std::uint64_t>();
}

void describe(Fields& f, MeasuringParameters& s, const MeasuringKeys& keys) {
  f.field(keys.noise, s.noise, not_negative(keys.unit),
          "Standard deviation of each sample, ahead of the lag.");
  f.field("lag_s", s.lag_s, not_negative("s"), "Time constant of a lag of first order; 0: none.");
  f.field(keys.resolution, s.resolution, not_negative(keys.unit),
          "Values are multiples of it; 0: continuous.");
  f.field("seed", s.seed, WholeRange{0, 2147483647}, "Of the noise: equal seeds give equal samples.");
}

void describe_delays(Fields& f, SwitchParameters& s) {
  f.field("on_delay_s", s.on_delay_s, not_negative("s"),
          "The output goes on after the condition has held for this long.");
  f.field("off_delay_s", s.off_delay_s, not_negative("s"),
          "The output goes off after the condition has failed for this long.");
}

}  // namespace takt

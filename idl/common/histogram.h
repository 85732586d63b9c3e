#pragma once
// Histogram of durations with fixed logarithmic bins: recording is a few instructions without allocation;
// quantiles are exact to one bin: at most an eighth too high.
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>

namespace takt {

class DurationHistogram {
 public:
  void record_ns(std::int64_t duration_ns) {
    const std::int64_t duration = std::max<std::int64_t>(duration_ns, 0);
    ++counts_[bin_of(static_cast<std::uint64_t>(duration))];
    ++count_;
    max_ns_ = std::max(max_ns_, duration);
  }

  std::uint64_t count() const { return count_; }
  double max_s() const { return static_cast<double>(max_ns_) * 1e-9; }

  /// Smallest bin edge that at least the fraction `q` (0..1) of the durations does not exceed, in seconds; at
  /// most the largest recorded duration. 0 for an empty histogram.
  double quantile_s(double q) const {
    if (count_ == 0) return 0.0;
    const auto wanted =
        static_cast<std::uint64_t>(std::ceil(std::clamp(q, 0.0, 1.0) * static_cast<double>(count_)));
    std::uint64_t seen = 0;
    for (std::size_t bin = 0; bin < kBins; ++bin) {
      seen += counts_[bin];
      if (seen >= std::max<std::uint64_t>(wanted, 1)) {
        return std::min(static_cast<double>(upper_edge_ns(bin)) * 1e-9, max_s());
      }
    }
    return max_s();
  }

  void clear() { *this = DurationHistogram{}; }

 private:
  // Values below 16 ns have a bin each; above, every power of two is cut into 8 equal bins.
  static constexpr std::size_t kPerOctave = 8;
  static constexpr std::size_t kBins = 16 + kPerOctave * 40;

  static std::size_t bin_of(std::uint64_t value) {
    if (value < 16) return static_cast<std::size_t>(value);
    const auto exponent = static_cast<std::size_t>(std::bit_width(value)) - 1;  // >= 4
    const auto eighth = static_cast<std::size_t>((value >> (exponent - 3)) & 7U);
    return std::min(16 + (exponent - 4) * kPerOctave + eighth, kBins - 1);
  }
  static std::uint64_t upper_edge_ns(std::size_t bin) {
    if (bin < 16) return bin;
    const std::size_t exponent = 4 + (bin - 16) / kPerOctave;
    const std::uint64_t eighth = (bin - 16) % kPerOctave;
    return ((8 + eighth + 1) << (exponent - 3)) - 1;
  }

  std::array<std::uint64_t, kBins> counts_{};
  std::uint64_t count_ = 0;
  std::int64_t max_ns_ = 0;
};

}  // namespace takt

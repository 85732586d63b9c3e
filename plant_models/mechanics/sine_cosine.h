#pragma once
// Sine and cosine of several angles at once, in two lanes without branches. One call of the library's
// functions per angle would be a third of the time of an arm's inverse dynamics.
#include <bit>
#include <cmath>
#include <cstdint>

namespace takt::mechanics {

using Pair = double __attribute__((vector_size(16)));
using PairBits = std::int64_t __attribute__((vector_size(16)));

/// Angles up to this are reduced with three parts of pi/2, exactly enough for an absolute error of 2e-16.
inline constexpr double kLargestReducedAngle = 1e5;

/// Sines and cosines of two angles of at most kLargestReducedAngle.
inline void sine_cosine(const Pair& x, Pair& sine, Pair& cosine) {
  // Quadrant k in the lowest bits of a number so large that it has no fraction.
  constexpr double kShift = 0x1.8p52;
  const Pair shifted = x * 0x1.45f306dc9c883p-1 + kShift;
  const Pair k = shifted - kShift;
  // The first two parts have 33 bits, so their products with k are exact.
  const Pair r = ((x - k * 0x1.921fb544p+0) - k * 0x1.0b4611a6p-34) - k * 0x1.3198a2e037073p-69;
  // On [-pi/4, pi/4]: interpolation at Chebyshev's points of (sin r - r) / r^3 and (cos r - 1 + r^2/2) / r^4
  // as polynomials in r^2.
  const Pair z = r * r;
  const Pair s = r + r * z *
                         (-0.16666666666666666 +
                          z * (0.008333333333330827 +
                               z * (-0.0001984126983657571 +
                                    z * (2.755731600817155e-06 +
                                         z * (-2.5051112272573243e-08 + z * 1.5916726193889336e-10)))));
  const Pair c =
      (1.0 - 0.5 * z) + z * z *
                            (0.041666666666666664 +
                             z * (-0.0013888888888887322 +
                                  z * (2.4801587298651292e-05 +
                                       z * (-2.755731721268659e-07 +
                                            z * (2.0876134024090145e-09 + z * -1.1381754653662937e-11)))));
  const PairBits quadrant = std::bit_cast<PairBits>(shifted);
  const PairBits odd = -(quadrant & 1);
  const auto bits = [](const Pair& v) { return std::bit_cast<PairBits>(v); };
  const PairBits sine_bits = ((bits(s) & ~odd) | (bits(c) & odd)) ^ ((quadrant & 2) << 62);
  const PairBits cosine_bits = ((bits(c) & ~odd) | (bits(s) & odd)) ^ (((quadrant + 1) & 2) << 62);
  sine = std::bit_cast<Pair>(sine_bits);
  cosine = std::bit_cast<Pair>(cosine_bits);
}

/// Of `count` angles, any number; the arrays must have room for the next even number. The result for infinite
/// angles and NaN is NaN.
inline void sine_cosine(const double* angles, int count, double* sines, double* cosines) {
  for (int i = 0; i < count; i += 2) {
    const Pair x{angles[i], i + 1 < count ? angles[i + 1] : 0.0};
    Pair s, c;
    sine_cosine(x, s, c);
    for (int lane = 0; lane < 2; ++lane) {
      sines[i + lane] = s[lane];
      cosines[i + lane] = c[lane];
      if (!(std::abs(x[lane]) <= kLargestReducedAngle)) {
        sines[i + lane] = std::sin(x[lane]);
        cosines[i + lane] = std::cos(x[lane]);
      }
    }
  }
}

}  // namespace takt::mechanics

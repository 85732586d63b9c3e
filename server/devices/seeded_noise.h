#pragma once
// Noise of sensors: a number for each place of a sequence, by a seed. Equal seeds give equal bits on every machine; the
// distributions of the standard library differ between libraries.
#include <cmath>
#include <cstdint>
#include <numbers>

namespace takt {

/// splitmix64 (Steele, Lea, Flood 2014).
inline std::uint64_t splitmix64(std::uint64_t x) {
  x += 0x9e3779b97f4a7c15U;
  x = (x ^ (x >> 30U)) * 0xbf58476d1ce4e5b9U;
  x = (x ^ (x >> 27U)) * 0x94d049bb133111ebU;
  return x ^ (x >> 31U);
}

/// Normal, with standard deviation 1 (Box and Muller 1958).
inline double seeded_normal(std::uint64_t seed, std::uint64_t place) {
  const std::uint64_t a = splitmix64(splitmix64(seed) + 2 * place),
                      b = splitmix64(splitmix64(seed) + 2 * place + 1);
  const double u = (static_cast<double>(a >> 11U) + 0.5) * 0x1p-53,
               v = static_cast<double>(b >> 11U) * 0x1p-53;
  return std::sqrt(-2.0 * std::log(u)) * std::cos(2.0 * std::numbers::pi * v);
}

}  // namespace takt

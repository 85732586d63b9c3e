#pragma once
// A 64-bit hash chained over the bits of successive states: equal hashes at a step mean equal bits in all
// steps up to it. Not cryptographic.
#include <bit>
#include <cstdint>
#include <span>

namespace takt {

class StateHash {
 public:
  static constexpr std::uint64_t kSeed = 0x9E3779B97F4A7C15ULL;

  void add(std::uint64_t word) {
    // Multiply-xorshift as in the finaliser of splitmix64, chained.
    std::uint64_t z = (value_ ^ word) * 0xBF58476D1CE4E5B9ULL;
    z ^= z >> 29;
    value_ = z * 0x94D049BB133111EBULL + kSeed;
  }
  void add(double value) { add(std::bit_cast<std::uint64_t>(value)); }
  void add(std::span<const double> values) {
    for (const double value : values) add(value);
  }
  std::uint64_t value() const { return value_; }
  void reset() { value_ = kSeed; }
  void resume(std::uint64_t value) { value_ = value; }

 private:
  std::uint64_t value_ = kSeed;
};

}  // namespace takt

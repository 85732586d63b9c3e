#pragma once
// The wrenches of connections whose two ends have not moved between two evaluations: a sample of a cell with many Parts at
// rest then costs little. The bits are those of substitute_wrench().
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <utility>
#include <vector>

#include "server/contact/holding/substitute_force.h"

namespace takt {

class KeptWrenches {
 public:
  explicit KeptWrenches(std::size_t bodies) : seen_(bodies), rests_(bodies, 0), kept_(bodies) {}

  /// Ahead of an evaluation of all connections. `version` differs after each change of a connection.
  void begin(const CellMotion& motion, std::uint64_t version) {
    if (std::exchange(version_, version) != version)
      for (Kept& kept : kept_) kept.valid = false;
    for (std::size_t body = 0; body < seen_.size(); ++body) {
      rests_[body] = same(seen_[body], motion.bodies[body]) && !motion.has_surface(static_cast<int>(body));
      if (rests_[body] == 0) seen_[body] = motion.bodies[body];
    }
  }
  /// Of the only connection of this Base.
  Wrench of(std::size_t base, const Connection& connection, const CellMotion& motion) {
    Kept& kept = kept_[base];
    const auto target = static_cast<std::size_t>(connection.partner);
    if (kept.valid && rests_[base] != 0 && rests_[target] != 0) return kept.wrench;
    kept.wrench =
        substitute_wrench(connection, motion.bodies[base], motion.carrier(connection.partner), motion.time_s);
    kept.valid = !connection.slides;
    return kept.wrench;
  }

 private:
  static bool same(const BodyMotion& a, const BodyMotion& b) {
    static_assert(sizeof(BodyMotion) == 21 * sizeof(double), "no gaps between the members");
    return std::memcmp(static_cast<const void*>(&a), static_cast<const void*>(&b), sizeof(BodyMotion)) == 0;
  }
  struct Kept {
    Wrench wrench;
    bool valid = false;
  };
  std::vector<BodyMotion> seen_;  ///< by component, as the next two: the motion at the last evaluation
  std::vector<char> rests_;
  std::vector<Kept> kept_;
  std::uint64_t version_ = 0;
};

}  // namespace takt

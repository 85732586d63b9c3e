#pragma once
// The wrenches of connections whose two ends have not moved between two evaluations, and their sums where no connection of a
// component has changed: a sample of a cell with many Parts at rest then costs little. The bits are those of
// substitute_wrench(), added in the order of the connections.
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <utility>
#include <vector>

#include "server/contact/holding/substitute_force.h"

namespace takt {

class KeptWrenches {
 public:
  explicit KeptWrenches(std::size_t bodies)
      : seen_(bodies), rests_(bodies, 0), kept_(bodies), renewed_(bodies, 0), sums_(bodies) {}

  /// Ahead of an evaluation of all connections. `version` differs after each change of a connection.
  void begin(const CellMotion& motion, std::uint64_t version) {
    const bool changed = std::exchange(version_, version) != version;
    if (changed)
      for (Kept& kept : kept_) kept.valid = false;
    std::fill(renewed_.begin(), renewed_.end(), static_cast<char>(changed));
    for (std::size_t body = 0; body < seen_.size(); ++body) {
      const bool rests =
          same(seen_[body], motion.bodies[body]) && !motion.has_surface(static_cast<int>(body));
      rests_[body] = rests ? 1 : 0;
      if (!rests) seen_[body] = motion.bodies[body];
    }
  }
  /// Whether the only connection of this Base has the wrench that it had.
  bool stands(std::size_t base, const Connection& connection) const {
    return kept_[base].valid && rests_[base] != 0 &&
           rests_[static_cast<std::size_t>(connection.partner)] != 0;
  }
  /// Of the only connection of this Base.
  Wrench of(std::size_t base, const Connection& connection, const CellMotion& motion) {
    Kept& kept = kept_[base];
    if (stands(base, connection)) return kept.wrench;
    kept.wrench =
        substitute_wrench(connection, motion.bodies[base], motion.carrier(connection.partner), motion.time_s);
    kept.valid = !connection.slides;
    return kept.wrench;
  }

  // The sums. After begin(): which components get one that differs, then clear_renewed(), then all that adds to those.
  void renew(std::size_t component) { renewed_[component] = 1; }
  bool renews(std::size_t component) const { return renewed_[component] != 0; }
  void clear_renewed() {
    for (std::size_t i = 0; i < sums_.size(); ++i)
      if (renewed_[i] != 0) sums_[i] = {};
  }
  Wrench& sum(std::size_t component) { return sums_[component]; }
  std::span<const Wrench> sums() const { return sums_; }

 private:
  static bool same(const BodyMotion& a, const BodyMotion& b) {
    static_assert(sizeof(BodyMotion) == 21 * sizeof(double), "no gaps between the members");
    return std::memcmp(static_cast<const void*>(&a), static_cast<const void*>(&b), sizeof(BodyMotion)) == 0;
  }
  struct Kept {
    Wrench wrench;
    bool valid = false;
  };
  std::vector<BodyMotion> seen_;  ///< by component, as all below: the motion at the last evaluation
  std::vector<char> rests_;
  std::vector<Kept> kept_;
  std::vector<char> renewed_;
  std::vector<Wrench> sums_;
  std::uint64_t version_ = 0;
};

}  // namespace takt

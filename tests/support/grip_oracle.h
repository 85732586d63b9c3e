#pragma once
// The Parts held by each gripper of a random cell, from snapshots alone: the Parts between the jaws when they
// begin to close, and after the jaws have stopped the Parts on any path of touching Parts from one jaw to the
// other (all paths are tried), until they leave the space between the jaws.
#include <algorithm>
#include <set>
#include <vector>

#include "tests/support/random_assembly.h"

namespace takt::test {

class GripOracle {
 public:
  GripOracle(const RandomCell& cell, double tolerance_m)
      : cell_(cell), tolerance_m_(tolerance_m), grips_(cell.palms.size()) {}

  /// Every step. `before`: the poses on which the step from it to `after` decided.
  void follow(const Snapshot& before, const Snapshot& after) {
    for (std::size_t g = 0; g < grips_.size(); ++g) {
      Grip& grip = grips_[g];
      if (!after.grippers[g].closed) {
        grip = {};
        continue;
      }
      // Jaws that travel stop where they are when a Part has moved into them.
      const bool stopped = after.grippers[g].width_m == before.grippers[g].width_m;
      const bool fresh = !grip.closed, standing = !before.grippers[g].moving || stopped;
      grip.closed = true;
      const std::set<int> between = parts_between(before, g);
      for (auto* list : {&grip.sure, &grip.maybe})
        for (auto part = list->begin(); part != list->end();)
          part = between.count(*part) != 0 ? std::next(part) : list->erase(part);
      if (fresh) {
        for (const int part : between) (near_volume(before, g, part) ? grip.sure : grip.maybe).insert(part);
        if (!standing) continue;
        // Jaws in contact are decided at once.
        for (const int part : between) grip.maybe.insert(part);
        grip.sure.clear();
      } else if (!grip.settled && standing) {
        grip.settled = true;
        settle(before, g, between, grip);
      }
    }
  }
  bool surely(std::size_t gripper, int part) const { return grips_[gripper].sure.count(part) != 0; }
  bool perhaps(std::size_t gripper, int part) const { return grips_[gripper].maybe.count(part) != 0; }

 private:
  using Touching = std::vector<std::vector<char>>;
  struct Grip {
    bool closed = false, settled = false;
    std::set<int> sure, maybe;
  };

  double margin() const { return cell_.model()->interaction.contact_margin_m; }
  Nearness of(const OrientedBox& a, const OrientedBox& b) const {
    return nearness(a, b, margin(), tolerance_m_);
  }
  bool near_volume(const Snapshot& s, std::size_t g, int part) const {
    return of(cell_.box(s, part), cell_.grasp_volume(s, g)) == Nearness::touching;
  }
  std::set<int> parts_between(const Snapshot& s, std::size_t g) const {
    std::set<int> found;
    const OrientedBox volume = cell_.grasp_volume(s, g);
    for (const int part : cell_.parts)
      if (of(cell_.box(s, part), volume) != Nearness::apart) found.insert(part);
    return found;
  }

  void settle(const Snapshot& s, std::size_t g, const std::set<int>& between, Grip& grip) const {
    grip.sure.clear(), grip.maybe.clear();
    const auto& jaws = cell_.model()->grippers[g].parameters.jaws;
    std::vector<int> parts(between.begin(), between.end());
    std::vector<char> left, right;
    bool unclear = false;
    for (const int part : parts) {
      for (const auto& [jaw, list] : {std::pair{jaws[0], &left}, std::pair{jaws[1], &right}}) {
        const Nearness verdict = of(cell_.box(s, jaw), cell_.box(s, part));
        unclear = unclear || verdict == Nearness::unclear;
        list->push_back(verdict == Nearness::touching ? 1 : 0);
      }
      unclear = unclear || !near_volume(s, g, part);
    }
    for (std::size_t i = 0; i < parts.size(); ++i)
      if (left[i] != 0 && right[i] != 0) grip.sure.insert(parts[i]);
    if (grip.sure.empty()) {
      // The number of paths grows with the factorial of the touching Parts.
      constexpr std::size_t kMaxTried = 16;
      unclear = unclear || parts.size() > kMaxTried;
      Touching touching(parts.size(), std::vector<char>(parts.size(), 0));
      for (std::size_t i = 0; !unclear && i < parts.size(); ++i)
        for (std::size_t k = 0; k < parts.size(); ++k)
          touching[i][k] =
              i != k && of(cell_.box(s, parts[i]), cell_.box(s, parts[k])) == Nearness::touching ? 1 : 0;
      for (std::size_t i = 0; !unclear && i < parts.size(); ++i)
        if (left[i] != 0) try_ways(touching, parts, right, {i}, grip.sure);
    }
    if (!unclear) return;
    grip.sure.clear();
    grip.maybe = between;
  }

  void try_ways(const Touching& touching, const std::vector<int>& parts, const std::vector<char>& right,
                const std::vector<std::size_t>& way, std::set<int>& found) const {
    if (right[way.back()] != 0)
      for (const std::size_t i : way) found.insert(parts[i]);
    for (std::size_t next = 0; next < parts.size(); ++next) {
      if (touching[way.back()][next] == 0 || std::find(way.begin(), way.end(), next) != way.end()) continue;
      std::vector<std::size_t> longer = way;
      longer.push_back(next);
      try_ways(touching, parts, right, longer, found);
    }
  }

  const RandomCell& cell_;
  double tolerance_m_;
  std::vector<Grip> grips_;
};

}  // namespace takt::test
